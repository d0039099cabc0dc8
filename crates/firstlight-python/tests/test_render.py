"""Rendering: arrays, files, faults, and how a render is stopped."""

import collections.abc
import json
import re
import threading
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import firstlight as fl

SMALL = {"width": 32, "height": 24, "aa": 2}


def test_buffers_are_arrays_with_the_memory_of_the_film():
    frame = fl.builtin("config11").render(buffers=["color", "depth", "normal", "uv", "object-id"], **SMALL)
    shapes = {name: (array.shape, str(array.dtype)) for name, array in frame.items()}
    assert shapes == {
        "color": ((24, 32, 4), "float32"),
        "depth": ((24, 32), "float32"),
        "normal": ((24, 32, 3), "float32"),
        "uv": ((24, 32, 2), "float32"),
        "object-id": ((24, 32), "uint32"),
    }
    assert all(array.flags.c_contiguous and array.flags.writeable for array in frame.values())
    assert isinstance(frame, collections.abc.Mapping) and len(frame) == 5 and "depth" in frame
    assert frame["color"] is frame["color"] and frame.get("nothing", 3) == 3
    with pytest.raises(KeyError, match="color, depth"):
        frame["deph"]


def test_each_light_is_an_array(tmp_path):
    scene = fl.Scene()
    scene.add_camera(position=[0, 0, 6])
    scene.add_sphere(center=[0, 0, 0], radius=1)
    scene.add_point_light(position=[3, 4, 5], strength=30, name="key")
    scene.add_point_light(position=[-3, 1, 5], strength=10)
    frame = scene.render(buffers=["color", "ambient", "light:*:diffuse", "light:*:specular", "light:key"], **SMALL)
    parts = [frame[f"light:{light}:{part}"] for light in ("key", "#2") for part in ("diffuse", "specular")]
    total = frame["ambient"]
    for part in parts:
        total = total + part
    assert (total == frame["color"][..., :3]).all() and (frame["light:key"] == parts[0] + parts[1]).all()
    frame.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as stored:
        assert (stored["light:key"] == frame["light:key"]).all()
    with pytest.raises(fl.SceneError, match="no light is called"):
        scene.render(buffers=["light:kee"], **SMALL)
    with pytest.raises(ValueError, match="did you mean"):
        scene.render(buffers=["dept"], **SMALL)


def test_files_hold_what_the_arrays_hold(tmp_path):
    frame = fl.builtin("config11").render(buffers=["color", "depth", "object-id"], **SMALL)
    for name in ("a.exr", "a.npz", "a.png", "a.hdr", "a.jpg"):
        frame.save(tmp_path / name)
    usual = (tmp_path / "a.jpg").read_bytes()
    frame.save(tmp_path / "a.jpg", quality=40)
    assert usual.startswith(b"\xff\xd8\xff") and len((tmp_path / "a.jpg").read_bytes()) < len(usual)
    with np.load(tmp_path / "a.npz") as stored:
        assert all((stored[name] == frame[name]).all() for name in frame)
        assert json.loads(str(stored["receipt"]))["scene_hash"] == frame.receipt["scene_hash"]
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as stored:
        assert (stored.channels()["depth.Z"].pixels == frame["depth"]).all()
    assert frame.to_png().startswith(b"\x89PNG") and frame._repr_png_() == frame.to_png()
    assert len(frame.to_png(bits=16)) > len(frame.to_png())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "a.hdr", "a.jpg", "a.npz", "a.png"]
    with pytest.raises(OSError, match="no folder"):
        frame.save(tmp_path / "none" / "a.png")
    with pytest.raises(ValueError, match="not the ending"):
        frame.save(tmp_path / "a.gif")
    with pytest.raises(ValueError, match="quality is for"):
        frame.save(tmp_path / "a.png", quality=40)
    with pytest.raises(ValueError, match="the quality is 0"):
        frame.save(tmp_path / "a.jpg", quality=0)
    with pytest.raises(ValueError, match="not color"):
        fl.builtin("config11").render(buffers=["depth"], **SMALL).to_png()


def test_threads_and_parts_change_no_bit():
    scene = fl.builtin("config22")
    whole = scene.render(**SMALL)["color"]
    assert (scene.render(threads=1, **SMALL)["color"] == whole).all()
    assert (scene.render(crop=(8, 4, 16, 12), **SMALL)["color"] == whole[4:16, 8:24]).all()


def test_wrong_wishes_are_value_errors():
    scene = fl.builtin("config11")
    wishes = [{"buffers": ["colour"]}, {"buffers": []}, {"crop": (30, 0, 9, 9)}, {"aa_mode": "none"}, {"samples": "x"}]
    for wish in wishes:
        with pytest.raises(ValueError):
            scene.render(**{**SMALL, **wish})
    with pytest.raises(TypeError):
        scene.render("color")
    with pytest.raises(fl.SceneError, match="no camera is called"):
        scene.render(camera="nobody", **SMALL)


def test_faults_are_data_and_come_together():
    text = "[camera]\nposition = [0, 0, 5]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = -1\nraduis = 2\n"
    with pytest.raises(fl.SceneError) as caught:
        fl.Scene.from_text(text, name="ball.toml")
    first, second = caught.value.diagnostics
    assert (first.place.file, first.place.line, first.path) == ("ball.toml", 5, "sphere[0].radius")
    assert "did you mean" in second.hint and str(caught.value) == f"{first}\n{second}"
    with pytest.raises(fl.SceneError, match="sphere\\[0\\].radius") as caught:
        fl.Scene.from_dict({"camera": {"position": [0, 0, 5]}, "sphere": [{"center": np.zeros(3), "radius": -1}]})
    assert caught.value.diagnostics[0].place is None
    with pytest.raises(fl.SceneError, match="not a finite number"):
        fl.Scene.from_dict({"camera": {"position": [0, 0, float("nan")]}})
    with pytest.raises(FileNotFoundError):
        fl.Scene.from_file("nowhere.toml")


def test_the_same_scene_in_three_ways(tmp_path):
    text = "[camera]\nposition = [0, 0, 5]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1.5\n"
    text += "[[light.point]]\nposition = [3, 4, 5]\n"
    path = tmp_path / "ball.toml"
    path.write_text(text)
    tree = {
        "camera": {"position": (0, 0, np.float32(5))},
        "sphere": [{"center": np.zeros(3), "radius": np.float64(1.5)}],
        "light": {"point": [{"position": np.array([3, 4, 5])}]},
    }
    scenes = [fl.Scene.from_file(path), fl.Scene.from_text(text), fl.Scene.from_dict(tree)]
    pictures = [scene.render(**SMALL)["color"] for scene in scenes]
    assert len({scene.hash for scene in scenes}) == 1
    assert all((picture == pictures[0]).all() for picture in pictures)
    # What a scene was read from is not written over
    with pytest.raises(ValueError):
        scenes[0].render(**SMALL).save(path)


def test_what_progress_raises_stops_the_render():
    seen = []

    def stop(done, total):
        seen.append((done, total))
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        fl.builtin("config23").render(width=1024, height=1024, aa_mode="full", progress=stop)
    assert len(seen) == 1 and seen[0][1] == 1024 * 1024
    seen.clear()
    fl.builtin("config23").render(progress=lambda *now: seen.append(now), **SMALL)
    assert seen[-1] == (32 * 24, 32 * 24)


def test_an_interrupt_stops_the_render():
    import _thread
    import signal

    # Whoever started the tests may have had it ignored
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            fl.builtin("config23").render(width=1024, height=1024, aa=8, aa_mode="full")
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)


def test_several_threads_render_at_once():
    scene = fl.builtin("config11")
    expected = [scene.render(camera={"position": [x, 0, 10]}, **SMALL)["color"] for x in range(4)]
    found = [None] * 4

    def work(x):
        found[x] = scene.render(camera={"position": [x, 0, 10]}, threads=1, **SMALL)["color"]

    threads = [threading.Thread(target=work, args=(x,)) for x in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((a == b).all() for a, b in zip(found, expected))


def _moving():
    keys = [{"time": 0, "translate": [0, 0, 0]}, {"time": 1, "translate": [1, 0, 0]}]
    scene = fl.Scene()
    scene.add_camera(name="left", position=[0, 0, 10], projection="orthographic", height=4)
    scene.add_camera(name="right", position=[0.5, 0, 10], look_at=[0.5, 0, 0], projection="orthographic", height=4)
    scene.add_parallelogram(p=[-0.5, -0.5, 0], e0=[1, 0, 0], e1=[0, 1, 0], transform={"keys": keys})
    scene.settings.update(width=80, height=40, fps=2)
    return scene


def test_motion_leads_to_a_time_or_a_camera():
    scene = _moving()
    buffers = ["motion", "object-id"]

    def steps(**options):
        frame = scene.render(buffers=buffers, **options)
        seen = frame["motion"][frame["object-id"] == 1]
        assert frame["motion"].shape == (40, 80, 3) and len(seen) > 50 and (seen[:, 1] == 0).all()
        assert np.ptp(seen[:, 0]) < 1e-4
        return float(seen[0, 0]), float(seen[0, 2]), frame.receipt["motion_to"]

    # Ten pixels are a metre
    assert steps(motion_to=0.2) == (pytest.approx(2), 1, "0.2")
    assert steps(motion_to="next") == (pytest.approx(5), 1, "0.5")
    assert steps(motion_to="previous", time=1.0) == (pytest.approx(-5), 1, "0.5")
    assert steps(motion_to="right", time=0.5) == (pytest.approx(-5), 1, '"right"')
    other = {"position": [-0.2, 0, 10], "look_at": [-0.2, 0, 0], "projection": "orthographic", "height": 4}
    assert steps(motion_to=other)[:2] == (pytest.approx(2), 1)
    assert steps(camera=other, motion_to="right")[0] == pytest.approx(-7)
    assert steps(camera="right", motion_to=other)[0] == pytest.approx(7)
    frame = scene.render(buffers=buffers, camera="right", motion_to=fl.Camera(position=[0, 0, 10]))
    assert "intrinsics" not in frame.receipt and "motion_intrinsics" in frame.receipt
    # Its picture is as large as the render's
    sized = fl.Camera(position=[0, 0, 10], width=80, height=40)
    assert scene.render(buffers=buffers, motion_to=sized)["motion"].shape == (40, 80, 3)
    with pytest.raises(ValueError, match="640 x 100 pixels, and the render has 80 x 40"):
        scene.render(buffers=buffers, motion_to=fl.Camera(position=[0, 0, 10], width=640, height=100))
    # There and back: the other picture's own motion
    there = scene.render(buffers=["motion"], time=0.7, motion_to=0.0)["motion"]
    assert (scene.render(buffers=["motion-backward"], motion_to=0.7)["motion-backward"] == there).all()
    # A scene may say it itself
    scene.settings.update(motion_to="right")
    assert steps()[0] == pytest.approx(-5) and steps(camera=other)[0] == pytest.approx(-7)


def test_motion_that_leads_nowhere_is_refused():
    scene = _moving()
    with pytest.raises(fl.SceneError, match="motion_to"):
        scene.render(buffers=["motion"])
    with pytest.raises(ValueError, match="neither is asked for"):
        scene.render(buffers=["depth"], motion_to=1)
    with pytest.raises(fl.SceneError, match='did you mean "right"'):
        scene.render(buffers=["motion"], motion_to="rigt")
    with pytest.raises(TypeError, match="motion_to: a name, a Camera or a dict"):
        scene.render(buffers=["motion"], motion_to=[1])
    with pytest.raises(fl.SceneError, match="in seconds"):
        scene.render(buffers=["motion"], motion_to=float("nan"))


def test_stubs_know_every_buffer():
    stubs = (Path(fl.__file__).parent / "__init__.pyi").read_text()
    names = re.search(r"Buffer = str \| Literal\[(.*?)\]", stubs, re.S).group(1)
    assert set(re.findall(r'"([^"]+)"', names)) == {*fl.BUFFERS, "relight"}


def test_files_take_what_is_for_them(tmp_path):
    frame = _moving().render(buffers=["color", "depth", "alpha"])
    frame.save(tmp_path / "a.exr")
    frame.save(tmp_path / "h.exr", half=True)
    assert (tmp_path / "h.exr").stat().st_size < (tmp_path / "a.exr").stat().st_size
    frame.save(tmp_path / "d.png", buffer="depth", depth_scale=100)
    with pytest.raises(ValueError, match="half is for .exr files"):
        frame.save(tmp_path / "a.npz", half=True)
    with pytest.raises(ValueError, match="depth_scale is for depth and distance"):
        frame.save(tmp_path / "a.exr", depth_scale=100)
    frame.save(tmp_path / "depth.npy", buffer="depth")
    with open(tmp_path / "depth.npy", "rb") as file:
        assert (np.load(file) == frame["depth"]).all()
        assert json.loads(str(np.load(file)))["buffers"] == '["depth"]'

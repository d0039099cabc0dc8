"""What data sets are made of: 8-bit pictures, names, annotations."""

import json
import pickle

import numpy as np
import pytest

import firstlight as fl

SIZE = {"width": 32, "height": 24, "aa": 1}


def room():
    scene = fl.Scene()
    scene.add_camera(position=[0, 2, 8], look_at=[0, 1, 0])
    scene.add_camera(name="near", position=[0, 1, 3], look_at=[0, 1, 0])
    scene.add_box(center=[0, -0.5, 0], size=[8, 1, 8], name="floor")
    for name, x in (("set/ball", 0), ("other/ball", -2)):
        scene.add_sphere(center=[x, 1, 0], radius=0.8, name=name)
    scene.add_sphere(center=[2, 1, 0], radius=0.5)
    lamp = {"center": [0, 2.9, -1], "e0": [3, 0, 0], "e1": [0, 0.6, 0], "strength": 20, "sides": "both"}
    scene.add_rectangle_light(name="lamp", visible=True, **lamp)
    return scene


def decoded(png):
    """The samples of a PNG file, by the little that its format asks for."""
    import struct
    import zlib

    at, data = 8, b""
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at : at + 8])
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", png[at + 8 : at + 18])
        data += png[at + 8 : at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    channels = {2: 3, 6: 4}[color]
    assert depth == 8
    rows = np.frombuffer(zlib.decompress(data), dtype=np.uint8).reshape(height, 1 + width * channels)
    out = np.zeros((height + 1, (width + 1) * channels), dtype=int)
    for y, (how, line) in enumerate(zip(rows[:, 0], rows[:, 1:].astype(int))):
        for x, value in enumerate(line):
            left, up, both = out[y + 1, x], out[y, x + channels], out[y, x]
            near = min((left, up, both), key=lambda one: (abs(left + up - both - one),))
            out[y + 1, x + channels] = (value + [0, left, up, (left + up) // 2, near][how]) % 256
    return out[1:, channels:].reshape(height, width, channels).astype(np.uint8)


def test_pictures_of_8_bits_are_those_of_files():
    scene = room()
    frame = scene.render(**SIZE)
    rgb = frame.rgb8()
    assert (rgb.shape, rgb.dtype) == ((24, 32, 3), np.uint8) and (rgb == decoded(frame.to_png())).all()
    rgba = frame.rgb8(alpha=True)
    assert rgba.shape == (24, 32, 4) and (rgba[..., :3] == rgb).all() and (rgba[..., 3] == 255).all()
    scene.settings.update(transparent=True, exposure=1, display="gamma", gamma=1.8)
    frame = scene.render(aa_mode="full", **{**SIZE, "aa": 3})
    rgba = frame.rgb8(alpha=True)
    assert (rgba == decoded(frame.to_png())).all() and 0 < rgba[..., 3].min() + 1 < rgba[..., 3].max()
    # Without alpha what is transparent lies on black
    encoded = np.clip(2 * frame["color"][..., :3].astype(float), 0, 1) ** (1 / 1.8) * 255
    assert np.abs(frame.rgb8() - encoded).max() <= 0.5 + 1e-3
    # As the array is now, of a part, and of a render that was pickled
    frame["color"][:] = 0.25
    assert (pickle.loads(pickle.dumps(frame)).rgb8() == frame.rgb8()).all() and len(np.unique(frame.rgb8())) == 1
    assert scene.render(crop=(3, 4, 5, 6), **SIZE).rgb8().shape == (6, 5, 3)
    with pytest.raises(ValueError, match="the render has depth, and not color"):
        scene.render(buffers="depth", **SIZE).rgb8()


def test_names_of_objects():
    frame = room().render(buffers=["object-id"], **SIZE)
    assert frame.object_names == ["set/ball", "other/ball", None, "floor", "lamp"]
    assert frame.object_names == json.loads(frame.receipt["object_names"])
    assert pickle.loads(pickle.dumps(frame)).object_names == frame.object_names
    with pytest.raises(ValueError, match="object-id does"):
        room().render(**SIZE).object_names


def told(coco):
    data = json.loads(coco.to_json())
    return data, [one["name"] for one in data["categories"]], [one["object_name"] for one in data["annotations"]]


def test_a_frame_is_annotated():
    scene, coco = room(), fl.Coco()
    buffers = ["color", "object-id"]
    for number, frame in enumerate(scene.render_many(["near", {"position": [0, 2, 8]}], buffers=buffers, **SIZE)):
        assert coco.add(frame, f"{number}.png") is frame
    data, categories, objects = told(coco)
    assert [one["file_name"] for one in data["images"]] == ["0.png", "1.png"]
    # Lights are none of them
    assert sorted(categories) == ["ball", "floor", "unnamed"] and "lamp" not in objects
    assert repr(coco) == f"<firstlight.Coco: 2 pictures, {len(objects)} annotations, 3 categories>"
    # Visible areas are those of the ids
    for one in data["annotations"]:
        if one["image_id"] == 2:
            assert one["area"] == (frame["object-id"] == one["object_id"]).sum() <= one["amodal_area"]
    # Although one is seen
    assert (frame["object-id"] == frame.object_names.index("lamp") + 1).any()


@pytest.mark.parametrize(
    ("only", "categories", "objects"),
    [
        ("lamp", ["lamp"], ["lamp"]),
        (["ball"], ["ball"], ["set/ball", "other/ball"]),
        (["other/ball", "floor"], ["ball", "floor"], ["other/ball", "floor"]),
        (["unnamed"], ["unnamed"], [None]),
        ([], [], []),
    ],
)
def test_only_some_objects_are_annotated(only, categories, objects):
    coco = fl.Coco()
    frame = coco.add(room(), "a.png", only=only, buffers="depth", **SIZE)
    assert list(frame) == ["depth", "object-id"]
    data, found, annotated = told(coco)
    assert (found, annotated, len(data["images"])) == (categories, objects, 1)
    # The same masks as among all others
    everything = fl.Coco()
    everything.add(frame, "a.png", only=["ball", "floor", "lamp", "unnamed"])
    masks = {one["object_name"]: one["amodal_segmentation"] for one in told(everything)[0]["annotations"]}
    assert all(masks[one["object_name"]] == one["amodal_segmentation"] for one in data["annotations"])


def test_a_scene_is_rendered_and_annotated_at_once(tmp_path):
    scene, coco = room(), fl.Coco()
    frame = coco.add(scene, tmp_path / "a.png", camera="near", **SIZE)
    assert list(frame) == ["color", "object-id"]
    assert (frame["color"] == scene.render(camera="near", **SIZE)["color"]).all()
    other = fl.Coco()
    other.add(scene.render(camera="near", buffers=["object-id"], **SIZE), str(tmp_path / "a.png"))
    assert other.to_json() == coco.to_json()
    # A part of the film
    part = coco.add(scene, "part.png", camera="near", crop=(4, 3, 20, 15), **SIZE)
    data = told(coco)[0]
    assert [data["images"][1][key] for key in ("width", "height")] == [20, 15]
    areas = {one["object_id"]: one["area"] for one in data["annotations"] if one["image_id"] == 2}
    assert areas == {k: int((part["object-id"] == k).sum()) for k in np.unique(part["object-id"]) if k not in (0, 5)}
    # Buffers that the scene says
    scene.settings.update(buffers=["normal"])
    assert list(coco.add(scene, "b.png", **SIZE)) == ["normal", "object-id"]


def test_what_cannot_be_annotated_is_said():
    scene, coco = room(), fl.Coco()
    frame = scene.render(buffers=["object-id"], **SIZE)
    with pytest.raises(ValueError, match='no object is called "balls"; did you mean "ball"'):
        coco.add(frame, "a.png", only=["balls"])
    with pytest.raises(ValueError, match="and not object-id"):
        coco.add(scene.render(**SIZE), "a.png")
    with pytest.raises(ValueError, match="lost its scene"):
        coco.add(pickle.loads(pickle.dumps(frame)), "a.png")
    with pytest.raises(TypeError, match="camera: the picture is rendered already"):
        coco.add(frame, "a.png", camera="near")
    with pytest.raises(TypeError, match="a Render or a Scene is wanted, not int"):
        coco.add(3, "a.png")
    frame["object-id"][0, 0] = 99
    with pytest.raises(ValueError, match="there is no object 99"):
        coco.add(frame, "a.png")
    assert json.loads(coco.to_json())["images"] == []


def test_names_of_buffers_and_cameras_are_helped_with():
    scene = room()
    assert list(scene.render(buffers="depth", **SIZE)) == ["depth"]
    assert list(next(iter(scene.render_many(["near"], buffers="depth", **SIZE)))) == ["depth"]
    for wrong, hint in (("dept", "depth"), ("colour", "color")):
        with pytest.raises(ValueError, match=f'did you mean "{hint}"'):
            scene.render(buffers=wrong, **SIZE)
    for wrong in (3, [3], [["depth"]], None):
        if wrong is not None:
            with pytest.raises(TypeError, match="buffers: a name or a list of names is wanted"):
                scene.render(buffers=wrong, **SIZE)
    with pytest.raises(fl.SceneError, match='did you mean "near"'):
        scene.render(camera="neer", **SIZE)
    for buffers, hint in (("light:lampe", "lamp"), ("coverage:flor", "floor")):
        with pytest.raises(fl.SceneError, match=f'did you mean "{hint}"'):
            scene.render(buffers=buffers, **SIZE)
    frame = scene.render(buffers=["color", "depth"], **SIZE)
    with pytest.raises(KeyError, match='did you mean "depth"'):
        frame["deph"]
    with pytest.raises(ValueError, match='did you mean "depth"'):
        frame.save("a.png", buffer="deph")

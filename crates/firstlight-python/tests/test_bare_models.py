"""Models by themselves: the bits of the program, from files and from memory, and in scenes of one's own."""

import base64
import io
import json
import os
import pathlib
import pickle
import shutil
import struct
import subprocess
import warnings

import numpy as np
import pytest

import firstlight as fl

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
MTL = "newmtl red\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 20\n"
SIZE = 24


def program():
    """The program that was built with the package, if it was."""
    beside = pathlib.Path(fl.__file__).parents[3] / "debug" / ("firstlight.exe" if os.name == "nt" else "firstlight")
    found = str(beside) if beside.is_file() else shutil.which("firstlight")
    return found or pytest.skip("the program is not there")


def gltf():
    """A chair of one triangle and its mirror image, which folds, with a variant and a camera."""
    corners = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    times, moves = struct.pack("<2f", 0, 1), struct.pack("<6f", 0, 0, 0, 0.5, 0.25, -1)
    data = corners + times + moves
    views = [(0, 36), (36, 8), (44, 24)]
    colors = {"light": [0.8, 0.7, 0.5, 1], "dark": [0.1, 0.05, 0.02, 1]}
    pbr = [{"baseColorFactor": color, "metallicFactor": 0} for color in colors.values()]
    mappings = {"mappings": [{"material": 1, "variants": [0]}]}
    primitive = {"attributes": {"POSITION": 0}, "material": 0, "extensions": {"KHR_materials_variants": mappings}}
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_variants"],
        "extensions": {"KHR_materials_variants": {"variants": [{"name": "dark"}]}},
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": length} for start, length in views],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3},
            {"bufferView": 1, "componentType": 5126, "type": "SCALAR", "count": 2, "min": [0], "max": [1]},
            {"bufferView": 2, "componentType": 5126, "type": "VEC3", "count": 2},
        ],
        "materials": [
            {"name": name, "doubleSided": True, "pbrMetallicRoughness": own} for name, own in zip(colors, pbr)
        ],
        "meshes": [{"primitives": [primitive]}],
        "cameras": [{"name": "entry", "type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "nodes": [
            {"name": "seat", "mesh": 0},
            {"name": "back", "mesh": 0, "scale": [-1, 1, 1]},
            {"name": "entry", "camera": 0, "translation": [0, 0.3, 3]},
        ],
        "scenes": [{"nodes": [0, 1, 2]}],
        "animations": [
            {
                "name": "fold",
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                "samplers": [{"input": 1, "output": 2}],
            }
        ],
    }


@pytest.fixture
def models(tmp_path, monkeypatch):
    """The folder of some models, which is the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "chair.gltf").write_text(json.dumps(gltf()))
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + TETRAHEDRON)
    (tmp_path / "a.mtl").write_text(MTL)
    return tmp_path


# What the program is told, and the same in Python: of the scene, and of the render
CASES = [
    ("a.obj", "", {}, {}),
    ("a.obj", "--studio hard --view 30,20 --margin 0.1", {"studio": "hard", "view": (30, 20), "margin": 0.1}, {}),
    ("a.obj", "--view top --margin 0", {}, {"view": "top", "margin": 0}),
    (
        "a.obj",
        "--studio clay --up z --transparent --ground off --smooth 0",
        {"studio": "clay", "up": "z", "transparent": True, "ground": False, "smooth_deg": 0},
        {},
    ),
    ("a.obj", "--studio flat --background #336699", {"studio": "flat", "background": "#336699"}, {}),
    ("a.obj", "--ground on --studio hard --tolerance 1", {"ground": True, "studio": "hard", "tolerance": 1}, {}),
    ("a.obj", "--aa-mode adaptive --aa 2", {}, {"aa_mode": "adaptive", "aa": 2}),
    ("chair.gltf", "--variant dark --view iso", {"variant": "dark", "view": "iso"}, {}),
    ("chair.gltf", "--time 0.75", {}, {"time": 0.75}),
    ("chair.gltf", "--time 0.75 --animation fold", {"animation": "fold"}, {"time": 0.75}),
    ("chair.gltf", "--camera entry", {}, {"camera": "entry"}),
]


@pytest.mark.parametrize(("file", "options", "made", "rendered"), CASES, ids=[f"{c[0]} {c[1]}" for c in CASES])
def test_the_bits_are_those_of_the_program(models, file, options, made, rendered):
    command = [program(), "render", file, "--size", str(SIZE), *options.split(), "-o", "p.png", "-o", "p.exr"]
    subprocess.run(command, check=True, capture_output=True)
    scene = fl.Scene.from_model(file, width=SIZE, **made)
    frame = scene.render(**rendered)
    # With the receipt: the same scene, and the same settings
    assert frame.to_png() == (models / "p.png").read_bytes()
    frame.save("own.exr")
    assert (models / "own.exr").read_bytes() == (models / "p.exr").read_bytes()
    again = pickle.loads(pickle.dumps(scene)).render(**rendered)
    assert again.to_png() == frame.to_png()
    assert len(np.unique(frame["color"].reshape(-1, 4), axis=0)) > 1


def test_what_a_call_shows_changes_the_picture(models):
    scene = fl.Scene.from_model("chair.gltf", width=SIZE)
    still = scene.render()["color"]
    assert (scene.render(time=0)["color"] == still).all() and (scene.render()["color"] == still).all()
    for other in ({"time": 0.75}, {"camera": "entry"}, {"view": "back"}, {"margin": 0.3}):
        assert (scene.render(**other)["color"] != still).any(), other
    assert (scene.render()["color"] == still).all()
    dark = fl.Scene.from_model("chair.gltf", width=SIZE, variant="dark")
    assert (dark.render()["color"] != still).any()
    # What is asked without a picture as well
    up = scene.cast([0.6, 0.35, 5], [0, 0, -1], time=1.0)
    assert up.hit and up.position[2] == pytest.approx(-1)


def test_bytes_and_open_files_are_models(models):
    expected = fl.Scene.from_model("a.obj", width=SIZE).render()["color"]
    content = (models / "a.obj").read_bytes()
    scenes = [
        fl.Scene.from_model(content, width=SIZE, assets=models),
        fl.Scene.from_model(io.BytesIO(content), name="b.obj", height=SIZE, assets={"a.mtl": MTL.encode()}),
    ]
    with open(models / "a.obj", "rb") as file:
        scenes.append(fl.Scene.from_model(file, width=SIZE, assets=models))
    for scene in scenes:
        assert scene.size == (SIZE, SIZE)
        assert (scene.render()["color"] == expected).all()
        assert (pickle.loads(pickle.dumps(scene)).render()["color"] == expected).all()
    own = fl.Scene()
    handle = own.add_model((models / "chair.gltf").read_bytes(), name="chair", studio="soft")
    assert handle.kind == "model"
    own.settings.update(width=SIZE, height=SIZE)
    expected = fl.Scene.from_model("chair.gltf", width=SIZE).render()["color"]
    assert (own.render()["color"] == expected).all()
    with pytest.raises(TypeError, match="open it as 'rb'"):
        fl.Scene.from_model(open(models / "a.obj"))


def test_a_studio_lights_scenes_of_ones_own(models):
    bare = fl.Scene.from_model("a.obj", view="front", margin=0.1, width=SIZE, background="#fff").render()["color"]
    scene = fl.Scene()
    scene.add_model("a.obj", studio="soft", view="front", margin=0.1, background="#fff")
    scene.settings.update(width=SIZE, height=SIZE)
    assert (scene.render()["color"] == bare).all()
    # As text it has what was found
    again = fl.Scene.from_text(scene.to_toml(), assets=models)
    assert (again.render(aa_mode="multisample")["color"] == bare).all()
    assert (pickle.loads(pickle.dumps(scene)).render()["color"] == bare).all()
    # With things and a camera of its own; the model from a path below the working folder
    (models / "below").mkdir()
    for name in ("a.obj", "a.mtl"):
        shutil.copy(models / name, models / "below" / name)
    scene = fl.Scene()
    scene.add_camera(position=[2, 2, 4])
    scene.add_sphere(center=[1.5, 0.5, 0], radius=0.5, name="ball")
    scene.add_model(models / "below" / "a.obj", name="solid")
    scene.add_model(pathlib.Path("below", "a.obj"), transform={"translate": [-1.5, 0, 0]})
    scene.settings.update(width=SIZE, height=SIZE)
    with pytest.warns(fl.SceneWarning, match="there is no light"):
        assert not scene.render()["color"][..., :3].any()
    scene.use_studio("hard", ground=True)
    frame = scene.render(buffers=["color", "object-id"])
    assert frame["color"].max() > 0.5 and frame.object_names[0] == "ball"
    # Red as its MTL file says
    red = frame["color"][frame["object-id"] == 1 + frame.object_names.index("solid")]
    assert (red[:, 0] > 2 * red[:, 1]).any()
    with pytest.raises(ValueError, match="view is for the camera that is found"):
        scene.use_studio("hard", view="front")
    with pytest.raises(ValueError, match="margin is for the camera that is found"):
        scene.render(margin=0.1)
    scene.clear()
    scene.add_sphere(center=[0, 0, 0], radius=1)
    assert "[[light" not in scene.to_toml() and scene.render(width=8, height=8)["color"].any()


def test_a_scene_without_a_camera_is_seen_from_a_view():
    scene = fl.Scene()
    scene.add_box(center=[0, 0, 0], size=[1, 2, 3])
    for view, size in (("front", [1, 2]), ("right", [3, 2]), ((0, 90), [1, 3])):
        seen = scene.render(width=60, height=60, view=view, margin=0, buffers="opacity", aa=1)["opacity"] > 0
        shape = np.array([seen.any(axis=0).sum(), seen.any(axis=1).sum()])
        assert shape.max() == 60 and np.isclose(shape[0] / shape[1], size[0] / size[1], rtol=0.05), view


def thing(**fields):
    """Half of a square as trimesh has it."""
    from types import SimpleNamespace

    vertices = np.array([[-1, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float64)
    visual = SimpleNamespace(kind=None)
    return SimpleNamespace(vertices=vertices, faces=np.array([[0, 1, 2]]), visual=visual, _cache={}, **fields)


@pytest.mark.parametrize("studio", ["soft", "hard", "flat", "clay"])
def test_meshes_of_other_packages_are_models(studio):
    own = fl.Scene()
    handle = own.add_model(thing(), studio=studio, view="front")
    own.settings.update(width=SIZE, height=SIZE)
    frame = own.render(buffers=["color", "albedo", "opacity"])
    bare = fl.Scene.from_model(thing(), studio=studio, view="front", width=SIZE).render()
    assert (frame["color"] == bare["color"]).all()
    kind = own._item(*own._find(handle["material"], "material"))[1] if handle["material"] else None
    assert kind == {"flat": "unlit", "clay": "metallic-roughness"}.get(studio)
    if studio == "flat":
        assert np.allclose(frame["color"][SIZE // 2, SIZE // 2, :3], frame["albedo"][SIZE // 2, SIZE // 2])
    turned = fl.Scene.from_model(thing(), up="z", view="top", studio=studio, width=SIZE)
    assert np.allclose(turned.bounds, [[-1, 0, -1], [1, 0, 0]], atol=1e-5)
    assert fl.Scene().add_mesh(thing(), name="half").name == "half"


def test_what_is_wrong_is_said(models):
    for wrong, message in (
        ({"studio": "sofd"}, 'studio is "sofd"; it is one of soft, hard, flat, clay, none; did you mean "soft"'),
        ({"view": "frnt"}, 'did you mean "front"'),
        ({"view": (1, 99)}, "the elevation from -90 to 90"),
        ({"margin": 0.5}, "margin is 0.5; it is from 0 to 0.45"),
        ({"up": "x"}, 'up is "x"; it is one of y, z'),
        ({"variant": "dark"}, "a.obj: variant: it is for glTF files"),
        ({"widht": 3}, 'did you mean "width"'),
    ):
        with pytest.raises(ValueError, match=message):
            fl.Scene.from_model("a.obj", **wrong)
    with pytest.raises(TypeError, match="ground: True or False is wanted, not on"):
        fl.Scene.from_model("a.obj", ground="on")
    with pytest.raises(TypeError, match="variant is for glTF files, and this is a SimpleNamespace"):
        fl.Scene.from_model(thing(), variant="dark")
    with pytest.raises(TypeError, match="a dict has neither vertices"):
        fl.Scene.from_model({})
    with pytest.raises(fl.SceneError, match='no variant "drak".*dark|"drak"'):
        fl.Scene.from_model("chair.gltf", variant="drak")
    with pytest.raises(FileNotFoundError, match="none.glb"):
        fl.Scene.from_model("none.glb")
    with pytest.raises(OSError, match="is a directory"):
        fl.Scene.from_model(models)
    with pytest.raises(ValueError, match="ground is for studios"):
        fl.Scene().add_model("a.obj", ground=True)
    # Nothing stays of a model that could not be added
    scene = fl.Scene()
    for wrong in ({"view": "frnt"}, {"studio": "sofd"}, {"background": "fuchsa"}, {"raduis": 1}):
        with pytest.raises(ValueError):
            scene.add_model("a.obj", **wrong)
    assert dict(scene._counts())["shape"] == 0
    # A picture does not replace the model
    with pytest.raises((OSError, ValueError), match="a.obj"):
        fl.Scene.from_model("a.obj", width=8).render().save("a.obj", buffer="color")


def test_models_bring_no_warning_of_their_own(models):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fl.Scene.from_model("a.obj", width=16).render()
        fl.Scene.from_model("chair.gltf", width=16).render()

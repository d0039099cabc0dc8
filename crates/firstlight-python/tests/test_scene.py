"""Scenes that are built, changed, asked and pickled; cameras."""

import itertools
import json
import pickle
import pydoc
import warnings

import numpy as np
import pytest

import firstlight as fl

SMALL = {"width": 24, "height": 18, "aa": 2}
FLOOR = np.array([[-5, 0, -5], [5, 0, -5], [5, 0, 5], [-5, 0, 5]], dtype=np.float64)
FACES = np.array([[0, 2, 1], [0, 3, 2]])


def room(vertices=FLOOR, faces=FACES, **floor):
    scene = fl.Scene()
    scene.add_camera(position=[0, 3, 8], look_at=[0, 1, 0])
    scene.add_phong_material("red", diffuse=[0.8, 0.1, 0.1])
    scene.add_sphere(center=[0, 1, 0], radius=1, material="red", name="ball")
    scene.add_mesh(vertices, faces, name="floor", **floor)
    scene.add_rectangle_light(center=[0, 5, 0], e0=[2, 0, 0], e1=[0, 0, 2], strength=20, name="lamp")
    return scene


@pytest.mark.parametrize("vertices", [np.float32, np.float64, np.int16, ">f8"])
@pytest.mark.parametrize("faces", [np.int8, np.uint8, np.int32, np.uint32, np.int64, np.uint64])
def test_arrays_of_all_types_and_orders(vertices, faces):
    expected = room().render(**SMALL)["color"]
    wide = np.zeros((4, 6), dtype=vertices)
    wide[:, ::2] = FLOOR
    for strided in (np.asfortranarray(FLOOR.astype(vertices)), wide[:, ::2]):
        found = room(strided, np.asfortranarray(FACES.astype(faces))).render(**SMALL)["color"]
        assert (found == expected).all()


def test_faults_of_meshes_name_the_row():
    scene = fl.Scene()
    with pytest.raises(fl.SceneError, match=r"faces\[1\]: there is no vertex 4"):
        scene.add_mesh(FLOOR, [[0, 1, 2], [0, 1, 4]])
    with pytest.raises(ValueError, match=r"faces\[0\]: there is no vertex -1"):
        scene.add_mesh(FLOOR, [[0, 1, -1]])
    with pytest.raises(ValueError, match="shape"):
        scene.add_mesh(FLOOR.ravel(), FACES)
    with pytest.raises(ValueError, match="faces"):
        scene.add_mesh(FLOOR, FACES.astype(float))
    with pytest.raises(fl.SceneError, match="normals"):
        scene.add_mesh(FLOOR, FACES, normals=FLOOR[:2])
    with pytest.raises(fl.SceneError, match="did you mean \"material\""):
        scene.add_mesh(FLOOR, FACES, materiel="red")
    with pytest.raises(fl.SceneError, match="did you mean \"radius\""):
        scene.add_sphere(center=[0, 0, 0], raduis=1)


@pytest.mark.filterwarnings("ignore::firstlight.SceneWarning")
def test_textures_choose_among_several_sets_of_uv():
    one, other = FLOOR[:, [0, 2]] / 8, FLOOR[:, [2, 0]] / 3

    def planes(uv, first, second, **mesh):
        scene = fl.Scene.from_text("[camera]\nposition = [0, 5, 5]\n")
        scene.add_checkerboard_texture("color", counts=[5, 3], **first)
        scene.add_checkerboard_texture("glow", counts=[2, 7], **second)
        scene.add_metallic_roughness_material(
            "both", base_color={"texture": "color"}, occlusion={"texture": "glow"}, emissive={"texture": "glow"}
        )
        scene.add_mesh(FLOOR, FACES, uv=uv, material="both", **mesh)
        found = pickle.loads(pickle.dumps(scene)).render(buffers=["albedo", "emission"], **SMALL)
        return found["albedo"], found["emission"]

    color, _ = planes(one, {}, {})
    _, glow = planes(other, {}, {})
    assert color.std() > 0.1 and glow.std() > 0.1
    for static in (False, True):
        for both in ([one, other], np.array([one, other], "f4")):
            found = planes(both, {}, {"uv_set": 1}, static=static)
            assert (found[0] == color).all() and (found[1] == glow).all()
        found = planes([other, one], {"uv_set": 1}, {"uv_set": 0}, uv_set=1, static=static)
        assert (found[0] == color).all() and (found[1] == glow).all()
    with pytest.raises(fl.SceneError, match='the texture "glow" of the material "both" has uv_set 2: .* has 2 sets'):
        planes([one, other], {}, {"uv_set": 2})
    with pytest.raises(fl.SceneError, match=r"uv_set: 4 is outside 0 to 3"):
        planes([one, other], {}, {"uv_set": 4})
    with pytest.raises(ValueError):
        fl.Scene().add_mesh(FLOOR, FACES, uv=[one, other[:3]])
    for wrong, words in ((np.zeros((2, 4, 3)), r"uv\[0\].*\(n, 2\)"), (np.zeros((1, 2, 4, 2)), "uv:")):
        with pytest.raises(ValueError, match=words):
            fl.Scene().add_mesh(FLOOR, FACES, uv=wrong)
    bad = np.array([one, other])
    bad[1, 2] = np.nan
    with pytest.raises(fl.SceneError, match=r"uv\[1\]\[2\]: .*NaN"):
        fl.Scene().add_mesh(FLOOR, FACES, uv=bad)
    with pytest.raises(fl.SceneError, match=r"uv\[0\]: 5 of them for 4 positions"):
        fl.Scene().add_mesh(FLOOR, FACES, uv=np.zeros((2, 5, 2)))


def test_things_move_by_their_handles():
    scene = room()
    before = scene.render(**SMALL)["color"]
    up = np.eye(4)
    up[1, 3] = 0.5
    scene["floor"].transform = up
    assert (scene["floor"].transform == up).all()
    assert (scene.render(**SMALL)["color"] != before).any()
    scene["floor"].transform = None
    assert (scene.render(**SMALL)["color"] == before).all()
    scene["lamp"]["strength"] = 0
    assert scene.render(**SMALL)["color"][..., :3].max() == 0
    assert (scene["lamp"].kind, scene["ball"]["radius"], "floor" in scene) == ("rectangle", 1, True)
    with pytest.raises(KeyError):
        scene["table"]
    with pytest.raises(fl.SceneError, match="taken"):
        scene.add_phong_material("red")


def test_pickled_renders_are_the_same(tmp_path):
    scene = room()
    scene.settings.update(display="gamma", gamma=2.4, exposure=0.5)
    frame = scene.render(buffers=["color", "object-id", "light:lamp"], crop=(2, 3, 16, 12), **SMALL)
    other = pickle.loads(pickle.dumps(frame))
    assert list(other) == list(frame) and other.receipt == frame.receipt
    assert all((other[name] == frame[name]).all() for name in frame)
    assert (other.window, other.film_size) == (frame.window, frame.film_size)
    assert other.to_png() == frame.to_png()
    for which, name in ((frame, "a.npz"), (other, "b.npz")):
        which.save(tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_pickled_scenes_are_the_same(tmp_path):
    scene = room()
    other = pickle.loads(pickle.dumps(scene))
    assert other.hash == scene.hash
    assert (other.render(**SMALL)["color"] == scene.render(**SMALL)["color"]).all()
    # With the bytes of their files
    ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    ply += "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    (tmp_path / "t.ply").write_text(ply)
    (tmp_path / "s.toml").write_text("[camera]\nposition = [0, 0, 3]\n[[mesh]]\nfile = \"t.ply\"\n")
    scene = fl.Scene.from_file(tmp_path / "s.toml")
    stored = pickle.dumps(scene)
    (tmp_path / "t.ply").unlink()
    ids = pickle.loads(stored).render(buffers=["object-id"], **SMALL)["object-id"]
    assert ids.max() == 1


def test_rays_and_lights_are_asked():
    scene = room()
    hits = scene.cast([0, 5, 0], [[0, -2, 0], [0, 1, 0], [1, -1, 0]])
    assert hits.hit.tolist() == [True, False, True]
    assert hits.distance[0] == 3 and np.isinf(hits.distance[1])
    assert np.allclose(hits.position[0], [0, 2, 0]) and np.allclose(hits.normal[0], [0, 1, 0])
    assert hits.object_id.tolist() == [1, 0, 2] and hits.primitive_id[2] in (1, 2)
    seen = scene.visible([[0, 0, 0], [4, 0, 0], [1.2, 0, 0]], light="lamp", normals=[0, 1, 0])
    assert seen.dtype == np.float32 and seen[0] == 0 and seen[1] == 1 and 0 < seen[2] < 1
    with pytest.raises(KeyError, match='did you mean "lamp"'):
        scene.visible([[0, 0, 0]], light="lampe")


def test_lights_are_counted_as_buffers_count_them():
    scene = room()
    scene.add_point_light(position=[3, 5, 0], strength=9)
    points = [[0, 0, 0], [1.2, 0, 0]]
    # Kind by kind: the point light is the first
    frame = scene.render(buffers=["light:#1", "light:#2"], **SMALL)
    assert list(frame) == ["light:#1", "light:lamp"]
    for light, name in ((1, "#1"), (2, "#2"), (np.int64(2), "lamp")):
        assert (scene.visible(points, light=light) == scene.visible(points, light=name)).all()
    assert (scene.visible(points, light=1) != scene.visible(points, light=2)).any()
    for wrong in (0, 3, -1, "#0", "#3"):
        with pytest.raises(KeyError, match="the scene has 2, from 1 on, named lamp"):
            scene.visible(points, light=wrong)
    with pytest.raises(KeyError, match="the scene has none"):
        fl.Scene.from_dict({"camera": {"position": [0, 0, 1]}}).visible(points, light=1)


def test_many_cameras_come_in_order():
    scene = room()
    cameras = [fl.Camera(position=[x, 3, 8]) for x in range(5)]
    expected = [scene.render(camera=camera, **SMALL) for camera in cameras]
    for one, other in zip(scene.render_many(cameras, **SMALL), expected, strict=True):
        assert (one["color"] == other["color"]).all() and one.receipt == other.receipt
    endless = ({"position": [0, 3, 8 + x]} for x in itertools.count())
    assert len(list(itertools.islice(scene.render_many(endless, buffers=["depth"], **SMALL), 3))) == 3


def test_a_camera_matrix_projects_exactly():
    scene = room()
    pose = np.array([[1, 0, 0, 0.25], [0, -1, 0, 1.5], [0, 0, -1, 8], [0, 0, 0, 1.0]])
    K = np.array([[61.5, 0, 20.25], [0, 57.25, 13.75], [0, 0, 1]])
    camera = fl.Camera.from_K(K, width=40, height=30, pose=pose)
    frame = scene.render(camera=camera, buffers=["position", "depth", "object-id"])
    assert np.array_equal(np.array(frame.receipt["intrinsics"].split(), float).reshape(3, 3), K)
    E = np.array(frame.receipt["opencv_camera_from_world"].split(), float).reshape(4, 4)
    assert np.allclose(E @ pose, np.eye(4), atol=1e-6)
    rows, columns = np.nonzero(frame["object-id"])
    p = frame["position"][rows, columns] @ E[:3, :3].T + E[:3, 3]
    pixels = p @ K.T / p[:, 2:]
    assert np.allclose(pixels[:, 0], columns + 0.5, atol=1e-4) and np.allclose(pixels[:, 1], rows + 0.5, atol=1e-4)
    assert np.allclose(p[:, 2], frame["depth"][rows, columns], rtol=1e-6)
    # OpenCV's functions count from the middle of the first pixel; OpenGL's camera looks the other way
    moved = K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
    opengl = pose @ np.diag([1, -1, -1, 1])
    same = fl.Camera.from_pose(opengl, K=moved, pixel_center=0, width=40, height=30, convention="opengl")
    assert same.to_dict() == camera.to_dict()
    with pytest.raises(ValueError, match="resized"):
        scene.render(camera=camera, width=80, height=60)
    assert scene.render(camera=camera.resized(80, 60), buffers=["depth"])["depth"].shape == (60, 80)
    for bad in (2 * pose, pose[:2], np.diag([1, 1, -1, 1.0])):
        with pytest.raises(ValueError):
            fl.Camera.from_pose(bad)


def test_things_are_removed():
    scene = room()
    before = scene.render(buffers=["color", "object-id"], **SMALL)
    balls = [scene.add_sphere(center=[x, 1, 0], radius=0.5, name=f"ball {x}") for x in (-2, 2)]
    lamp = scene["lamp"]
    scene.add_mesh(FLOOR + [0, 1, 0], FACES, name="shelf")
    assert "mesh-1" in scene.to_toml()
    # Handles stay those of their things
    del scene["ball -2"]
    assert balls[1].name == "ball 2" and balls[1]["center"] == [2, 1, 0]
    assert repr(balls[0]) == "<firstlight.Handle of a shape that was removed>"
    for use in (lambda: balls[0].fields, lambda: balls[0].update(radius=1), lambda: scene.remove(balls[0])):
        with pytest.raises(KeyError, match="was removed"):
            use()
    scene.remove(balls[1])
    scene.remove("shelf")
    # With the triangles of a mesh
    assert "mesh-1" not in scene.to_toml() and scene.to_toml() == room().to_toml()
    after = scene.render(buffers=["color", "object-id"], **SMALL)
    assert all((after[name] == before[name]).all() for name in before)
    lamp["strength"] = 0
    assert scene.render(**SMALL)["color"][..., :3].max() == 0
    with pytest.raises(KeyError, match='did you mean "ball"'):
        del scene["bal"]
    # The first of that name, or that of a family
    scene.add_phong_material("ball")
    scene.remove("ball", family="material")
    assert scene["ball"].kind == "sphere"
    with pytest.raises(ValueError, match='did you mean "shape"'):
        scene.remove("ball", family="shap")
    # What is missing then is told
    scene.remove("red")
    with pytest.raises(fl.SceneError, match="red"):
        scene.render(**SMALL)
    scene.add_phong_material("red", diffuse=[0.8, 0.1, 0.1])
    lamp["strength"] = 20
    assert (scene.render(**SMALL)["color"] == before["color"]).all()


def test_shapes_of_a_text_may_be_called_alike():
    text = "[camera]\nposition = [0, 0, 9]\n"
    text += "".join(f'[[sphere]]\nname = "twin"\ncenter = [{x}, 0, 0]\nradius = 1\n' for x in (0, 1, 2))
    scene = fl.Scene.from_text(text)
    first = scene["twin"]
    first["radius"] = 0.5
    first["name"] = "first"
    assert (scene["first"]["radius"], scene["twin"]["center"]) == (0.5, [1, 0, 0])
    # What leads to one that was removed leads to the next
    del scene["twin"]
    second = scene["twin"]
    assert second["center"] == [2, 0, 0]
    second["radius"] = 2
    del scene["twin"]
    assert list(scene) == ["first"] and "twin" not in scene
    scene.add_sphere(center=[0, 0, 0], radius=1, name="twin")
    with pytest.raises(fl.SceneError, match="taken"):
        first["name"] = "twin"
    first.update(name=None)
    scene.add_sphere(center=[0, 0, 0], radius=1, name="first")


def test_places_of_a_text_end_with_a_removal():
    text = "[camera]\nposition = [0, 0, 5]\n"
    text += "".join(f'[[sphere]]\nname = "{name}"\ncenter = [0, 0, 0]\nradius = 1\n' for name in "abc")

    def fault(scene):
        scene["c"]["material"] = "clay"
        with pytest.raises(fl.SceneError, match="clay") as caught:
            scene.render(**SMALL)
        return caught.value.diagnostics[0]

    assert fault(fl.Scene.from_text(text)).path == "sphere[2].material"
    scene = fl.Scene.from_text(text)
    scene.remove("a")
    assert (fault(scene).path, fault(scene).place) == ("sphere[1].material", None)


def test_a_cleared_scene_has_its_settings_alone():
    scene = room()
    scene.settings.update(width=30, height=20, background=[0.5, 0.5, 0.5], camera="eye", motion_to="eye")
    handle = scene["ball"]
    scene.clear()
    assert list(scene) == [] and repr(scene) == "<firstlight.Scene 30 x 20: empty>"
    with pytest.raises(KeyError, match="was removed"):
        handle.fields
    scene.add_camera(position=[0, 0, 5])
    scene.add_sphere(center=[0, 0, 0], radius=1, name="ball")
    frame = scene.render(buffers=["color", "object-id"])
    assert frame["object-id"].max() == 1 and frame["color"].shape == (20, 30, 4)
    assert (frame["color"][0, 0, :3] == 0.5).all()
    assert repr(scene) == "<firstlight.Scene 30 x 20: 1 shape, 1 camera>"
    # Nothing of what was removed is kept
    assert len(pickle.dumps(scene)) < len(pickle.dumps(room()))


def test_a_name_is_one_things():
    scene = room()
    scene.add_sphere(center=[0, 3, 0], radius=0.1, name="other")
    taken = [
        lambda: scene.add_sphere(center=[0, 0, 0], radius=1, name="ball"),
        lambda: scene.add_mesh(FLOOR, FACES, name="ball"),
        lambda: scene.add_mesh(FLOOR, FACES, name="ball", static=True),
        lambda: scene.add_point_light(position=[0, 1, 0], name="lamp"),
        lambda: scene.add_phong_material("red"),
        lambda: scene.add_camera(position=[0, 0, 1]),
        lambda: scene["other"].update(name="ball"),
    ]
    kept = scene.to_toml()
    for add in taken:
        with pytest.raises(fl.SceneError, match="taken"):
            add()
    assert scene.to_toml() == kept
    # Not by itself, and not by another family
    scene["ball"].update(name="ball", radius=0.9)
    scene.add_phong_material("ball")
    scene["ball"]["name"] = "bowl"
    scene.add_sphere(center=[0, 0, 0], radius=1, name="ball")


def test_colours_are_bytes_or_floats():
    def albedo(colors):
        scene = room(colors=colors)
        return scene.render(buffers="albedo", **SMALL)["albedo"][-1, 12]

    half = np.full((4, 3), 188)
    expected = 0.8 * 0.5028864580325687
    assert np.allclose(albedo(half.astype(np.uint8)), expected)
    assert np.allclose(albedo(np.full((4, 4), 0.5)), 0.4) and np.allclose(albedo([[0.5, 0.5, 0.5]] * 4), 0.4)
    for kind in (np.int8, np.int64, np.uint16, np.uint32, bool):
        with pytest.raises(ValueError, match="colours are uint8, 0 to 255 in sRGB, or floats.*astype"):
            room(colors=half.astype(kind))
    with pytest.raises(ValueError, match=r"shape \(4, 3\) and int64"):
        room(colors=[[1, 0, 0]] * 4)
    with pytest.warns(fl.SceneWarning, match="colors: up to 188, where 1 reflects all light") as caught:
        room(colors=half.astype(float))
    assert len(caught) == 1 and caught[0].filename == __file__


def test_normals_are_of_any_length():
    normals = np.array([[0.2, 1, 0], [-0.2, 1, 0], [-0.2, 1, 0.1], [0, 1, 0]])
    lengths = np.array([[0.1], [3], [1], [20]])

    def picture(normals, **fields):
        return room(normals=normals, **fields).render(buffers=["color", "normal"], **SMALL)

    for fields in ({}, {"transform": {"scale": [1, 2, 1], "rotate_deg": [0, 30, 0]}}):
        unit = picture(normals / np.linalg.norm(normals, axis=1, keepdims=True), **fields)
        other = picture(normals / np.linalg.norm(normals, axis=1, keepdims=True) * lengths, **fields)
        assert np.allclose(unit["normal"], other["normal"], atol=1e-5)
        assert np.allclose(unit["color"], other["color"], atol=1e-4)


def test_cameras_say_their_matrices():
    camera = fl.Camera(position=[1, 2, 8], look_at=[0, 1, 0], fov_y_deg=40, width=48, height=36, shift=[0.1, 0])
    scene = room()
    scene.add_sphere(center=[3, 1, -20], radius=1)
    frame = scene.render(camera=camera, buffers=["position", "object-id"])
    # fy is half the height by the tangent of half the angle
    fy = 18 / np.tan(np.radians(20))
    assert np.allclose(camera.K, [[fy, 0, 24 - 4.8], [0, fy, 18], [0, 0, 1]], rtol=1e-6)
    assert (frame.K == camera.K).all()
    for convention in ("opencv", "opengl"):
        pose = camera.pose(convention)
        assert (frame.pose(convention) == pose).all() and np.allclose(pose[:3, 3], [1, 2, 8])
        again = fl.Camera.from_pose(pose, convention=convention, K=camera.K, width=48, height=36)
        assert np.allclose(again.pose(convention), pose, atol=1e-6) and np.allclose(again.K, camera.K)
    assert np.allclose(camera.pose() @ np.diag([1, -1, -1, 1]), camera.pose("opengl"))
    # Each pixel's point is seen in the middle of the pixel
    y, x = np.nonzero(frame["object-id"])
    pixels = camera.project(frame["position"][y, x])
    assert pixels.shape == (len(y), 2) and np.allclose(pixels, np.stack([x + 0.5, y + 0.5], -1), atol=1e-3)
    by_matrices = (frame["position"][y, x] - camera.pose()[:3, 3]) @ camera.pose()[:3, :3] @ camera.K.T
    assert np.allclose(by_matrices[:, :2] / by_matrices[:, 2:], pixels, atol=1e-3)
    assert camera.project([0, 1, 0]).shape == (2,) and np.isnan(camera.project([[1, 2, 9]])).all()
    # Those of a part of the film are those of its arrays
    part = scene.render(camera=camera, buffers=["position", "object-id"], crop=(5, 7, 20, 16))
    assert np.allclose(part.K, camera.K - [[0, 0, 5], [0, 0, 7], [0, 0, 0]])
    other = pickle.loads(pickle.dumps(part))
    assert (other.K == part.K).all() and (other.pose() == part.pose()).all()
    for wrong in ("openvc", "blender"):
        with pytest.raises(ValueError, match="opencv"):
            frame.pose(wrong)
    with pytest.raises(ValueError, match='did you mean "opencv"'):
        camera.pose("opencvs")
    with pytest.raises(ValueError, match="width and a height"):
        fl.Camera(position=[0, 0, 1]).K


def test_orthographic_cameras_project_and_have_no_matrix():
    camera = {"position": [0, 0, 5], "projection": "orthographic", "height": 2}
    frame = room().render(camera=camera, **SMALL)
    with pytest.raises(ValueError, match="orthographic camera has no K"):
        frame.K
    assert np.allclose(frame.pose("opengl"), [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]])


def test_help_and_words_have_the_real_fields():
    from inspect import signature

    sphere = signature(fl.Scene.add_sphere).parameters
    assert list(sphere)[:3] == ["self", "center", "radius"] and sphere["radius"].default is sphere["radius"].empty
    assert sphere["visible"].default is True and sphere["material"].default is None
    text = pydoc.render_doc(fl.Scene, renderer=pydoc.plaintext)
    for words in ("radius : float", "add_spot_light(self, *, position", "cone_deg : float, default 60", "Parameters"):
        assert words in text, words
    for words in ("casts_shadow : bool, default True", "smooth_deg : float, optional"):
        assert words in fl.Scene.add_mesh.__doc__, words
    assert "positions" not in fl.Scene.add_mesh.__doc__ and "fov_y_deg : float" in fl.Scene.add_camera.__doc__
    assert 'uv : {"equirectangular", "angles"}' in fl.Scene.add_sphere.__doc__
    scene = room()
    assert repr(scene["ball"]) == "<firstlight.Handle sphere 'ball': center=[0, 1, 0], radius=1, material='red'>"
    assert repr(scene) == "<firstlight.Scene 1024 x 1024: 2 shapes, 1 light, 1 camera, 1 material>"
    # What is not said has its default
    assert (scene["ball"]["visible"], scene["ball"]["transform"], scene["lamp"]["falloff"]) == (True, None, "physical")
    assert (scene.settings["antialiasing"], scene["red"]["shininess"], scene["floor"]["of"]) == (4, 16, "mesh-0")
    for thing, field, near in ((scene["ball"], "raduis", "radius"), (scene.settings, "widht", "width")):
        with pytest.raises(KeyError, match=f"did you mean '{near}'"):
            thing[field]
    scene.add_camera(name="side", position=[5, 0, 0])
    assert scene["side"]["fov_y_deg"] is None and scene["side"]["position"] == [5, 0, 0]
    scene.remove("side")
    camera = fl.Camera(position=[0, 0, 1], width=3, height=4)
    assert repr(camera) == "Camera(position=[0, 0, 1], width=3, height=4)"
    for known, wrong in (("floor", "flor"), ("lamp", "lapm")):
        with pytest.raises(KeyError, match=f'did you mean "{known}"'):
            scene[wrong]
    with pytest.raises(KeyError, match='did you mean "config11"'):
        fl.builtin("confg11")


def test_stubs_have_the_fields_of_every_method():
    import pathlib
    import re

    stubs = (pathlib.Path(fl.__file__).parent / "__init__.pyi").read_text()
    from inspect import signature

    def fields_of(kind):
        return set(re.findall(r"^    (\w+): ", re.search(rf"class {kind}.*?\n\n", stubs, re.S).group(), re.M))

    shared = {kind: fields_of(kind) for kind in ("_ShapeFields", "_MaterialFields")}
    for name in dir(fl.Scene):
        if re.fullmatch(r"add_\w+", name) and name not in ("add_mesh", "add_camera"):
            text = re.search(rf"def {name}\((.*?)\) -> Handle", stubs, re.S).group(1)
            said = {field for field in re.findall(r"^        (\w+):", text, re.M)}
            said |= set().union(*(fields for kind, fields in shared.items() if kind in text))
            assert said == set(signature(getattr(fl.Scene, name)).parameters) - {"self"}, name


def test_advice_is_given_once():
    def warned(call):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            call()
        return caught

    scene = room()
    assert warned(lambda: scene.render(**SMALL)) == []
    scene.remove("lamp")
    advice = [str(one) for one in scene.check()]
    (warning,) = warned(lambda: scene.render(**SMALL))
    assert [str(warning.message)] == advice and "there is no light" in advice[0]
    assert warning.category is fl.SceneWarning and warning.filename == __file__
    assert warned(lambda: scene.render(camera={"position": [0, 3, 9]}, **SMALL)) == []
    # Of buffers without light it says nothing of light
    other = room()
    other.remove("lamp")
    assert warned(lambda: other.render(buffers=["depth", "crypto-object"], **SMALL)) == []
    (warning,) = warned(lambda: other.render(camera={"position": [0, 3, 9], "look_at": [0, 3, 10]}, **SMALL))[1:]
    assert "nothing is in the picture" in str(warning.message)


def test_a_model_is_a_shape_with_parts(tmp_path):
    corners = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"
    gltf = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "data:;base64," + corners, "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "materials": [{"name": "oak"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "nodes": [{"name": "seat", "mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    (tmp_path / "chair.gltf").write_text(json.dumps(gltf))
    (tmp_path / "scene.toml").write_text("[camera]\nposition = [0.3, 0.3, 3]\nlook_at = [0.3, 0.3, 0]\n")
    scene = fl.Scene.from_file(tmp_path / "scene.toml")
    scene.add_unlit_material("red", color=[1, 0, 0])
    scene.add_model(name="chair", file="chair.gltf", materials={"oak": "red"})
    frame = scene.render(buffers=["color", "object-id"], width=9, height=9, aa=1)
    assert list(frame["color"][4, 4]) == [1, 0, 0, 1]
    assert frame.object_names == ["chair/seat"]

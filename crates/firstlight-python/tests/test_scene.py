"""Scenes that are built, changed, asked and pickled; cameras."""

import itertools
import pickle
import types

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
    with pytest.raises(KeyError, match="lamp"):
        scene.visible([[0, 0, 0]], light="lampe")


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


def test_meshes_of_others_are_known_by_what_they_have():
    scene = room()
    trimesh = types.SimpleNamespace(vertices=FLOOR, faces=FACES)
    assert scene.add(trimesh, name="t").kind == "instance"
    open3d = types.SimpleNamespace(vertices=FLOOR, triangles=FACES, vertex_normals=[], vertex_colors=FLOOR * 0 + 0.5)
    scene.add(open3d, name="o")

    class Graph(dict):
        nodes_geometry = ["node"]

    of_scene = types.SimpleNamespace(graph=Graph(node=(np.eye(4), "g")), geometry={"g": trimesh})
    assert [handle.name for handle in scene.add(of_scene)] == ["node"]
    with pytest.raises(TypeError):
        scene.add(3)
    scene.render(**SMALL)

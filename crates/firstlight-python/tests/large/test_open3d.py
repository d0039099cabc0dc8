"""Meshes of Open3D, and its ray caster (Embree) on the same rays."""

import numpy as np
import pytest

import firstlight as fl

o3d = pytest.importorskip("open3d")

WIDTH, HEIGHT = 80, 60
SHAPES = o3d.geometry.TriangleMesh
MADE = {
    "torus": lambda: SHAPES.create_torus(1.0, 0.4, 24, 16),
    "mobius": lambda: SHAPES.create_mobius(40, 9),
    "box": lambda: SHAPES.create_box(1.5, 0.7, 1.1),
    "cone": lambda: SHAPES.create_cone(0.8, 1.6, 17),
    "arrow": lambda: SHAPES.create_arrow(0.2, 0.4, 1.5, 0.6),
}


def cameras(low, high):
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    for direction in ([1, 0.7, 1.3], [-1.1, -0.4, 0.6], [0.2, 1, -0.9]):
        eye = middle + np.array(direction) / np.linalg.norm(direction) * size * 1.3
        yield fl.Camera(position=eye.tolist(), look_at=middle.tolist(), width=WIDTH, height=HEIGHT)


def caster(*meshes):
    scene = o3d.t.geometry.RaycastingScene()
    for mesh in meshes:
        scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    return scene


def pinhole_rays(scene, frame):
    """Open3D's own rays through a camera; along them it measures depth."""
    K = np.array(frame.receipt["intrinsics"].split(), float).reshape(3, 3)
    E = np.array(frame.receipt["opencv_camera_from_world"].split(), float).reshape(4, 4)
    return scene.create_rays_pinhole(o3d.core.Tensor(K), o3d.core.Tensor(E), WIDTH, HEIGHT)


def same_to_both(found, expected, size):
    """Where both meet something, and that it is as far for both but at silhouettes, where either may be right."""
    both = np.isfinite(expected) & np.isfinite(found)
    assert both.any()
    assert (np.isfinite(expected) != np.isfinite(found)).mean() < 2e-3
    near = np.zeros(both.shape, dtype=bool)
    near[both] = np.abs(found[both] - expected[both]) < 1e-4 * size
    assert near[both].mean() > 0.998, near[both].mean()
    return both, near


def same_triangles(ids, normals, hits, both, near):
    """That of the triangles the same one is met, or one at the same place that faces the same way."""
    same = ids.astype(int) - 1 == hits["primitive_ids"].numpy().astype(np.int64)
    assert (same | near)[both].mean() > 0.998
    assert same[both].mean() > 0.98
    others = hits["primitive_normals"].numpy()
    facing = np.abs((normals * others).sum(axis=-1)) / np.linalg.norm(others, axis=-1).clip(1e-30)
    assert (facing[both & same] > 1 - 1e-4).mean() > 0.998


def picture(scene):
    scene.add_directional_light(direction=[-1, -2, -1.5])
    camera = fl.Camera(position=[2, 2, 4], width=WIDTH, height=HEIGHT)
    return scene.render(camera=camera, buffers=["color", "depth", "normal", "albedo", "primitive-id"])


def same_pictures(one, other):
    assert (one["primitive-id"] > 0).any()
    for name in one:
        assert (one[name] == other[name]).all(), name


@pytest.mark.parametrize("given", ["nothing", "normals", "colors", "normals and colors"])
def test_a_mesh_is_what_its_arrays_are(given):
    mesh, more = MADE["torus"](), {}
    if "normals" in given:
        mesh.compute_vertex_normals()
        more["normals"] = np.asarray(mesh.vertex_normals)
    if "colors" in given:
        more["colors"] = np.abs(np.asarray(mesh.vertices)) / 2
        mesh.vertex_colors = o3d.utility.Vector3dVector(more["colors"])
    own, arrays = fl.Scene(), fl.Scene()
    assert own.add(mesh, name="torus").name == "torus"
    arrays.add_mesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles), name="torus", **more)
    same_pictures(picture(own), picture(arrays))


def test_a_tensor_mesh():
    mesh = MADE["torus"]()
    mesh.compute_vertex_normals()
    tensors = o3d.t.geometry.TriangleMesh.from_legacy(mesh, o3d.core.float64)
    own, arrays, whole = fl.Scene(), fl.Scene(), fl.Scene()
    own.add(mesh)
    positions, normals = tensors.vertex.positions.numpy(), tensors.vertex.normals.numpy()
    arrays.add_mesh(positions, tensors.triangle.indices.numpy(), normals=normals)
    whole.add(tensors)
    expected = picture(own)
    same_pictures(expected, picture(arrays))
    same_pictures(expected, picture(whole))


@pytest.mark.parametrize("make", MADE.values(), ids=list(MADE))
def test_renders_are_what_the_ray_caster_meets(make):
    mesh, scene = make(), fl.Scene()
    scene.add(mesh)
    other, low, high = caster(mesh), mesh.get_min_bound(), mesh.get_max_bound()
    size = float(np.linalg.norm(high - low))
    for camera in cameras(low, high):
        names = ["depth", "distance", "normal-geometric", "object-id", "primitive-id"]
        frame = scene.render(camera=camera, buffers=names)
        rays = pinhole_rays(other, frame)
        hits = other.cast_rays(rays)
        depth = hits["t_hit"].numpy()
        same_to_both(frame["depth"], depth, size)
        distance = depth * np.linalg.norm(rays.numpy()[..., 3:], axis=-1)
        both, near = same_to_both(frame["distance"], distance, size)
        same_triangles(frame["primitive-id"], frame["normal-geometric"], hits, both, near)
        assert (frame["object-id"][both] == 1).all()


@pytest.mark.parametrize("make", MADE.values(), ids=list(MADE))
def test_rays_in_all_directions_meet_the_same(make):
    mesh, scene = make(), fl.Scene()
    scene.add(mesh)
    low, high = mesh.get_min_bound(), mesh.get_max_bound()
    size, chance = float(np.linalg.norm(high - low)), np.random.default_rng(1)
    # From around the mesh to places in its box; single precision, as Open3D has it
    origins = chance.normal(size=(4000, 3))
    origins *= size / np.linalg.norm(origins, axis=1, keepdims=True)
    origins = ((low + high) / 2 + origins).astype(np.float32)
    directions = (chance.uniform(low, high, size=(4000, 3)) - origins).astype(np.float32)
    found = scene.cast(origins, directions)
    hits = caster(mesh).cast_rays(o3d.core.Tensor(np.concatenate([origins, directions], axis=1)))
    expected = hits["t_hit"].numpy() * np.linalg.norm(directions, axis=1)
    both, near = same_to_both(found.distance, expected, size)
    same_triangles(found.primitive_id, found.normal_geometric, hits, both, near)
    assert (found.hit == np.isfinite(found.distance)).all()
    # Both weigh the second and the third corner
    same = both & (found.primitive_id.astype(int) - 1 == hits["primitive_ids"].numpy().astype(np.int64))
    assert np.abs(found.barycentric - hits["primitive_uvs"].numpy())[same].max() < 1e-3


def test_ids_tell_meshes_apart():
    meshes, scene = [make() for make in MADE.values()], fl.Scene()
    for k, mesh in enumerate(meshes):
        mesh.translate([1.6 * (k % 3), 0.4 * k, 1.2 * (k // 3)])
        scene.add(mesh)
    other = caster(*meshes)
    low = np.min([mesh.get_min_bound() for mesh in meshes], axis=0)
    high = np.max([mesh.get_max_bound() for mesh in meshes], axis=0)
    seen = set()
    for camera in cameras(low, high):
        frame = scene.render(camera=camera, buffers=["depth", "object-id"])
        hits = other.cast_rays(pinhole_rays(other, frame))
        both, near = same_to_both(frame["depth"], hits["t_hit"].numpy(), float(np.linalg.norm(high - low)))
        ids = hits["geometry_ids"].numpy().astype(np.int64) + 1
        assert (frame["object-id"] == ids)[both & near].mean() > 0.998
        seen |= set(ids[both].tolist())
    assert seen == {1, 2, 3, 4, 5}

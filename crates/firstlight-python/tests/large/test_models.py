"""Depth, normals and ids of models against the ray caster of trimesh (Embree), on the same rays.

Every .ply, .obj and .stl file below a folder is a case: `FIRSTLIGHT_MODELS`, or the project's own test scenes.
"""

import os
import pathlib

import numpy as np
import pytest

import firstlight as fl

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("embreex")

OWN = pathlib.Path(__file__).parents[3] / "firstlight-testkit/tests/truth/cases"
MODELS = pathlib.Path(os.environ.get("FIRSTLIGHT_MODELS", OWN))
FILES = sorted(p for p in MODELS.rglob("*") if p.suffix in (".ply", ".obj", ".stl"))
WIDTH, HEIGHT = 80, 60


def test_there_are_models():
    assert FILES, MODELS


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_model_is_what_another_ray_caster_meets(file):
    try:
        mesh = trimesh.load(file, force="mesh", process=False, skip_materials=True)
    except ValueError as fault:
        pytest.skip(f"trimesh does not read it: {fault}")
    if len(mesh.faces) == 0:
        pytest.skip("no triangles")
    low, high = mesh.bounds
    middle, size = (low + high) / 2, max(float(np.linalg.norm(high - low)), 1e-6)
    scene = fl.Scene()
    scene.add_mesh(mesh.vertices, mesh.faces)
    compared = 0
    for direction in ([1, 0.7, 1.3], [-1.1, -0.4, 0.6], [0.2, 1, -0.9]):
        eye = middle + np.array(direction) / np.linalg.norm(direction) * size * 1.3
        camera = fl.Camera(position=eye.tolist(), look_at=middle.tolist(), width=WIDTH, height=HEIGHT)
        names = ["depth", "distance", "normal-geometric", "object-id", "primitive-id"]
        frame = scene.render(camera=camera, buffers=names)
        K = np.array(frame.receipt["intrinsics"].split(), float).reshape(3, 3)
        E = np.array(frame.receipt["opencv_camera_from_world"].split(), float).reshape(4, 4)
        row, column = (index.ravel() for index in np.indices((HEIGHT, WIDTH)))
        pixels = np.stack([column + 0.5, row + 0.5, np.ones(row.size)])
        along = np.linalg.inv(K) @ pixels
        rays = (E[:3, :3].T @ (along / np.linalg.norm(along, axis=0))).T
        places, which, faces = mesh.ray.intersects_location(np.tile(eye, (len(rays), 1)), rays, multiple_hits=False)
        expected = np.full(len(rays), np.inf)
        expected[which] = np.linalg.norm(places - eye, axis=1)
        found = frame["distance"].ravel()
        # At silhouettes and between triangles either may be right
        both = np.isfinite(expected) & np.isfinite(found)
        assert (np.isfinite(expected) != np.isfinite(found)).mean() < 2e-3
        near = np.abs(found[both] - expected[both]) < 1e-4 * size
        assert near.mean() > 0.998, near.mean()
        # Depth is the distance along the line of sight
        depth = frame["depth"].ravel()[both]
        assert np.allclose(depth, found[both] / np.linalg.norm(along, axis=0)[both], rtol=1e-5)
        # Of the triangles that both meet, the same or one that lies at the same place
        own = np.zeros(len(rays), dtype=int) - 1
        own[which] = faces
        ids = frame["primitive-id"].ravel()[both].astype(int) - 1
        same = ids == own[both]
        normals = mesh.face_normals[np.clip(ids, 0, None)]
        facing = np.abs((normals * frame["normal-geometric"].reshape(-1, 3)[both]).sum(axis=1))
        assert (facing > 1 - 1e-4).mean() > 0.998
        assert (same | near).mean() > 0.998
        assert (frame["object-id"].ravel()[both] == 1).all()
        compared += int(both.sum())
    assert compared > 0

"""Meshes of trimesh and of Open3D themselves: colours, textures, normals, as files and their own makers give them."""

import io
import warnings

import numpy as np
import pytest

import firstlight as fl

trimesh = pytest.importorskip("trimesh")
Image = pytest.importorskip("PIL.Image")

SMALL = {"width": 40, "height": 30, "aa": 1}
# From above: x to the right, -z up
ABOVE = {"position": [0, 5, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "projection": "orthographic", "height": 2}
# Upper row red and green, lower row blue and white
PIXELS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], dtype=np.uint8)
OBJ = """mtllib m.mtl
usemtl a
v -1 0 1
v 1 0 1
v 1 0 -1
v -1 0 -1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3
f 1/1 3/3 4/4
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same square with a texture as OBJ and as binary glTF."""
    folder = tmp_path_factory.mktemp("models")
    Image.fromarray(PIXELS).save(folder / "t.png")
    (folder / "m.mtl").write_text("newmtl a\nKd 1 1 1\nmap_Kd t.png\n")
    (folder / "m.obj").write_text(OBJ)
    glb = trimesh.load(folder / "m.obj", force="mesh").export(file_type="glb")
    (folder / "m.glb").write_bytes(glb)
    return folder


def seen(thing, buffer="albedo", **fields):
    scene = fl.Scene()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fl.SceneWarning)
        scene.add(thing, **fields)
    return scene.render(camera=ABOVE, buffers=[buffer], **SMALL)[buffer]


def shows_pixels(albedo):
    """At the middles of texels."""
    texels = [albedo[y, x] for y in (7, 22) for x in (12, 27)]
    return np.allclose(texels, PIXELS.reshape(4, 3) / 255, atol=1e-4)


@pytest.mark.parametrize("name", ["m.obj", "m.glb"])
@pytest.mark.parametrize("how", [{}, {"process": False}, {"force": "mesh"}], ids=str)
def test_textures_of_trimesh(files, name, how):
    assert shows_pixels(seen(trimesh.load(files / name, **how)))


@pytest.mark.parametrize("name", ["m.obj", "m.glb"])
def test_textures_of_open3d(files, name):
    o3d = pytest.importorskip("open3d")
    assert shows_pixels(seen(o3d.io.read_triangle_mesh(str(files / name), True)))
    assert shows_pixels(seen(o3d.t.io.read_triangle_mesh(str(files / name))))


@pytest.mark.parametrize("make", ["box", "icosphere", "cylinder", "torus", "capsule"])
@pytest.mark.parametrize("welded", [True, False])
def test_who_looks_at_normals_changes_no_picture(make, welded):
    sizes = {"cylinder": (0.5, 1), "torus": (0.7, 0.2)}.get(make, ())

    def made():
        mesh = getattr(trimesh.creation, make)(*sizes)
        if not welded:
            mesh.unmerge_vertices()
        return mesh

    before, looked = seen(made(), "normal"), made()
    assert len(looked.vertex_normals) > 0
    assert (seen(looked, "normal") == before).all()
    looked.apply_scale([1, 2, 3])
    assert (seen(looked, "normal") == seen(made().apply_scale([1, 2, 3]), "normal")).all()
    # Its own vertices make a face flat, and so do the edges of a box
    bends = np.abs(before - seen(made(), "normal-geometric")).max()
    assert (bends > 0.01) == (welded and make != "box")


def test_colours_of_trimesh():
    mesh = trimesh.creation.box()
    mesh.visual.face_colors = np.full((12, 4), [188, 0, 255, 255], dtype=np.uint8)
    assert np.allclose(seen(mesh)[15, 20], [0.8 * 0.50288646, 0, 0.8])
    mesh = trimesh.creation.box()
    mesh.visual.vertex_colors = [188, 0, 255, 255]
    assert np.allclose(seen(mesh)[15, 20], [0.8 * 0.50288646, 0, 0.8])
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[0.2, 0.4, 1.0, 1.0])
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.zeros((8, 2)), material=material)
    assert np.allclose(seen(mesh)[15, 20], [0.2, 0.4, 1])


def test_what_is_lost_of_a_scene_is_told():
    whole = trimesh.Scene([trimesh.creation.box(), trimesh.creation.icosphere()])
    whole.add_geometry(trimesh.PointCloud(np.zeros((5, 3))), node_name="points")
    scene = fl.Scene()
    with pytest.warns(fl.SceneWarning) as caught:
        assert len(scene.add(whole, name="room")) == 2
    # Only what is there: trimesh makes a camera and lights where they are asked for
    assert [str(one.message) for one in caught] == ["'room/points' is not taken: it is a PointCloud, and no mesh"]
    whole.delete_geometry([name for name in whole.geometry if name.endswith("2")])
    assert whole.camera is not None
    with pytest.warns(fl.SceneWarning, match="its camera"):
        fl.Scene().add(whole)


def materials():
    """Materials of trimesh with all that they can have, or some of it."""
    chance = np.random.default_rng(1)

    def image(channels):
        return Image.fromarray(chance.integers(0, 256, size=(8, 8, channels), dtype=np.uint8))

    bent = np.full((8, 8, 3), (128, 128, 255), dtype=np.uint8)
    bent[:4, :, 0] = 180
    whole = {
        "baseColorTexture": image(4),
        "baseColorFactor": [200, 100, 255, 255],
        "metallicFactor": 0.7,
        "roughnessFactor": 0.8,
        "metallicRoughnessTexture": image(3),
        "normalTexture": Image.fromarray(bent),
        "occlusionTexture": image(3),
        "emissiveFactor": [0.2, 0.1, 0.0],
        "emissiveTexture": image(3),
        "doubleSided": False,
    }
    for other in (
        {},
        {"alphaMode": "MASK", "alphaCutoff": 0.4},
        {"alphaMode": "BLEND"},
        {"baseColorTexture": None, "metallicFactor": None},
        {"emissiveFactor": None, "doubleSided": True},
    ):
        yield trimesh.visual.material.PBRMaterial(**{"name": "m", **whole, **other})


@pytest.mark.parametrize("material", list(materials()), ids=["whole", "mask", "blend", "metal", "dark"])
def test_materials_are_those_of_the_file_that_trimesh_writes(material):
    # Each face by itself, so that normals are those of the faces in both
    box = trimesh.creation.box()
    vertices, faces = box.vertices[box.faces.ravel()], np.arange(36).reshape(-1, 3)
    uv = np.random.default_rng(2).random((36, 2))
    visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    mesh, scene = trimesh.Trimesh(vertices, faces, process=False, visual=visual), trimesh.Scene()
    scene.add_geometry(mesh, node_name="a")
    turned = trimesh.transformations.rotation_matrix(0.5, [1, 2, 3])
    turned[0, 3] = 1.5
    scene.add_geometry(mesh, node_name="b", transform=turned)
    file = fl.Scene.from_model(bytes(scene.export(file_type="glb")), width=64)
    own = fl.Scene.from_model(scene, width=64)
    with warnings.catch_warnings():
        # That what emits light lights nothing
        warnings.simplefilter("ignore", fl.SceneWarning)
        for buffer in ("albedo", "metallic", "roughness", "emission", "normal", "opacity"):
            one, other = (each.render(buffers=buffer)[buffer] for each in (file, own))
            # But at edges: the file has its numbers in 32 bits
            assert (np.abs(one - other) > 1e-3).mean() < 0.002, buffer
        pictures = [each.render().rgb8().astype(int) for each in (file, own)]
    assert (np.abs(pictures[0] - pictures[1]) > 2).mean() < 0.002

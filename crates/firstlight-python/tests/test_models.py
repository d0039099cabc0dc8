"""Meshes of trimesh and Open3D, by light stand-ins with the fields of the real ones (`large` has those themselves)."""

import types
import warnings

import numpy as np
import pytest

import firstlight as fl

SMALL = {"width": 40, "height": 30, "aa": 1}
# From above: x to the right, -z up
ABOVE = {"position": [0, 5, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "projection": "orthographic", "height": 2}
SQUARE = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], dtype=np.float64)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)
# Upper row red and green, lower row blue and white
PIXELS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], dtype=np.uint8)
# 188 in sRGB
HALF = 0.5028864580325687


class Image:
    """As Pillow has them."""

    def __init__(self, pixels):
        self.pixels = pixels

    def convert(self, mode):
        assert mode == "RGBA"
        alpha = np.full((*self.pixels.shape[:2], 1), 255, dtype=np.uint8)
        return self.pixels if self.pixels.shape[2] == 4 else np.concatenate([self.pixels, alpha], axis=2)


def pbr(**fields):
    names = ["baseColorTexture", "baseColorFactor", "metallicFactor", "roughnessFactor", "normalTexture"]
    return types.SimpleNamespace(**{**dict.fromkeys(names), **fields})


def trimesh(vertices=SQUARE, faces=HALVES, normals=None, **visual):
    cache = {} if normals is None else {"vertex_normals": normals}
    visual = types.SimpleNamespace(kind=None, **visual) if "kind" not in visual else types.SimpleNamespace(**visual)
    return types.SimpleNamespace(vertices=vertices, faces=faces, visual=visual, _cache=cache)


def open3d(**fields):
    return types.SimpleNamespace(**{"vertices": SQUARE, "triangles": HALVES, "vertex_normals": [], **fields})


def seen(mesh, buffer="albedo", **fields):
    """What a buffer has of a mesh, without a warning."""
    scene = fl.Scene()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.add(mesh, **fields)
        return scene.render(camera=ABOVE, buffers=[buffer], **SMALL)[buffer]


def told(mesh, name="thing", **fields):
    """The one warning of a mesh."""
    scene = fl.Scene()
    with pytest.warns(fl.SceneWarning) as caught:
        scene.add(mesh, name=name, **fields)
    assert len(caught) == 1 and caught[0].filename == __file__
    # What could be taken is there
    assert scene.render(camera=ABOVE, buffers=["object-id"], **SMALL)["object-id"].max() == 1
    return str(caught[0].message)


def shows(albedo, factor=1.0):
    """Whether the square has the texels of `PIXELS`, where the middles of those are."""
    texels = [albedo[y, x] for y in (7, 22) for x in (12, 27)]
    return np.allclose(texels, factor * PIXELS.reshape(4, 3) / 255, atol=1e-5)


def test_colours_of_faces_are_taken():
    colors = np.array([[255, 0, 0, 255], [188, 188, 188, 255]], dtype=np.uint8)
    albedo = seen(trimesh(kind="face", face_colors=colors))
    # The first triangle is below the diagonal; 0.8 is what things without a material reflect
    assert np.allclose(albedo[27, 32], [0.8, 0, 0]) and np.allclose(albedo[2, 7], 0.8 * HALF)
    lost = told(trimesh(kind="face", face_colors=np.full((2, 4), 128, dtype=np.uint8)))
    assert lost == "the mesh 'thing': not taken: alpha of its colours"


def test_colours_of_vertices_are_taken():
    colors = np.full((4, 4), [188, 0, 255, 255], dtype=np.uint8)
    assert np.allclose(seen(trimesh(kind="vertex", vertex_colors=colors))[15, 20], [0.8 * HALF, 0, 0.8])
    floats = np.full((4, 3), [0.5, 0.25, 1])
    assert np.allclose(seen(open3d(vertex_colors=floats))[15, 20], [0.4, 0.2, 0.8])


@pytest.mark.parametrize("image", [Image(PIXELS), PIXELS], ids=["Pillow", "array"])
@pytest.mark.parametrize("is_pbr", [True, False])
def test_textures_are_the_right_way_up(image, is_pbr):
    material = pbr(baseColorTexture=image) if is_pbr else types.SimpleNamespace(image=image, diffuse=None)
    assert shows(seen(trimesh(kind="texture", uv=UV, material=material)))


def test_textures_of_open3d_are_upside_down():
    mesh = open3d(triangle_uvs=UV[HALVES.ravel()], textures=[PIXELS[::-1]], triangle_material_ids=[0, 0])
    assert shows(seen(mesh))


class Tensor:
    def __init__(self, array):
        self.array = array

    def cpu(self):
        return self

    def numpy(self):
        return self.array

    def as_tensor(self):
        return self


def tensors(vertex=(), triangle=(), **material):
    tables = {"texture_maps": {}, "vector_properties": {}, "scalar_properties": {}, **material}
    return types.SimpleNamespace(
        vertex={"positions": Tensor(SQUARE), **{key: Tensor(array) for key, array in dict(vertex).items()}},
        triangle={"indices": Tensor(HALVES), **{key: Tensor(array) for key, array in dict(triangle).items()}},
        material=types.SimpleNamespace(is_valid=lambda: bool(material), **tables),
    )


def test_tensors_of_open3d_are_taken():
    mesh = tensors(
        triangle={"texture_uvs": UV[HALVES]},
        texture_maps={"albedo": Tensor(PIXELS)},
        vector_properties={"base_color": [0.5, 0.5, 0.5, 1]},
    )
    assert shows(seen(mesh), factor=0.5)
    colors = np.full((4, 3), 188, dtype=np.uint8)
    assert np.allclose(seen(tensors(vertex={"colors": colors}))[15, 20], 0.8 * HALF)
    by_face = np.array([[255, 0, 0], [0, 0, 255]], dtype=np.uint8)
    albedo = seen(tensors(triangle={"colors": by_face}))
    assert np.allclose(albedo[27, 32], [0.8, 0, 0]) and np.allclose(albedo[2, 7], [0, 0, 0.8])
    lost = told(tensors(texture_maps={"normal": Tensor(PIXELS)}, scalar_properties={"roughness": 0.4}))
    assert lost.endswith("not taken: normal texture, roughness factor")


def test_base_colours_are_taken():
    # glTF's are linear, and bytes of others are sRGB
    factor = np.array([51, 102, 255, 255], dtype=np.uint8)
    assert np.allclose(seen(trimesh(kind="texture", material=pbr(baseColorFactor=factor)))[15, 20], [0.2, 0.4, 1])
    simple = types.SimpleNamespace(image=None, diffuse=np.array([188, 0, 255, 255], dtype=np.uint8))
    assert np.allclose(seen(trimesh(kind="texture", material=simple))[15, 20], [HALF, 0, 1])
    half = pbr(baseColorFactor=np.array([51, 51, 51, 255], dtype=np.uint8), baseColorTexture=Image(PIXELS))
    assert shows(seen(trimesh(kind="texture", uv=UV, material=half)), factor=0.2)
    # A material that is given goes before, and one that says nothing is none
    scene = fl.Scene()
    scene.add_phong_material("gray", diffuse=0.25)
    scene.add(trimesh(kind="texture", material=simple), material="gray")
    assert np.allclose(scene.render(camera=ABOVE, buffers="albedo", **SMALL)["albedo"][15, 20], 0.25)
    default = np.full((2, 2, 3), 102, dtype=np.uint8)
    nothing = types.SimpleNamespace(image=Image(default), diffuse=np.array([102, 102, 102, 255], dtype=np.uint8))
    assert np.allclose(seen(trimesh(kind="texture", uv=UV, material=nothing))[15, 20], 0.8)


def test_what_is_not_taken_is_one_warning_with_the_name():
    material = pbr(
        baseColorTexture=Image(np.dstack([PIXELS, np.full((2, 2), 9, dtype=np.uint8)])),
        metallicFactor=1.0,
        roughnessFactor=0.5,
        normalTexture=Image(PIXELS),
    )
    assert told(trimesh(kind="texture", uv=UV, material=material), name="chair") == (
        "the mesh 'chair': not taken: alpha of its texture, metallic factor, roughness factor, normal texture"
    )
    assert "no texture coordinate" in told(trimesh(kind="texture", uv=None, material=pbr(baseColorTexture=PIXELS)))
    several = types.SimpleNamespace(materials=[pbr(), pbr()])
    assert "2 materials of one mesh" in told(trimesh(kind="texture", uv=UV, material=several))
    shiny = types.SimpleNamespace(image=None, diffuse=None, specular=np.array([255, 255, 255, 255], dtype=np.uint8))
    assert told(trimesh(kind="texture", material=shiny), name=None).startswith("a mesh without a name: not taken: spec")
    floats = open3d(triangle_uvs=UV[HALVES.ravel()], textures=[PIXELS / 255])
    assert "no picture of bytes" in told(floats)
    # What asks for nothing is not lost
    seen(trimesh(kind="texture", material=pbr(metallicFactor=0.0, roughnessFactor=1.0)))


def ball(welded):
    """A ball of few faces."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 17), np.linspace(0, np.pi, 9))
    vertices = np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], -1).reshape(-1, 3).round(12)
    i = np.arange(16 * 8) // 16 * 17 + np.arange(16 * 8) % 16
    faces = np.concatenate([np.stack([i, i + 1, i + 17], -1), np.stack([i + 1, i + 18, i + 17], -1)])
    vertices, first = np.unique(vertices, axis=0, return_inverse=True)
    faces = first.reshape(-1)[faces]
    faces = faces[[len(set(face)) == 3 for face in faces.tolist()]]
    if welded:
        return vertices, faces
    return vertices[faces.ravel()], np.arange(faces.size).reshape(-1, 3)


def computed(vertices, faces):
    """Normals as trimesh computes them: the mean of those of the faces."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    of_faces = np.cross(b - a, c - a)
    of_faces /= np.linalg.norm(of_faces, axis=1, keepdims=True)
    normals = np.zeros_like(vertices)
    np.add.at(normals, faces, of_faces[:, None])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def bends(normal, geometric):
    """How far the shading normal is from the facet's, at most."""
    return float(np.abs(normal - geometric).max())


@pytest.mark.parametrize("welded", [True, False])
def test_who_looks_at_normals_changes_no_picture(welded):
    vertices, faces = ball(welded)
    before = seen(trimesh(vertices, faces), "normal")
    after = seen(trimesh(vertices, faces, computed(vertices, faces)), "normal")
    assert (before == after).all()
    geometric = seen(trimesh(vertices, faces), "normal-geometric")
    # With vertices of their own faces are flat
    assert (bends(before, geometric) > 0.1) == welded
    # Also after the mesh was scaled along one axis, with the normals that were looked at
    scaled = computed(vertices, faces) / [1, 3, 1]
    scaled /= np.linalg.norm(scaled, axis=1, keepdims=True)
    vertices = vertices * [1, 3, 1]
    assert (seen(trimesh(vertices, faces), "normal") == seen(trimesh(vertices, faces, scaled), "normal")).all()


def test_smooth_edges_are_those_of_small_angles():
    vertices, faces = ball(welded=True)
    arrays = fl.Scene()
    arrays.add_mesh(vertices, faces, smooth_deg=30)
    expected = arrays.render(camera=ABOVE, buffers="normal", **SMALL)["normal"]
    assert (seen(trimesh(vertices, faces), "normal") == expected).all()
    # Those of a roof do not, and the call decides
    roof = np.array([[-1, 0, 1], [-1, 0, -1], [0, 0.8, 1], [0, 0.8, -1], [1, 0, 1], [1, 0, -1]])
    faces = np.array([[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]])
    geometric = seen(trimesh(roof, faces), "normal-geometric")
    assert bends(seen(trimesh(roof, faces, computed(roof, faces)), "normal"), geometric) < 1e-6
    assert bends(seen(trimesh(roof, faces), "normal", smooth_deg=180), geometric) > 0.1
    assert bends(seen(trimesh(roof, faces), "normal", normals=computed(roof, faces)), geometric) > 0.1
    # Smooth normals that were given to vertices of one face each
    vertices, faces = ball(welded=False)
    smooth = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    geometric = seen(trimesh(vertices, faces), "normal-geometric")
    assert bends(seen(trimesh(vertices, faces, smooth), "normal"), geometric) > 0.1


def test_open3d_has_its_normals_or_is_flat():
    vertices, faces = ball(welded=True)
    flat = open3d(vertices=vertices, triangles=faces)
    smooth = open3d(vertices=vertices, triangles=faces, vertex_normals=computed(vertices, faces))
    geometric = seen(flat, "normal-geometric")
    assert bends(seen(flat, "normal"), geometric) < 1e-6 and bends(seen(smooth, "normal"), geometric) > 0.1


def graph(nodes, geometry, **fields):
    class Graph(dict):
        nodes_geometry = list(nodes)

    return types.SimpleNamespace(graph=Graph(nodes), geometry=geometry, **fields)


def test_scenes_of_trimesh_are_taken_whole_or_not_at_all():
    image = types.SimpleNamespace(image=PIXELS, diffuse=None)
    meshes = {"square": trimesh(kind="texture", uv=UV, material=image), "dots": types.SimpleNamespace(vertices=SQUARE)}
    up = np.eye(4)
    up[1, 3] = 1
    nodes = {"left": (np.eye(4), "square"), "dots": (np.eye(4), "dots"), "right": (up, "square")}
    scene = fl.Scene()
    with pytest.warns(fl.SceneWarning) as caught:
        room = graph(nodes, meshes, has_camera=True, _lights=[1])
        handles = scene.add(room, name="room", transform=np.diag([2, 2, 2, 1]) @ up)
    assert [handle.name for handle in handles] == ["room/left", "room/right"]
    assert handles[1].transform[1].tolist() == [0, 2, 0, 4]
    first, second = (str(warning.message) for warning in caught)
    assert first == "'room/dots' is not taken: it is a SimpleNamespace, and no mesh"
    assert second.startswith("the scene 'room': not taken: its camera, its lights;")
    kept = scene.to_toml()
    # The second node's name is taken: nothing of the first one stays
    other = graph({"new": (np.eye(4), "square"), "room/right": (up, "square")}, meshes)
    with pytest.raises(fl.SceneError, match="taken"):
        scene.add(other)
    assert scene.to_toml() == kept
    with pytest.raises(fl.SceneError, match="there is no vertex 9"):
        scene.add(trimesh(faces=np.array([[0, 1, 9]]), kind="texture", uv=UV, material=image))
    assert scene.to_toml() == kept


def test_pictures_in_memory_are_part_of_a_scene():
    import pickle

    mesh = trimesh(kind="texture", uv=UV, material=types.SimpleNamespace(image=PIXELS, diffuse=None))
    scene = fl.Scene()
    handle = scene.add(mesh, name="square")
    assert scene["square"].name == handle.name and scene._find("square", "texture")
    restored = pickle.loads(pickle.dumps(scene))
    assert restored.hash == scene.hash
    assert shows(restored.render(camera=ABOVE, buffers="albedo", **SMALL)["albedo"])
    # It goes with what shows it
    size = len(pickle.dumps(scene))
    for family in ("shape", "material", "texture"):
        scene.remove("square", family=family)
    assert "memory:" not in scene.to_toml() and len(pickle.dumps(scene)) < size / 2
    # Pictures as large as they are
    from firstlight._models import png

    noise = np.random.default_rng(1).integers(0, 256, size=(5, 7, 3), dtype=np.uint8)
    text = '[camera]\nposition = [0, 0, 5]\n[texture.image.t]\nfile = "t.png"\nfilter = "bilinear"\n'
    text += '[material.phong.m]\ndiffuse = { texture = "t" }\n[[rectangle]]\ncenter = [0, 0, 0]\nsize = [7, 5]\n'
    text += 'normal = [0, 0, 1]\nmaterial = "m"\n[render]\nwidth = 7\nheight = 5\nantialiasing = 1\n'
    text = text.replace("0, 0, 5]\n", '0, 0, 5]\nprojection = "orthographic"\nheight = 5\n')
    scene = fl.Scene.from_text(text, assets={"t.png": png(noise)})
    c = noise / 255
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    assert np.allclose(scene.render(buffers="albedo")["albedo"], linear, atol=1e-5)

"""Meshes of trimesh and Open3D, by light stand-ins with the fields of the real ones (`large` has those themselves)."""

import io
import json
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
    coat = {"clear_coat": 0.5, "clear_coat_roughness": 0.25, "metallic": 0.5, "roughness": 0.75}
    kind, fields, _ = fields_of(tensors(scalar_properties=coat, material_name="defaultUnlit"))
    assert kind == "metallic-roughness" and (fields["clearcoat"], fields["clearcoat_roughness"]) == (0.5, 0.25)
    assert (fields["metallic"], fields["roughness"]) == (0.5, 0.75)
    lost = told(tensors(texture_maps={"normal": Tensor(PIXELS)}, scalar_properties={"anisotropy": 0.4}))
    assert lost.endswith("not taken: normal texture: there is no texture coordinate for each vertex, anisotropy")


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
    floats = pbr(normalTexture=PIXELS / 255, occlusionTexture=PIXELS[..., 0] / 255)
    assert told(trimesh(kind="texture", uv=UV, material=floats), name="chair") == (
        "the mesh 'chair': not taken: normal texture: it is no picture of bytes, occlusion texture: it is no picture "
        "of bytes"
    )
    assert "no texture coordinate" in told(trimesh(kind="texture", uv=None, material=pbr(baseColorTexture=PIXELS)))
    several = types.SimpleNamespace(materials=[pbr(), pbr()])
    assert "2 materials of one mesh" in told(trimesh(kind="texture", uv=UV, material=several))
    floats = open3d(triangle_uvs=UV[HALVES.ravel()], textures=[PIXELS / 255])
    assert "no picture of bytes" in told(floats)
    # Alpha of a material that is opaque says nothing
    clear = np.dstack([PIXELS, np.full((2, 2), 9, dtype=np.uint8)])
    assert shows(seen(trimesh(kind="texture", uv=UV, material=pbr(baseColorTexture=Image(clear)))))


def fields_of(mesh, **fields):
    """The material that a mesh brings, without a warning."""
    scene = fl.Scene()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        handle = scene.add(mesh, name="thing", **fields)
    # It can be rendered
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "material.*emits light|camera: no camera ray", fl.SceneWarning)
        scene.render(camera=ABOVE, buffers=["albedo"], **SMALL)
    material = fl._scene.Handle(scene, *scene._find(handle["material"], "material"))
    return material.kind, material.fields, scene


def close(value, expected):
    return np.allclose(value, expected, atol=1e-6)


def test_materials_of_gltf_are_taken():
    data = np.zeros((2, 2, 3), dtype=np.uint8)
    data[..., 1], data[..., 2] = 51, 204
    material = pbr(
        baseColorTexture=Image(np.dstack([PIXELS, np.full((2, 2), 128, dtype=np.uint8)])),
        baseColorFactor=np.array([255, 255, 255, 51], dtype=np.uint8),
        metallicFactor=0.5,
        roughnessFactor=0.5,
        metallicRoughnessTexture=Image(data),
        normalTexture=PIXELS,
        occlusionTexture=PIXELS[..., 0],
        emissiveTexture=PIXELS,
        emissiveFactor=[0.5, 0.25, 0.0],
        alphaMode="MASK",
        alphaCutoff=0.25,
        doubleSided=True,
    )
    mesh = trimesh(kind="texture", uv=UV, material=material)
    kind, fields, scene = fields_of(mesh)
    assert kind == "metallic-roughness"
    both = fields["metallic"]["texture"]
    assert fields["metallic"] == {"texture": both, "channel": "b", "factor": 0.5}
    # Green is what a number takes of a texture unless it says otherwise
    assert fields["roughness"]["texture"] == both and fields["roughness"].get("channel", "g") == "g"
    assert fields["alpha"] == {"texture": "thing", "channel": "a", "factor": 0.2}
    assert (fields["alpha_mode"], fields["cutoff"]) == ("mask", 0.25) and "single_sided" not in fields
    assert fields["normal_map"] == "thing normal" and fields["occlusion"]["texture"] == "thing occlusion"
    assert fields["emissive"]["texture"] == "thing emission" and fields["emissive"]["factor"][:2] == [0.5, 0.25]
    material.alphaMode = None
    frame = fields_of(mesh)[2].render(camera=ABOVE, buffers=["metallic", "roughness", "albedo"], **SMALL)
    assert close(frame["metallic"][15, 20], 0.4) and close(frame["roughness"][15, 20], 0.1)
    # What a file of glTF does not say
    kind, fields, scene = fields_of(trimesh(kind="texture", material=pbr(doubleSided=False)))
    frame = scene.render(camera=ABOVE, buffers=["metallic", "roughness"], **SMALL)
    assert close(frame["metallic"][15, 20], 1) and close(frame["roughness"][15, 20], 1)
    assert fields["single_sided"] is True
    bright = pbr(emissiveFactor=[4.0, 1.0, 0.0])
    kind, fields, scene = fields_of(trimesh(kind="texture", material=bright))
    assert fields["emissive_strength"] == 4
    color = scene.render(camera=ABOVE, buffers=["emission"], **SMALL)["emission"][15, 20]
    assert close(color[:3], [4, 1, 0])


def test_materials_of_obj_files_are_taken():
    byte = lambda *c: np.array(c, dtype=np.uint8)  # noqa: E731
    shiny = types.SimpleNamespace(
        image=None, diffuse=byte(188, 0, 0, 255), specular=byte(255, 255, 255, 255), glossiness=50.0
    )
    kind, fields, _ = fields_of(trimesh(kind="texture", material=shiny))
    assert kind == "phong" and close(fields["diffuse"], [HALF, 0, 0])
    assert close(fields["specular"], [1, 1, 1]) and fields["shininess"] == 50
    clear = types.SimpleNamespace(image=None, diffuse=byte(188, 0, 0, 51))
    kind, fields, _ = fields_of(trimesh(kind="texture", material=clear))
    assert (fields["alpha"], fields["alpha_mode"]) == (0.2, "blend")
    leaf = types.SimpleNamespace(image=Image(np.dstack([PIXELS, np.full((2, 2), 51, dtype=np.uint8)])), diffuse=None)
    kind, fields, scene = fields_of(trimesh(kind="texture", uv=UV, material=leaf))
    assert fields["alpha"]["texture"] == fields["diffuse"]["texture"] and fields["alpha"]["channel"] == "a"
    opacity = scene.render(camera=ABOVE, buffers=["opacity"], **SMALL)["opacity"]
    assert close(opacity[15, 20], 0.2)


def record(**fields):
    """A `MaterialRecord` as it is made."""
    images = ("albedo", "normal", "ao", "metallic", "roughness", "reflectance", "clearcoat", "clearcoat_roughness")
    images += ("anisotropy", "ao_rough_metal")
    own = {
        **{f"{name}_img": None for name in images},
        "shader": "defaultUnlit",
        "base_color": [1.0, 1.0, 1.0, 1.0],
        "base_metallic": 0.0,
        "base_roughness": 1.0,
        "base_reflectance": 0.5,
        "base_clearcoat": 0.0,
        "base_clearcoat_roughness": 0.0,
        "base_anisotropy": 0.0,
        "emissive_color": [0.0, 0.0, 0.0, 0.0],
        "has_alpha": False,
    }
    return types.SimpleNamespace(**{**own, **fields})


def test_models_of_open3d_are_taken():
    mesh = open3d(triangle_uvs=UV[HALVES.ravel()], textures=[])
    data = np.zeros((2, 2, 3), dtype=np.uint8)
    data[..., 1], data[..., 2] = 51, 204
    lit = record(
        shader="defaultLit",
        albedo_img=PIXELS,
        base_color=[0.5, 0.5, 0.5, 1.0],
        ao_rough_metal_img=data,
        base_metallic=0.5,
        normal_img=PIXELS,
        ao_img=PIXELS[..., 0],
        base_reflectance=0.25,
        base_clearcoat=0.5,
    )
    model = types.SimpleNamespace(
        meshes=[types.SimpleNamespace(mesh=mesh, mesh_name=name, material_idx=0) for name in ("seat", "seat")],
        materials=[lit],
    )
    scene = fl.Scene()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        handles = scene.add(model, name="chair")
        frame = scene.render(camera=ABOVE, buffers=["albedo", "metallic", "roughness"], **SMALL)
    assert [handle.name for handle in handles] == ["chair/seat", "chair/seat-2"]
    # One material for both
    assert dict(scene._counts())["material"] == 1
    assert shows(frame["albedo"], factor=0.5)
    assert close(frame["metallic"][15, 20], 0.4) and close(frame["roughness"][15, 20], 0.2)
    fields = json.loads(scene._item(*scene._find(handles[0]["material"], "material"))[3])
    assert fields["specular"] == 0.25 and fields["clearcoat"] == 0.5 and fields["normal_map"] and fields["occlusion"]
    # As files of glTF are read: each has the picture of both; of others each has its own
    for images, expected in (
        ({"metallic_img": data, "roughness_img": data.copy()}, [0.8, 0.2]),
        ({"metallic_img": data[..., 2], "roughness_img": data[..., 1]}, [0.8, 0.2]),
        ({"metallic_img": data[..., 2], "ao_rough_metal_img": data[..., ::-1]}, [0, 0.2]),
    ):
        scene = fl.Scene()
        scene.add({"geometry": mesh, "material": record(shader="defaultLit", base_metallic=1.0, **images)})
        frame = scene.render(camera=ABOVE, buffers=["metallic", "roughness"], **SMALL)
        assert close([frame["metallic"][15, 20], frame["roughness"][15, 20]], expected)
    # The same as dicts, and one geometry with its material
    clear = record(shader="defaultLitTransparency", base_color=[1.0, 0.0, 0.0, 0.25])
    for thing in (
        {"meshes": [{"mesh": mesh, "mesh_name": "a", "material_idx": 0}], "materials": [clear]},
        {"name": "a", "geometry": mesh, "material": clear},
    ):
        scene = fl.Scene()
        (handle,) = scene.add(thing)
        assert handle.name == "a"
        assert close(scene.render(camera=ABOVE, buffers="opacity", **SMALL)["opacity"][15, 20], 0.25)
    scene = fl.Scene()
    scene.add({"geometry": mesh, "material": record(base_color=[0.0, 0.5, 0.0, 1.0])})
    assert close(scene.render(camera=ABOVE, **SMALL)["color"][15, 20], [0, 0.5, 0, 1])
    with pytest.raises(TypeError, match="a mesh of the model is a NoneType"):
        fl.Scene().add({"meshes": [{}], "materials": []})


def test_nodes_share_the_material_of_their_mesh():
    image = types.SimpleNamespace(image=PIXELS, diffuse=None)
    square = trimesh(kind="texture", uv=UV, material=image)
    scene = fl.Scene()
    scene.add(graph({f"node {i}": (np.eye(4), "square") for i in range(3)}, {"square": square}))
    counts = dict(scene._counts())
    assert (counts["shape"], counts["material"], counts["texture"]) == (3, 1, 1)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_textures_are_arrays_pictures_and_bytes(kind):
    most = np.iinfo(kind).max
    gray = np.array([[0.0, 0.25], [0.5, 1.0]])
    pictures = {"array": (gray * most).astype(kind), "channel": (gray * most).astype(kind)[..., None]}
    pictures["color"] = np.repeat(pictures["channel"], 3, axis=2)
    from firstlight._models import png

    pictures["bytes"] = png(pictures["color"])
    pictures["file"] = io.BytesIO(pictures["bytes"])
    for name, picture in pictures.items():
        scene = fl.Scene()
        scene.add_image_texture("gray", file=picture, color_space="raw", filter="nearest")
        scene.add_unlit_material("m", color={"texture": "gray"})
        scene.add_mesh(SQUARE, HALVES, uv=UV, material="m")
        albedo = scene.render(camera=ABOVE, buffers="albedo", **SMALL)["albedo"]
        texels = [albedo[y, x, 0] for y in (7, 22) for x in (12, 27)]
        assert np.allclose(texels, gray.ravel(), atol=1 / 255), name
    with pytest.raises(ValueError, match=r"an array of shape \(2, 2\) and float64; a picture is"):
        fl.Scene().add_image_texture("gray", file=gray)
    with pytest.raises(TypeError, match="open it as 'rb'"):
        fl.Scene().add_image_texture("gray", file=io.StringIO("x"))


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

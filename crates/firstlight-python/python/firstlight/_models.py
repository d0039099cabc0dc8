"""Meshes of trimesh and of Open3D: what of them becomes part of a scene, and what is said of the rest."""

import struct
import sys
import warnings
import zlib
from hashlib import sha256

import numpy as np

from ._firstlight import SceneWarning

# Edges of trimesh's meshes are smooth up to this angle between faces, in degrees
SMOOTH_DEG = 30
# How far the normal of a vertex may be from that of a face whose own it is
_ROUNDING = 1e-3
# What trimesh gives materials that say nothing
_DEFAULT = (102, 102, 102, 255)
# What a material of trimesh may have that is not taken, and what it is called
_PBR = {
    "metallicFactor": "metallic factor",
    "roughnessFactor": "roughness factor",
    "metallicRoughnessTexture": "metallic and roughness texture",
    "normalTexture": "normal texture",
    "emissiveFactor": "emission",
    "emissiveTexture": "emission texture",
    "occlusionTexture": "occlusion texture",
}
# Values that ask for nothing
_HARMLESS = {"metallicFactor": 0, "roughnessFactor": 1, "emissiveFactor": 0}


class Model:
    """One mesh of another package, as arguments of `add_mesh`, and what could not be taken of it."""

    def __init__(self, vertices, faces):
        self.vertices = vertices
        self.faces = np.asarray(faces)
        self.arrays = {}
        self.smooth_deg = None
        self.texture = None
        self.factor = None
        self.lost = []
        # What is not, `add_mesh` refuses in its own words
        self.is_sound = self.faces.dtype.kind in "iu" and self.faces.ndim == 2 and self.faces.shape[1] == 3
        self.is_sound &= self.faces.size == 0 or 0 <= self.faces.min() <= self.faces.max() < len(vertices)

    def by_corner(self):
        """Gives each corner of each triangle a vertex of its own."""
        corners = self.faces.ravel()
        self.vertices = np.asarray(self.vertices)[corners]
        self.arrays = {key: array[corners] for key, array in self.arrays.items()}
        self.faces = np.arange(corners.size).reshape(-1, 3)

    def add(self, scene, name, fields):
        """Adds it to a scene; answers with the things that were added, the mesh first."""
        called = f"the mesh {name!r}" if name else "a mesh without a name"
        added = []
        arrays = {key: array for key, array in self.arrays.items() if key not in fields}
        if "material" not in fields and (self.texture is not None or self.factor is not None):
            added += self._material(scene, name or "mesh")
            fields = {**fields, "material": added[0].name}
        elif "material" in fields and self.texture is not None:
            self.lost.append("texture, since a material is given")
        if "normals" not in fields and "normals" not in arrays and self.smooth_deg is not None:
            fields = {"smooth_deg": self.smooth_deg, **fields}
        if name:
            fields = {**fields, "name": name}
        try:
            added.insert(0, scene.add_mesh(self.vertices, self.faces, **{**arrays, **fields}))
        except BaseException:
            remove_all(scene, added)
            raise
        if self.lost:
            warn(f"{called}: not taken: {', '.join(self.lost)}")
        return added

    def _material(self, scene, base):
        """A material with the base colour, and its texture."""
        factor = self.factor if self.factor is not None else [1.0, 1.0, 1.0]
        if self.texture is None:
            return [scene.add_phong_material(_free(scene, base, "material"), diffuse=[float(c) for c in factor])]
        picture = png(self.texture)
        file = scene._give_picture(picture, sha256(picture).hexdigest())
        texture = scene.add_image_texture(_free(scene, base, "texture"), file=file)
        diffuse = {"texture": texture.name, "factor": [float(c) for c in factor]}
        return [scene.add_phong_material(_free(scene, base, "material"), diffuse=diffuse), texture]


def remove_all(scene, things):
    """Takes back what was added when something failed later."""
    for thing in things:
        scene.remove(thing)


def warn(text):
    """A warning of the code that called the package, however many calls that is away."""
    level, frame = 1, sys._getframe()
    while frame is not None and frame.f_globals.get("__name__", "").startswith("firstlight."):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, SceneWarning, stacklevel=level)


def _free(scene, base, family):
    """A name that no other thing of a family has."""
    number, name = 1, base
    while scene._is_taken(family, name):
        number += 1
        name = f"{base}-{number}"
    return name


def png(pixels):
    """The bytes of a PNG file of an array (height, width, 3) of bytes."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(rows.tobytes(), 1)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def _rgb(image):
    """The pixels of a picture of Pillow or of an array, as (height, width, 3) bytes, and whether it has some alpha."""
    if hasattr(image, "convert"):
        pixels = np.asarray(image.convert("RGBA"))
    else:
        pixels = np.asarray(image)
        if pixels.ndim == 2:
            pixels = pixels[..., None]
        if pixels.ndim != 3 or pixels.dtype != np.uint8 or pixels.shape[2] not in (1, 3, 4):
            return None, False
        if pixels.shape[2] == 1:
            pixels = np.repeat(pixels, 3, axis=2)
    if 0 in pixels.shape:
        return None, False
    return np.ascontiguousarray(pixels[..., :3]), pixels.shape[2] == 4 and bool((pixels[..., 3] < 255).any())


def _linear(color):
    """A colour of bytes, in sRGB, as linear floats."""
    c = np.asarray(color, dtype=np.float64)[:3] / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def of_trimesh(mesh):
    """A mesh of trimesh.

    Its normals are computed when somebody looks at them, and nothing says whether they were given: they are not taken.
    It has facets where each vertex belongs to faces that lie in one plane, unless normals are there that say otherwise,
    and else is smooth across edges of up to `SMOOTH_DEG`.
    """
    model = Model(np.asarray(mesh.vertices), mesh.faces)
    if not model.is_sound:
        return model
    cache = getattr(mesh, "_cache", ())
    model.smooth_deg = None if _has_facets(model, cache) else SMOOTH_DEG
    visual = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    if kind == "vertex":
        _take_colors(model, np.asarray(visual.vertex_colors))
    elif kind == "face":
        colors = np.asarray(visual.face_colors)
        model.by_corner()
        _take_colors(model, np.repeat(colors, 3, axis=0))
    elif kind == "texture":
        uv = getattr(visual, "uv", None)
        if uv is not None and len(uv) == len(model.vertices):
            model.arrays["uv"] = np.asarray(uv)
        _take_material(model, getattr(visual, "material", None))
        colors = getattr(visual, "vertex_attributes", {}).get("color")
        if colors is not None and len(colors) == len(model.vertices):
            _take_colors(model, np.asarray(colors))
    return model


def _has_facets(model, cache):
    """Whether a mesh is flat: its vertices have the normals of their faces, whether somebody looked at them or not."""
    corners = np.asarray(model.vertices, dtype=np.float64)[model.faces]
    of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(of_faces, axis=1)
    has_area = lengths > 0
    of_faces, faces = of_faces[has_area] / lengths[has_area, None], model.faces[has_area]
    # Of each vertex that of one of its faces, which is that of all of them where they lie in one plane
    of_vertices = np.zeros((len(model.vertices), 3))
    of_vertices[faces] = of_faces[:, None]
    if (np.abs(of_vertices[faces] - of_faces[:, None]) > _ROUNDING).any():
        return False
    # Those that trimesh computes for such vertices differ by rounding alone
    given = np.asarray(cache["vertex_normals"]) if "vertex_normals" in cache else of_vertices
    return bool((np.abs(given[faces] - of_faces[:, None]) < 10 * _ROUNDING).all())


def _take_colors(model, colors):
    """Colours of the vertices: bytes in sRGB, or linear floats."""
    whole = 255 if colors.dtype == np.uint8 else 1
    if colors.shape[1] == 4 and (colors[:, 3] < whole).any():
        model.lost.append("alpha of its colours")
    model.arrays["colors"] = colors[:, :3]


def _take_texture(model, image):
    """A picture for the base colour."""
    pixels, has_alpha = _rgb(image)
    if pixels is None:
        model.lost.append("texture: it is no picture of bytes")
    elif "uv" not in model.arrays:
        model.lost.append("texture: there is no texture coordinate for each vertex")
    else:
        model.texture = pixels
    if has_alpha:
        model.lost.append("alpha of its texture")


def _take_factor(model, color):
    """A base colour that is linear, and its alpha."""
    model.factor = color[:3]
    if len(color) == 4 and color[3] < 1:
        model.lost.append("alpha of its base colour")


def _take_material(model, material):
    """The base colour of a material of trimesh, and its texture."""
    if material is None:
        return
    if hasattr(material, "materials"):
        model.lost.append(f"{len(material.materials)} materials of one mesh: split it by material")
        return
    if hasattr(material, "baseColorFactor"):
        if material.baseColorTexture is not None:
            _take_texture(model, material.baseColorTexture)
        if material.baseColorFactor is not None:
            # glTF's are linear; trimesh has them times 255
            color = np.asarray(material.baseColorFactor)
            _take_factor(model, color / 255 if color.dtype == np.uint8 else color)
        for field, word in _PBR.items():
            value = getattr(material, field, None)
            if value is not None and (field not in _HARMLESS or np.any(np.asarray(value) != _HARMLESS[field])):
                model.lost.append(word)
        return
    image, diffuse = getattr(material, "image", None), getattr(material, "diffuse", None)
    if image is not None and not _says_nothing(image):
        _take_texture(model, image)
    if diffuse is not None and tuple(diffuse) != _DEFAULT:
        color = np.asarray(diffuse)
        _take_factor(model, np.append(_linear(color), color[3:] / 255))
    specular = getattr(material, "specular", None)
    if specular is not None and tuple(specular) != _DEFAULT and np.any(np.asarray(specular)[:3]):
        model.lost.append("specular colour")


def _says_nothing(image):
    """Whether it is the picture that trimesh makes where there is none."""
    pixels, _ = _rgb(image)
    return pixels is not None and bool((pixels == _DEFAULT[:3]).all())


def of_open3d(mesh):
    """A mesh of Open3D, with the normals that were given or computed; without them it is flat, as Open3D draws it."""
    model = Model(np.asarray(mesh.vertices), mesh.triangles)
    if not model.is_sound:
        return model
    if len(getattr(mesh, "vertex_normals", ())):
        model.arrays["normals"] = np.asarray(mesh.vertex_normals)
    if len(getattr(mesh, "vertex_colors", ())):
        _take_colors(model, np.asarray(mesh.vertex_colors))
    uvs = np.asarray(getattr(mesh, "triangle_uvs", ()))
    textures = [np.asarray(texture) for texture in getattr(mesh, "textures", ())]
    if len(uvs) and len(uvs) == model.faces.size:
        model.by_corner()
        model.arrays["uv"] = uvs
    if len(np.unique(np.asarray(getattr(mesh, "triangle_material_ids", ())))) > 1 and len(textures) > 1:
        model.lost.append(f"{len(textures)} textures of one mesh: split it by material")
    elif textures and textures[0].size:
        # It has them upside down
        _take_texture(model, textures[0][::-1])
    return model


def of_tensors(mesh):
    """A mesh of Open3D's tensors."""

    def array(attributes, key):
        return attributes[key].cpu().numpy() if key in attributes else None

    vertex, triangle = mesh.vertex, mesh.triangle
    model = Model(array(vertex, "positions"), array(triangle, "indices"))
    if not model.is_sound:
        return model
    normals, colors = array(vertex, "normals"), array(vertex, "colors")
    if normals is not None:
        model.arrays["normals"] = normals
    if colors is not None:
        _take_colors(model, colors)
    uvs, colors = array(triangle, "texture_uvs"), array(triangle, "colors")
    if uvs is not None or colors is not None:
        model.by_corner()
    if uvs is not None:
        model.arrays["uv"] = uvs.reshape(-1, 2)
    if colors is not None:
        _take_colors(model, np.repeat(colors, 3, axis=0))
    material = getattr(mesh, "material", None)
    if material is None or not material.is_valid():
        return model
    maps, vectors, scalars = material.texture_maps, material.vector_properties, material.scalar_properties
    for key in maps:
        if key == "albedo":
            _take_texture(model, maps[key].as_tensor().cpu().numpy())
        else:
            model.lost.append(f"{key} texture")
    if "base_color" in vectors:
        _take_factor(model, np.asarray(vectors["base_color"], dtype=np.float64))
    if "metallic" in scalars and scalars["metallic"] != 0:
        model.lost.append("metallic factor")
    if "roughness" in scalars and scalars["roughness"] != 1:
        model.lost.append("roughness factor")
    return model


def of(thing):
    """A mesh of another package; None of what is none."""
    if hasattr(thing, "faces") and hasattr(thing, "vertices"):
        return of_trimesh(thing)
    if hasattr(thing, "triangle") and hasattr(thing, "vertex"):
        return of_tensors(thing)
    if hasattr(thing, "triangles") and hasattr(thing, "vertices"):
        return of_open3d(thing)
    return None


def add_graph(scene, graph, fields):
    """Adds the meshes of a scene of trimesh; answers with their things."""
    things, handles = [], []
    outer, base = fields.get("transform"), fields.get("name")
    outer = None if outer is None else np.asarray(outer, dtype=np.float64)
    try:
        for node in graph.graph.nodes_geometry:
            matrix, geometry = graph.graph[node]
            thing = graph.geometry[geometry]
            name = f"{base}/{node}" if base else str(node)
            model = of(thing)
            if model is None or len(model.faces) == 0:
                what = "it has no faces" if model is not None else f"it is a {type(thing).__name__}, and no mesh"
                warn(f"{name!r} is not taken: {what}")
                continue
            matrix = matrix if outer is None else outer @ matrix
            added = model.add(scene, name, {**fields, "transform": matrix})
            things += added
            handles.append(added[0])
    except BaseException:
        remove_all(scene, things)
        raise
    rest = [word for word, is_there in _beside(graph) if is_there]
    if rest:
        called = f"the scene {base!r}" if base else "a scene of trimesh"
        warn(f"{called}: not taken: {', '.join(rest)}; add_camera and the methods for lights add them")
    return handles


def _beside(graph):
    """What a scene of trimesh has beside its meshes, without making it: trimesh makes what it is asked for."""
    yield "its camera", getattr(graph, "has_camera", False)
    yield "its lights", bool(getattr(graph, "_lights", None))

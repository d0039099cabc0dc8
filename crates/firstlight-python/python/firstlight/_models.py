"""Meshes of trimesh and of Open3D: what of them becomes part of a scene, and what is said of the rest."""

import os
import struct
import sys
import warnings
import zlib
from dataclasses import dataclass, field
from hashlib import sha256

import numpy as np

from ._firstlight import SceneWarning

# Edges of trimesh's meshes are smooth up to this angle between faces, in degrees
SMOOTH_DEG = 30
# How far the normal of a vertex may be from that of a face whose own it is
_ROUNDING = 1e-3
# What trimesh gives materials that say nothing
_DEFAULT = (102, 102, 102, 255)
# The reflectance of Filament's materials that say none, that of an index of refraction of 1.5
_REFLECTANCE = 0.5


@dataclass
class Map:
    """A texture as a field of a material: an array of bytes, and what the field takes of it."""

    # What it is called, behind the name of the material
    role: str
    pixels: np.ndarray
    # All of it but its name, as a scene has it; None where the field takes a name alone
    param: dict | None = field(default_factory=dict)


@dataclass
class Look:
    """A material: its kind in a scene, and its fields, of which some are a `Map`."""

    kind: str
    fields: dict

    def maps(self):
        """Its textures, each once."""
        return {each.role: each for each in self.fields.values() if isinstance(each, Map)}

    def unlit(self):
        """The material that shows the colour of this one, whatever light there is."""
        kept = {key: self.fields[key] for key in _UNLIT if key in self.fields}
        colors = [self.fields[key] for key in ("base_color", "diffuse", "color") if key in self.fields]
        return Look("unlit", {"color": colors[0] if colors else [1.0, 1.0, 1.0], **kept})

    def add(self, scene, base):
        """Adds it to a scene; answers with the things that were added, the material first."""
        named = {}
        for role, each in self.maps().items():
            file = give_picture(scene, each.pixels)
            named[role] = scene.add_image_texture(_free(scene, f"{base} {role}".strip(), "texture"), file=file)
        fields = {}
        for key, value in self.fields.items():
            if isinstance(value, Map):
                name = named[value.role].name
                value = name if value.param is None else {"texture": name, **value.param}
            fields[key] = value
        method = getattr(scene, f"add_{self.kind.replace('-', '_')}_material")
        try:
            return [method(_free(scene, base, "material"), **fields), *named.values()]
        except BaseException:
            remove_all(scene, named.values())
            raise


# What a material that shows its colour alone has beside it
_UNLIT = ("alpha", "alpha_mode", "cutoff", "single_sided", "emissive", "emissive_strength")


class Model:
    """One mesh of another package, as arguments of `add_mesh`, and what could not be taken of it."""

    def __init__(self, vertices, faces):
        self.vertices = vertices
        self.faces = np.asarray(faces)
        self.arrays = {}
        self.smooth_deg = None
        self.look = None
        # What tells its material from others, if several meshes may have it
        self.key = None
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

    def add(self, scene, name, fields, shared=None):
        """Adds it to a scene; answers with the things that were added, the mesh first.

        `shared` has the names of materials by their keys, those of the meshes before.
        """
        called = f"the mesh {name!r}" if name else "a mesh without a name"
        added, shared, fields = [], {} if shared is None else shared, dict(fields)
        is_unlit, is_covered = fields.pop("unlit", False), fields.pop("_material", None)
        arrays = {key: array for key, array in self.arrays.items() if key not in fields}
        look = self.look
        if is_covered:
            fields["material"] = is_covered
        elif "material" in fields:
            if look is not None and look.maps():
                self.lost.append("texture, since a material is given")
        elif look is not None or is_unlit:
            look = (look or Look("phong", {})).unlit() if is_unlit else look
            key = None if self.key is None else (self.key, look.kind, tuple(look.maps()))
            if key is None or key not in shared:
                added += look.add(scene, name or "mesh")
                shared[key] = added[0].name
            fields["material"] = shared[key]
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
    """The bytes of a PNG file of an array (height, width, channels) of 8 or 16 bits, with 1 to 4 channels."""
    height, width, channels = pixels.shape
    bits = 8 * pixels.dtype.itemsize
    rows = np.zeros((height, 1 + width * channels * bits // 8), dtype=np.uint8)
    samples = np.ascontiguousarray(pixels.astype(f">u{bits // 8}"))
    rows[:, 1:] = samples.reshape(height, -1).view(np.uint8)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    kind = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    data = zlib.compress(rows.tobytes(), 1)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def give_picture(scene, pixels):
    """Keeps a picture for a scene; answers with the name that stands for it as a file."""
    picture = png(pixels)
    return scene._give_file(picture, sha256(picture).hexdigest(), ".png")


def content_of(thing):
    """The bytes of a file in memory or of one that is open, and what it is called; None of what is neither."""
    if isinstance(thing, (bytes, bytearray, memoryview)):
        return bytes(thing), None
    if not hasattr(thing, "read") or isinstance(thing, os.PathLike):
        return None
    content, name = thing.read(), getattr(thing, "name", None)
    if not isinstance(content, bytes):
        raise TypeError(f"the file gives {type(content).__name__}, and bytes are wanted: open it as 'rb'")
    return content, os.path.basename(name) if isinstance(name, str) else None


def file_of(scene, thing):
    """What a field `file` says: a path as it is, and a name that stands for bytes, an open file or a picture."""
    if isinstance(thing, (str, os.PathLike)):
        return thing
    content = content_of(thing)
    if content is not None:
        return scene._give_file(content[0], sha256(content[0]).hexdigest(), f"/{content[1] or 'file'}")
    if hasattr(thing, "convert") or hasattr(thing, "__array__"):
        pixels = _pixels(thing)
        if pixels is None:
            array = np.asarray(thing)
            raise ValueError(
                f"file: an array of shape {array.shape} and {array.dtype}; a picture is (height, width) or (height, "
                "width, 1 to 4) of uint8 or uint16"
            )
        return give_picture(scene, pixels)
    return thing


def _pixels(image):
    """The pixels of a picture of Pillow or of an array, as (height, width, channels); None of what is no picture."""
    if hasattr(image, "convert") and getattr(image, "mode", None) not in ("L", "RGB", "RGBA", "LA", "I;16"):
        image = image.convert("RGBA")
    pixels = np.asarray(image)
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or pixels.dtype not in (np.uint8, np.uint16) or not 1 <= pixels.shape[2] <= 4:
        return None
    return None if 0 in pixels.shape else pixels


def _has_alpha(pixels):
    """Whether a picture is not opaque everywhere."""
    is_opaque = pixels.shape[2] in (1, 3) or (pixels[..., -1] == np.iinfo(pixels.dtype).max).all()
    return not is_opaque


def _opaque(pixels):
    """A picture without its alpha."""
    return pixels if pixels.shape[2] in (1, 3) else pixels[..., : pixels.shape[2] - 1]


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


def _taken(model, image, word):
    """The pixels of a texture; None of what is no picture, or cannot be laid."""
    pixels = None if image is None else _pixels(image)
    if image is None:
        return None
    if pixels is None:
        model.lost.append(f"{word}: it is no picture of bytes")
    elif "uv" not in model.arrays:
        model.lost.append(f"{word}: there is no texture coordinate for each vertex")
        pixels = None
    return pixels


def _floats(value, count, default):
    """Some numbers: as they are, or bytes as 0 to 1."""
    if value is None:
        return default
    value = np.atleast_1d(np.asarray(value))
    value = (value / 255 if value.dtype == np.uint8 else value.astype(np.float64)).tolist()
    return [*value, *default[len(value) :]][:count]


def _number(value, default):
    return float(default if value is None else value)


def _limited(numbers):
    return [min(max(float(number), 0.0), 1.0) for number in numbers]


def _colored(role, pixels, factor, keeps_alpha=False):
    """A field that is a colour, times a texture."""
    factor = _limited(factor[:3])
    return factor if pixels is None else Map(role, pixels if keeps_alpha else _opaque(pixels), {"factor": factor})


def _from_channel(role, pixels, channel, factor):
    """A field that is a number, times a channel of a texture."""
    factor = _limited([factor])[0]
    if pixels is None:
        return factor
    # Of a gray picture each channel is its gray
    channel = channel if pixels.shape[2] >= 3 else "r"
    return Map(role, _opaque(pixels), {"channel": channel, "factor": factor})


def _add_maps(fields, model, normal, occlusion):
    """Adds the normal map and the occlusion texture of a material to its fields, if it has them."""
    normal, occlusion = _taken(model, normal, "normal texture"), _taken(model, occlusion, "occlusion texture")
    if normal is not None:
        fields["normal_map"] = Map("normal", _opaque(normal), None)
    if occlusion is not None:
        fields["occlusion"] = _from_channel("occlusion", occlusion, "r", 1.0)


def _alpha(mode, pixels, factor, cutoff=None):
    """The fields of a material that is not opaque. The texture is that of the colour."""
    factor = _limited([factor])[0]
    is_map = pixels is not None and _has_alpha(pixels)
    alpha = Map("", pixels, {"channel": "a", "factor": factor}) if is_map else factor
    return {"alpha": alpha, "alpha_mode": mode, **({} if cutoff is None else {"cutoff": _limited([cutoff])[0]})}


def _take_material(model, material):
    """A material of trimesh."""
    if material is None:
        return
    if hasattr(material, "materials"):
        model.lost.append(f"{len(material.materials)} materials of one mesh: split it by material")
        return
    model.key = id(material)
    model.look = _pbr(model, material) if hasattr(material, "baseColorFactor") else _simple(model, material)


def _pbr(model, material):
    """A material of glTF, as trimesh has it: what it does not say is as in such a file.

    Source: "glTF 2.0 specification", section 3.9.
    """

    def said(key):
        return getattr(material, key, None)

    # trimesh has this linear colour times 255
    factor = _floats(said("baseColorFactor"), 4, [1.0] * 4)
    base = _taken(model, said("baseColorTexture"), "texture")
    both = _taken(model, said("metallicRoughnessTexture"), "metallic and roughness texture")
    mode = {"MASK": "mask", "BLEND": "blend"}.get(str(said("alphaMode")).upper())
    cutoff = _number(said("alphaCutoff"), 0.5) if mode == "mask" else None
    fields = {
        "base_color": _colored("", base, factor, keeps_alpha=mode is not None),
        "metallic": _from_channel("metallic-roughness", both, "b", _number(said("metallicFactor"), 1.0)),
        "roughness": _from_channel("metallic-roughness", both, "g", _number(said("roughnessFactor"), 1.0)),
        "single_sided": not said("doubleSided"),
        **({} if mode is None else _alpha(mode, base, factor[3], cutoff)),
    }
    _add_maps(fields, model, said("normalTexture"), said("occlusionTexture"))
    emission = [max(0.0, number) for number in _floats(said("emissiveFactor"), 3, [0.0] * 3)]
    if any(emission):
        texture, most = _taken(model, said("emissiveTexture"), "emission texture"), max(1.0, *emission)
        fields["emissive"] = _colored("emission", texture, [number / most for number in emission])
        if most > 1:
            fields["emissive_strength"] = most
    return Look("metallic-roughness", fields)


def _simple(model, material):
    """A material of an OBJ file, as trimesh has it; None of one that says nothing."""

    def said(key):
        value = getattr(material, key, None)
        return None if value is None or tuple(np.asarray(value)) == _DEFAULT else np.asarray(value)

    image, diffuse, specular = getattr(material, "image", None), said("diffuse"), said("specular")
    base = None if image is None or _says_nothing(image) else _taken(model, image, "texture")
    factor = np.ones(4) if diffuse is None else np.append(_linear(diffuse), diffuse[3:] / 255)
    alpha = float(factor[3]) if len(factor) == 4 else 1.0
    fields = {}
    if base is not None or diffuse is not None:
        is_clear = alpha < 1 or (base is not None and _has_alpha(base))
        fields["diffuse"] = _colored("", base, factor.tolist(), keeps_alpha=is_clear)
        fields.update(_alpha("blend", base, alpha) if is_clear else {})
    if specular is not None and specular[:3].any():
        fields["specular"] = _linear(specular).tolist()
        shininess = getattr(material, "glossiness", None)
        # 1 is what trimesh has for what was not said
        if shininess is not None and float(shininess) > 1:
            fields["shininess"] = min(float(shininess), 1e6)
    return Look("phong", fields) if fields else None


def _says_nothing(image):
    """Whether it is the picture that trimesh makes where there is none."""
    pixels = _pixels(image)
    return pixels is not None and pixels.shape[2] >= 3 and bool((pixels[..., :3] == _DEFAULT[:3]).all())


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
        base = _taken(model, textures[0][::-1], "texture")
        if base is not None:
            if _has_alpha(base):
                model.lost.append("alpha of its texture")
            model.look = Look("phong", {"diffuse": _colored("", base, [1.0] * 3)})
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

    def known(table, key):
        """By its name, or by the one that tensors have for it."""
        return next((name for name in (key, key.replace("clearcoat", "clear_coat")) if name in table), None)

    def texture(key):
        name = known(maps, key)
        return None if name is None else maps[name].as_tensor().cpu().numpy()

    def vector(key):
        return np.asarray(vectors[key], dtype=np.float64) if key in vectors else None

    def scalar(key):
        name = known(scalars, key)
        return None if name is None else float(scalars[name])

    # Files are read as "defaultUnlit", whatever is in them
    shader = str(getattr(material, "material_name", "") or "").replace("Unlit", "Lit")
    model.look = _filament(model, texture, vector, scalar, shader)
    return model


def of_record(model, record):
    """A mesh with a `MaterialRecord` of Open3D."""

    def texture(key):
        image = getattr(record, {"ambient_occlusion": "ao"}.get(key, key) + "_img", None)
        return None if image is None or np.asarray(image).size == 0 else np.asarray(image)

    def vector(key):
        value = getattr(record, key, None)
        return None if value is None else np.asarray(value, dtype=np.float64)

    def scalar(key):
        return getattr(record, f"base_{key}", None)

    shader = str(getattr(record, "shader", "") or "")
    if getattr(record, "has_alpha", False):
        shader = "defaultLitTransparency"
    model.key = id(record)
    model.look = _filament(model, texture, vector, scalar, shader)
    return model


# Textures of Open3D's materials that are not taken, and what they are called
_NOT_TAKEN = {"reflectance": "reflectance texture", "anisotropy": "anisotropy texture"}


def _filament(model, texture, vector, scalar, shader):
    """A material of Open3D, which are those of Filament.

    Source: Filament, "Physically based rendering", section 4.8: f0 = 0.16 reflectance^2, which is 0.04 for 0.5.
    """
    factor = _floats(vector("base_color"), 4, [1.0] * 4)
    base = _taken(model, texture("albedo"), "texture")
    is_clear = shader.endswith("Transparency") or shader.endswith("SSR")
    clear = _alpha("blend", base, factor[3]) if is_clear else {}
    base_color = _colored("", base, factor, keeps_alpha=is_clear)
    if "unlit" in shader.lower():
        return Look("unlit", {"color": base_color, **clear})
    both = _taken(model, texture("ao_rough_metal"), "metallic and roughness texture")
    fields = {"base_color": base_color, **clear}
    own = {key: None if both is not None else texture(key) for key in ("metallic", "roughness")}
    # Of a file of glTF each is the one picture that has both
    if own["metallic"] is not None and np.ndim(own["metallic"]) == 3 and np.array_equal(*own.values()):
        both, own = _taken(model, own["metallic"], "metallic and roughness texture"), dict.fromkeys(own)
    for key, channel, default in (("metallic", "b", 0.0), ("roughness", "g", 1.0)):
        alone = _taken(model, own[key], f"{key} texture")
        role, pixels, channel = ("metallic-roughness", both, channel) if alone is None else (key, alone, "r")
        fields[key] = _from_channel(role, pixels, channel, _number(scalar(key), default))
    _add_maps(fields, model, texture("normal"), texture("ambient_occlusion"))
    reflectance = _number(scalar("reflectance"), _REFLECTANCE)
    if reflectance != _REFLECTANCE:
        fields["specular"] = _limited([4 * reflectance * reflectance])[0]
    for key in ("clearcoat", "clearcoat_roughness"):
        pixels, value = _taken(model, texture(key), f"{key.replace('_', ' ')} texture"), scalar(key)
        if value or pixels is not None:
            fields[key] = _from_channel(key.replace("_", "-"), pixels, "r", _number(value, 0.0))
    emission = _floats(vector("emissive_color"), 3, [0.0] * 3)
    if any(emission):
        fields["emissive"] = _limited(emission)
    model.lost += [word for key, word in _NOT_TAKEN.items() if texture(key) is not None]
    if scalar("anisotropy"):
        model.lost.append("anisotropy")
    return Look("metallic-roughness", fields)


def of(thing):
    """A mesh of another package; None of what is none."""
    if hasattr(thing, "faces") and hasattr(thing, "vertices"):
        return of_trimesh(thing)
    if hasattr(thing, "triangle") and hasattr(thing, "vertex"):
        return of_tensors(thing)
    if hasattr(thing, "triangles") and hasattr(thing, "vertices"):
        return of_open3d(thing)
    return None


def parts_of(thing):
    """The meshes of a model of Open3D, as `read_triangle_model` gives it, each with its name; None of what is none.

    Also a dict of the same, and one of a geometry and its material.
    """

    def part(thing, key):
        return thing.get(key) if isinstance(thing, dict) else getattr(thing, key, None)

    meshes, materials = part(thing, "meshes"), part(thing, "materials")
    if isinstance(thing, dict) and "geometry" in thing:
        meshes, materials = [{**thing, "mesh": thing["geometry"], "material_idx": 0}], [thing.get("material")]
    if meshes is None or materials is None or callable(meshes):
        return None
    parts = []
    for each in meshes:
        model, number = of(part(each, "mesh")), part(each, "material_idx")
        if model is None:
            raise TypeError(f"a mesh of the model is a {type(part(each, 'mesh')).__name__}")
        if number is not None and 0 <= number < len(materials) and materials[number] is not None:
            of_record(model, materials[number])
        parts.append((part(each, "mesh_name") or part(each, "name") or None, model))
    return parts


def add_parts(scene, parts, fields):
    """Adds the meshes of a model of Open3D; answers with their things."""
    things, handles, shared, base = [], [], {}, fields.get("name")
    try:
        for number, (name, model) in enumerate(parts):
            name = name or (f"part {number}" if base and len(parts) > 1 else None)
            name = "/".join(word for word in (base, name) if word) or None
            # Models name several of their meshes alike
            name = name if name is None else _free(scene, name, "shape")
            added = model.add(scene, name, {key: value for key, value in fields.items() if key != "name"}, shared)
            things += added
            handles.append(added[0])
    except BaseException:
        remove_all(scene, things)
        raise
    return handles


def add_graph(scene, graph, fields):
    """Adds the meshes of a scene of trimesh; answers with their things."""
    things, handles, shared = [], [], {}
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
            added = model.add(scene, name, {**fields, "transform": matrix}, shared)
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

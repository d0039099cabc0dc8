"""Direct light, without noise, with the same bits on every machine: see the docstrings of the module itself."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import IO, Any, Literal, TypedDict, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack

__version__: str
BUFFERS: list[str]
BUILTIN: list[str]
SHAPES: list[str]
LIGHTS: list[str]
MATERIALS: list[str]
TEXTURES: list[str]

# Or light:NAME, light:#3, light:*, group:NAME, group:*, and their parts: diffuse, specular, unshadowed, visibility,
# unscaled-diffuse, unscaled-specular, as in light:NAME:diffuse; coverage:NAME, coverage:#3, coverage:*
Buffer = str | Literal[
    "color", "alpha", "background", "emission", "ambient", "diffuse", "specular", "rest", "shadow", "depth", "distance", "position",
    "position-camera", "position-object", "normal", "normal-camera", "normal-object", "normal-geometric",
    "normal-geometric-camera", "tangent", "uv", "barycentric", "albedo", "roughness", "metallic", "opacity",
    "object-id", "instance-id", "material-id", "primitive-id", "face-orientation", "motion", "motion-backward", "depth:filtered", "distance:filtered",
    "position:filtered", "position-camera:filtered", "normal:filtered", "normal-camera:filtered",
    "normal-geometric:filtered", "normal-geometric-camera:filtered", "uv:filtered", "albedo:filtered",
    "roughness:filtered", "metallic:filtered",
    "coverage:background", "crypto-object", "crypto-instance", "crypto-material", "rays", "relight",
]
# Three rows or four of four numbers, or a table of the scene format
Transform = ArrayLike | Mapping[str, Any] | None
# Linear [r, g, b], "#rrggbb", "#rgb" or a name of CSS in sRGB, or a gray
Color = Sequence[float] | NDArray[Any] | str | float
Vector = Sequence[float] | NDArray[Any]
# Where a camera that is found looks from: by name, or azimuth and elevation in degrees
View = (
    Literal["front", "back", "left", "right", "side", "top", "bottom", "iso", "three-quarter"]
    | tuple[float, float]
    | Sequence[float]
)
Studio = Literal["soft", "hard", "flat", "clay", "none"]
# The bytes of a file, or one that is open
Content = bytes | bytearray | memoryview | IO[bytes]
# A colour or a number, or {"texture": NAME, "factor": ...}
ColorParam = Color | Mapping[str, Any]
NumberParam = float | Mapping[str, Any]

class _ShapeFields(TypedDict, total=False):
    name: str | None
    material: str | None
    transform: Transform
    visible: bool
    casts_shadow: bool
    receives_shadow: bool
    single_sided: bool
    lights_include: Sequence[str] | None
    lights_exclude: Sequence[str] | None
    shadow_include: Sequence[str] | None
    shadow_exclude: Sequence[str] | None

class _MeshFields(_ShapeFields, total=False):
    smooth_deg: float | None
    uv_set: int

class _MaterialFields(TypedDict, total=False):
    emissive: ColorParam
    emissive_strength: float
    alpha: NumberParam
    alpha_mode: Literal["opaque", "mask", "blend"]
    cutoff: float
    single_sided: bool
    normal_map: str | None
    normal_scale: float
    bump_map: NumberParam
    bump_scale: float
    normal_fix: Literal["raise", "none"]
    specular_antialiasing: bool

@dataclass(frozen=True)
class Place:
    """Where in a text something stands; lines and columns count from 1."""

    file: str
    line: int
    column: int
    excerpt: str

@dataclass(frozen=True)
class Diagnostic:
    """One fault; `str()` is all of it in one line."""

    severity: Literal["error", "warning", "advice"]
    place: Place | None
    path: str
    message: str
    hint: str | None
    text: str

class SceneError(ValueError):
    """A scene cannot be rendered: `diagnostics` has all its faults."""

    diagnostics: list[Diagnostic]

class SceneWarning(UserWarning):
    """Something of a scene was put up with, as a texture that is missing, or may surprise, as a light that faces away."""

@final
class Render(Mapping[str, NDArray[Any]]):
    """The buffers of a render by name: (height, width) or (height, width, channels), row 0 at the top."""

    @property
    def receipt(self) -> dict[str, str]: ...
    @property
    def film_size(self) -> tuple[int, int]: ...
    @property
    def window(self) -> tuple[int, int, int, int]: ...
    @property
    def K(self) -> NDArray[np.float64]:
        """(3, 3), in pixels of the arrays, the middle of the first one at (0.5, 0.5)."""

    def pose(self, convention: Literal["opencv", "opengl"] = "opencv") -> NDArray[np.float64]:
        """(4, 4), camera to world."""

    @property
    def object_names(self) -> list[str | None]: ...
    def rgb8(self, *, alpha: bool = False) -> NDArray[np.uint8]:
        """(height, width, 3) or, with alpha, (height, width, 4), display-encoded."""

    def to_png(self, *, bits: Literal[8, 16] = 8) -> bytes: ...
    def save(
        self,
        path: str | os.PathLike[str],
        *,
        buffer: str | None = None,
        depth_scale: float | None = None,
        half: bool = False,
        quality: int | None = None,
    ) -> None: ...
    def __getitem__(self, name: str, /) -> NDArray[Any]: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...

class Coco:
    """A data set in COCO's format, which grows picture by picture: boxes and masks of the objects that are seen."""

    def __init__(self) -> None: ...
    @overload
    def add(
        self, picture: Render, file_name: str | os.PathLike[str], *, only: str | Sequence[str] | None = None
    ) -> Render: ...
    @overload
    def add(
        self,
        picture: Scene,
        file_name: str | os.PathLike[str],
        *,
        only: str | Sequence[str] | None = None,
        **options: Any,
    ) -> Render: ...
    def to_json(self) -> str: ...
    def save(self, path: str | os.PathLike[str]) -> None: ...

class Camera:
    """A camera: the fields of `[camera]`, and the size of its picture."""

    fields: dict[str, Any]
    width: int | None
    height: int | None
    def __init__(
        self,
        *,
        position: Vector,
        look_at: Vector = ...,
        up: Vector = ...,
        fov_y_deg: float | None = ...,
        focal_length_mm: float | None = ...,
        sensor_height_mm: float | None = ...,
        focal_length_px: Vector | None = ...,
        principal_point_px: Vector | None = ...,
        projection: Literal["perspective", "orthographic"] = ...,
        shift: Vector = ...,
        transform: Mapping[str, Any] | None = ...,
        width: int | None = None,
        height: int | None = None,
        **fields: Any,
    ) -> None: ...
    @classmethod
    def from_pose(
        cls,
        pose: ArrayLike,
        *,
        convention: Literal["opencv", "opengl"] = "opencv",
        fov_y_deg: float | None = None,
        K: ArrayLike | None = None,
        width: int | None = None,
        height: int | None = None,
        pixel_center: float = 0.5,
    ) -> Camera: ...
    @classmethod
    def from_K(
        cls,
        K: ArrayLike | None = None,
        *,
        fx: float | None = None,
        fy: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        width: int,
        height: int,
        pixel_center: float = 0.5,
        pose: ArrayLike | None = None,
        convention: Literal["opencv", "opengl"] = "opencv",
    ) -> Camera: ...
    def resized(self, width: int, height: int) -> Camera: ...
    @property
    def K(self) -> NDArray[np.float64]:
        """(3, 3), in pixels of its picture, the middle of the first one at (0.5, 0.5)."""

    def pose(self, convention: Literal["opencv", "opengl"] = "opencv") -> NDArray[np.float64]:
        """(4, 4), camera to world."""

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """(..., 2), pixels from the upper left corner; NaN for what is behind the camera."""

    def to_dict(self) -> dict[str, Any]: ...

@dataclass(frozen=True)
class Hits:
    """What rays meet. Where one meets nothing: distance inf, ids 0, all else 0."""

    hit: NDArray[np.bool_]
    distance: NDArray[np.float64]
    """Metres along the ray."""
    position: NDArray[np.float64]
    """(..., 3), metres, world space."""
    normal: NDArray[np.float32]
    """(..., 3), unit, world space: the shading normal on the side that is met."""
    normal_geometric: NDArray[np.float32]
    uv: NDArray[np.float32]
    """(..., 2)"""
    barycentric: NDArray[np.float32]
    """(..., 2): weights of the second and the third corner of a triangle."""
    object_id: NDArray[np.uint32]
    material_id: NDArray[np.uint32]
    primitive_id: NDArray[np.uint32]

class Handle:
    """A thing of a scene: its fields, and where it is."""

    @property
    def kind(self) -> str: ...
    @property
    def name(self) -> str | None: ...
    @property
    def fields(self) -> dict[str, Any]: ...
    @property
    def transform(self) -> NDArray[np.float64]: ...
    @transform.setter
    def transform(self, value: Transform) -> None: ...
    def __getitem__(self, field: str) -> Any: ...
    def __setitem__(self, field: str, value: Any) -> None: ...
    def update(self, **fields: Any) -> None: ...

class Scene:
    """A scene, empty at first."""

    def __init__(self) -> None: ...
    @classmethod
    def from_file(cls, path: str | os.PathLike[str], *, allow_dirs: Sequence[str | os.PathLike[str]] = ()) -> Scene: ...
    @classmethod
    def from_text(
        cls, text: str, *, name: str = "scene.toml", assets: str | os.PathLike[str] | Mapping[str, bytes] | None = None
    ) -> Scene: ...
    @classmethod
    def from_dict(
        cls, tree: dict[str, Any], *, assets: str | os.PathLike[str] | Mapping[str, bytes] | None = None
    ) -> Scene: ...
    @classmethod
    def from_model(
        cls,
        model: str | os.PathLike[str] | Content | Any,
        *,
        studio: Studio = "soft",
        ground: bool | None = None,
        view: View | None = None,
        margin: float | None = None,
        up: Literal["y", "z"] | None = None,
        smooth_deg: float | None = None,
        variant: str | None = None,
        scene: int | None = None,
        animation: str | int | None = None,
        name: str | None = None,
        assets: str | os.PathLike[str] | Mapping[str, bytes] | None = None,
        allow_dirs: Sequence[str | os.PathLike[str]] = (),
        width: int | None = None,
        height: int | None = None,
        background: Color | None = None,
        transparent: bool | None = None,
        **settings: Any,
    ) -> Scene: ...
    def use_studio(
        self,
        studio: Studio = "soft",
        *,
        ground: bool | None = None,
        view: View | None = None,
        margin: float | None = None,
    ) -> None: ...
    def __getitem__(self, name: str) -> Handle: ...
    def __delitem__(self, name: str) -> None: ...
    def __contains__(self, name: str) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    @property
    def settings(self) -> Handle: ...
    @property
    def hash(self) -> str: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def bounds(self) -> list[list[float]] | None: ...
    def check(self, *, time: float | None = None) -> list[Diagnostic]: ...
    def to_toml(self) -> str: ...
    def to_json(self) -> str: ...
    def render(
        self,
        *,
        camera: str | Camera | dict[str, Any] | None = None,
        width: int | None = None,
        height: int | None = None,
        buffers: Buffer | Sequence[Buffer] | None = None,
        aa: int | None = None,
        samples: Literal["exact"] | int | None = None,
        tolerance: float | None = None,
        aa_mode: Literal["adaptive", "full", "multisample"] | None = None,
        crop: tuple[int, int, int, int] | None = None,
        time: float | None = None,
        view: View | None = None,
        margin: float | None = None,
        motion_to: float | str | Camera | dict[str, Any] | None = None,
        threads: int = 0,
        progress: Callable[[int, int], object] | None = None,
    ) -> Render: ...
    def render_many(
        self,
        cameras: Iterable[str | Camera | dict[str, Any]],
        *,
        buffers: Buffer | Sequence[Buffer] | None = None,
        workers: int | None = None,
        **options: Any,
    ) -> Iterator[Render]: ...
    def cast(self, origins: ArrayLike, directions: ArrayLike, *, time: float | None = None) -> Hits: ...
    def visible(
        self, points: ArrayLike, *, light: str | int, normals: ArrayLike | None = None, time: float | None = None
    ) -> NDArray[np.float32]: ...
    def add(self, thing: Any, **fields: Unpack[_MeshFields]) -> Handle | list[Handle]: ...
    def remove(
        self,
        thing: str | Handle,
        *,
        family: Literal["shape", "light", "camera", "material", "texture"] | None = None,
    ) -> None: ...
    def clear(self) -> None: ...
    def add_mesh(
        self,
        vertices: ArrayLike | Any,
        faces: ArrayLike | None = None,
        *,
        normals: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        static: bool = False,
        **fields: Unpack[_MeshFields],
    ) -> Handle: ...
    def add_camera(self, camera: Camera | None = None, *, name: str = "", **fields: Any) -> Handle: ...
    def add_shadow_catcher_material(
        self,
        name: str,
        *,
        alpha: float = ...,
        single_sided: bool = ...,
    ) -> Handle: ...
    def add_checkerboard_texture(
        self,
        name: str,
        *,
        counts: Sequence[int] = ...,
        colors: Sequence[Any] = ...,
        uv_set: int | None = ...,
    ) -> Handle: ...
    def add_image_texture(
        self,
        name: str,
        *,
        file: str | os.PathLike[str] | Content | NDArray[Any] | Any,
        wrap: Sequence[Any] = ...,
        filter: Literal["nearest", "bilinear", "trilinear", "anisotropic"] = ...,
        color_space: Literal["srgb", "raw"] | None = ...,
        border: Color = ...,
        scale: Vector = ...,
        rotate_deg: float = ...,
        offset: Vector = ...,
        uv_set: int | None = ...,
    ) -> Handle: ...
    def add_uv_grid_texture(
        self,
        name: str,
        *,
        counts: Sequence[int] = ...,
        uv_set: int | None = ...,
    ) -> Handle: ...
    def add_phong_material(
        self,
        name: str,
        *,
        diffuse: ColorParam = ...,
        specular: ColorParam = ...,
        ambient: ColorParam | None = ...,
        shininess: NumberParam = ...,
        **fields: Unpack[_MaterialFields],
    ) -> Handle: ...
    def add_blinn_phong_material(
        self,
        name: str,
        *,
        diffuse: ColorParam = ...,
        specular: ColorParam = ...,
        ambient: ColorParam | None = ...,
        shininess: NumberParam = ...,
        **fields: Unpack[_MaterialFields],
    ) -> Handle: ...
    def add_metallic_roughness_material(
        self,
        name: str,
        *,
        base_color: ColorParam = ...,
        metallic: NumberParam = ...,
        roughness: NumberParam = ...,
        ior: float = ...,
        specular: NumberParam = ...,
        specular_color: ColorParam = ...,
        occlusion: NumberParam = ...,
        clearcoat: NumberParam = ...,
        clearcoat_roughness: NumberParam = ...,
        clearcoat_normal_map: str | None = ...,
        clearcoat_normal_scale: float = ...,
        **fields: Unpack[_MaterialFields],
    ) -> Handle: ...
    def add_unlit_material(
        self,
        name: str,
        *,
        color: ColorParam = ...,
        **fields: Unpack[_MaterialFields],
    ) -> Handle: ...
    def add_sphere(
        self,
        *,
        center: Vector,
        radius: float,
        uv: Literal["equirectangular", "angles"] = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_parallelogram(
        self,
        *,
        p: Vector,
        e0: Vector,
        e1: Vector,
        flip: bool = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_plane(
        self,
        *,
        point: Vector = ...,
        normal: Vector = ...,
        up: Vector | None = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_disk(
        self,
        *,
        center: Vector,
        normal: Vector = ...,
        radius: float,
        inner_radius: float = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_rectangle(
        self,
        *,
        center: Vector,
        size: Vector,
        normal: Vector = ...,
        up: Vector | None = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_box(
        self,
        *,
        center: Vector,
        size: Vector = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_cylinder(
        self,
        *,
        p0: Vector,
        p1: Vector,
        radius: float,
        capped: bool = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_cone(
        self,
        *,
        p0: Vector,
        p1: Vector,
        radius0: float,
        radius1: float = ...,
        capped: bool = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_torus(
        self,
        *,
        center: Vector,
        axis: Vector = ...,
        major_radius: float,
        minor_radius: float,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_point_set(
        self,
        *,
        file: str | os.PathLike[str] | Content | None = ...,
        positions: Sequence[Any] = ...,
        radii: Vector = ...,
        colors: Sequence[Any] = ...,
        radius: float | None = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_instance(
        self,
        *,
        of: str,
        **fields: Unpack[_ShapeFields],
    ) -> Handle: ...
    def add_model(
        self,
        file: str | os.PathLike[str] | Content | Any,
        *,
        studio: Studio | None = None,
        ground: bool | None = None,
        view: View | None = None,
        margin: float | None = None,
        background: Color | None = None,
        transparent: bool | None = None,
        up: Literal["y", "z"] | None = ...,
        materials: Mapping[str, str] = ...,
        variant: str | None = ...,
        scene: int | None = ...,
        animation: str | None = ...,
        time: float | None = ...,
        lights: bool = ...,
        cameras: bool = ...,
        smooth_deg: float | None = ...,
        unlit: bool = ...,
        **fields: Unpack[_ShapeFields],
    ) -> Handle | list[Handle]: ...
    def add_point_light(
        self,
        *,
        name: str | None = ...,
        group: str | None = ...,
        position: Vector,
        transform: Transform = ...,
        color: Color = ...,
        strength: float = ...,
        falloff: Literal["physical", "constant"] = ...,
        shadows: bool = ...,
    ) -> Handle: ...
    def add_directional_light(
        self,
        *,
        name: str | None = ...,
        group: str | None = ...,
        direction: Vector,
        transform: Transform = ...,
        color: Color = ...,
        strength: float = ...,
        falloff: Literal["physical", "constant"] = ...,
        shadows: bool = ...,
    ) -> Handle: ...
    def add_spot_light(
        self,
        *,
        name: str | None = ...,
        group: str | None = ...,
        position: Vector,
        look_at: Vector = ...,
        transform: Transform = ...,
        cone_deg: float = ...,
        inner_cone_deg: float | None = ...,
        color: Color = ...,
        strength: float = ...,
        falloff: Literal["physical", "constant"] = ...,
        shadows: bool = ...,
    ) -> Handle: ...
    def add_rectangle_light(
        self,
        *,
        name: str | None = ...,
        group: str | None = ...,
        center: Vector,
        e0: Vector | None = ...,
        e1: Vector | None = ...,
        size: Vector | None = ...,
        look_at: Vector | None = ...,
        normal: Vector | None = ...,
        up: Vector | None = ...,
        transform: Transform = ...,
        color: Color = ...,
        strength: float = ...,
        falloff: Literal["physical", "constant"] = ...,
        sides: Literal["front", "both"] | None = ...,
        visible: bool = ...,
        blocks: bool = ...,
        shadows: bool = ...,
        samples: Literal["exact"] | int | None = ...,
        set: Literal["sobol", "grid", "stratified", "uniform"] = ...,
        seed: int = ...,
    ) -> Handle: ...
    def add_disk_light(
        self,
        *,
        name: str | None = ...,
        group: str | None = ...,
        center: Vector,
        normal: Vector | None = ...,
        look_at: Vector | None = ...,
        radius: float | None = ...,
        size: float | None = ...,
        transform: Transform = ...,
        color: Color = ...,
        strength: float = ...,
        falloff: Literal["physical", "constant"] = ...,
        sides: Literal["front", "both"] | None = ...,
        visible: bool = ...,
        blocks: bool = ...,
        shadows: bool = ...,
        samples: Literal["exact"] | int | None = ...,
        set: Literal["sobol", "grid", "stratified", "uniform"] = ...,
        seed: int = ...,
    ) -> Handle: ...
    def add_sphere_light(
        self,
        *,
        name: str | None = ...,
        group: str | None = ...,
        center: Vector,
        radius: float,
        transform: Transform = ...,
        color: Color = ...,
        strength: float = ...,
        falloff: Literal["physical", "constant"] = ...,
        sides: Literal["front", "both"] | None = ...,
        visible: bool = ...,
        blocks: bool = ...,
        shadows: bool = ...,
        samples: Literal["exact"] | int | None = ...,
        set: Literal["sobol", "grid", "stratified", "uniform"] = ...,
        seed: int = ...,
    ) -> Handle: ...

def builtin(name: str) -> Scene: ...

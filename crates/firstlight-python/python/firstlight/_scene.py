"""Scenes: what is thin enough to be said in Python."""

import json
import os
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from threading import Event

import numpy as np

from . import _fields, _models
from ._firstlight import LIGHTS, MATERIALS, SHAPES, TEXTURES, SceneBase

# Fields of a mesh that belong to its triangles; all others belong to the thing that is placed
_OF_TRIANGLES = ("smooth_deg", "uv_set")


@dataclass(frozen=True)
class Hits:
    """What rays meet, an array of n for each: see the stubs for shapes and types."""

    hit: np.ndarray
    distance: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    normal_geometric: np.ndarray
    uv: np.ndarray
    barycentric: np.ndarray
    object_id: np.ndarray
    material_id: np.ndarray
    primitive_id: np.ndarray


class Handle:
    """A thing of a scene: a shape, a light, a camera, a material or a texture.

    `handle["field"]` reads a field as the scene's text says it, or its default; `handle["field"] = value` and
    `handle.update(...)` change it. `handle.transform` is the matrix that places it.
    """

    __slots__ = ("_family", "_number", "_scene")

    def __init__(self, scene, family, number):
        self._scene = scene
        self._family = family
        self._number = number

    @property
    def kind(self):
        """What it is: "sphere", "point", "phong", ..."""
        return self._scene._item(self._family, self._number)[1]

    @property
    def name(self):
        """What the scene calls it, if it has a name."""
        return self._scene._item(self._family, self._number)[2]

    @property
    def fields(self):
        """The fields that differ from their defaults, as a dict."""
        return json.loads(self._scene._item(self._family, self._number)[3])

    def __getitem__(self, field):
        fields = self.fields
        return fields[field] if field in fields else _fields.default(self._family, self.kind, field)

    def __setitem__(self, field, value):
        self.update(**{field: value})

    def update(self, **fields):
        """Changes fields. One that is None goes back to its default."""
        self._scene._update(self._family, self._number, fields)

    @property
    def transform(self):
        """The matrix from its own space to the world: (4, 4), float64, metres. At 0 s where it has keys."""
        rows = np.array(self._scene._transform(self._family, self._number, 0.0)).reshape(3, 4)
        return np.vstack([rows, [0.0, 0.0, 0.0, 1.0]])

    @transform.setter
    def transform(self, value):
        self.update(transform=value)

    def __repr__(self):
        if not self._scene._has(self._family, self._number):
            return f"<firstlight.Handle of a {self._family} that was removed>"
        fields = {key: value for key, value in self.fields.items() if key != "name"}
        words = [f"{key}={_short(value)}" for key, value in fields.items()]
        return f"<firstlight.Handle {self.kind} {self.name!r}: {', '.join(words) or 'all fields at their defaults'}>"


def _short(value):
    """A value as text, without what is in the middle of a long one."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:40]} ... {text[-15:]}"


class Scene(SceneBase):
    """A scene, empty at first.

    `scene[name]` is a `Handle` of what has that name, `del scene[name]` removes it, `scene.clear()` removes all.
    """

    @classmethod
    def from_file(cls, path, *, allow_dirs=()):
        """Reads a scene from a TOML or JSON file. It reads files of its own folder and of `allow_dirs`."""
        scene = cls()
        scene._load_file(os.fspath(path), [os.fspath(folder) for folder in allow_dirs])
        return scene

    @classmethod
    def from_text(cls, text, *, name="scene.toml", assets=None):
        """Reads a scene from a text. `assets` are its files: a folder, or a dict of names and bytes."""
        scene = cls()
        scene._load_text(text, name, *_assets(assets))
        return scene

    @classmethod
    def from_dict(cls, tree, *, assets=None):
        """Reads a scene from the tree that a scene in JSON is; numpy's numbers and arrays may be in it."""
        scene = cls()
        scene._load_tree(tree, *_assets(assets))
        return scene

    @classmethod
    def from_model(
        cls,
        model,
        *,
        studio="soft",
        ground=None,
        view=None,
        margin=None,
        up=None,
        smooth_deg=None,
        variant=None,
        scene=None,
        animation=None,
        name=None,
        assets=None,
        allow_dirs=(),
        width=None,
        height=None,
        background=None,
        transparent=None,
        **settings,
    ):
        """Shows a model by itself, as `firstlight render chair.glb` does: in a studio, with a camera that sees it all.

        Its renders have the bits of the program's with the same options. They are 1024 pixels square unless said, and
        rendered with `aa_mode="multisample"`.

        Parameters
        ----------
        model : path, bytes or open file, or a mesh or scene of trimesh or Open3D
            A `.glb`, `.gltf`, `.obj`, `.ply` or `.stl` file. Files that it names are read from its folder and from
            `allow_dirs`. Of meshes of other packages that is taken which `add` takes.
        studio : {"soft", "hard", "flat", "clay", "none"}
            What lights it: three area lights, two directional ones, nothing (materials show their colour), as "soft"
            with everything a light warm gray, or the lights of the file alone.
        ground : bool, optional
            Whether it stands on a ground that takes its shadow; in "soft" and "clay" unless said.
        view : str or (float, float), optional
            Where the camera looks from: "front", "back", "left", "right", "top", "bottom", "iso" or "three-quarter",
            which it is unless said; or azimuth and elevation in degrees.
        margin : float, optional
            What is left free on each side, as a part of the picture's shorter side, 0 to 0.45; 0.04 unless said.
        up : {"y", "z"}, optional
            The axis that points upwards in it: y unless said, and z of `.stl` files.
        smooth_deg : float, optional
            Normals are made smooth across edges of up to this angle; not of glTF files.
        variant, scene, animation : str, int, str or int, optional
            The variant, scene and animation of a glTF file. Without an animation it is at rest, and `render(time=...)`
            plays the first one; `render(camera=NAME)` looks through a camera of the file.
        name : str, optional
            What bytes are called, in messages and where names are made of it; its ending says of which kind they are
            where they do not say it themselves.
        assets : path or dict of str and bytes, optional
            The folder, or names and bytes, of the files that bytes name.
        allow_dirs : list of path
            Further folders whose files it may read.
        width, height, background, transparent
            The picture's; of width and height one alone is both.
        **settings
            Further settings of the picture, as `scene.settings` has them: antialiasing, tolerance, exposure, ...

        Returns
        -------
        Scene
        """
        words = {"studio": studio, "ground": ground, "up": up, "smooth_deg": smooth_deg}
        of_gltf = {"variant": variant, "scene": scene, "animation": animation}
        made, content = cls(), _models.content_of(model)
        if content is not None:
            name, (folder, files) = name or content[1] or "model", _assets(assets)
            files = {**(files or {}), name: content[0]}
            made._load_model(None, name, {**words, **of_gltf}, folder, files, [], view, margin)
        elif isinstance(model, (str, os.PathLike)):
            folders = [os.fspath(folder) for folder in allow_dirs]
            made._load_model(os.fspath(model), "", {**words, **of_gltf}, None, None, folders, view, margin)
        else:
            for word, value in of_gltf.items():
                if value is not None:
                    raise TypeError(f"{word} is for glTF files, and this is a {type(model).__name__}")
            made._add_in_studio(model, words, view, margin, {} if name is None else {"name": name})
        if (width is None) != (height is None):
            width = height = height if width is None else width
        given = {"width": width, "height": height, "background": background, "transparent": transparent, **settings}
        made.settings.update(**{key: value for key, value in given.items() if value is not None})
        return made

    def use_studio(self, studio="soft", *, ground=None, view=None, margin=None):
        """Lights the scene by a studio, beside its own lights: see `from_model`.

        `ambient`, `background`, `display` and `tolerance` of `settings` become those of the studio. Its lights are
        around all shapes, and are turned with the camera.

        Parameters
        ----------
        studio : {"soft", "hard", "flat", "clay", "none"}
        ground : bool, optional
            Whether there is a ground below all shapes that takes their shadows; in "soft" and "clay" unless said.
        view, margin : optional
            Of the camera that is found for a scene without one, as `render` takes them.
        """
        self._use_studio({"studio": studio, "ground": ground}, view, margin)

    def _add_in_studio(self, thing, words, view, margin, fields):
        """Adds meshes of another package to a scene that is shown in a studio."""
        studio, up, smooth_deg = words["studio"], words["up"], words["smooth_deg"]
        shown = self._use_studio({"studio": studio, "ground": words["ground"]}, view, margin)
        if up not in (None, "y", "z"):
            raise ValueError(f"up is {up!r}; it is one of y, z")
        if up == "z":
            turned = [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]
            own = fields.get("transform")
            fields = {**fields, "transform": turned if own is None else np.asarray(own, dtype=np.float64) @ turned}
        if smooth_deg is not None:
            fields = {**fields, "smooth_deg": smooth_deg}
        own = {"unlit": shown["unlit"], "_material": shown["material"]}
        return self._add_thing(thing, {**fields, **{key: value for key, value in own.items() if value}})

    def __getitem__(self, name):
        return Handle(self, *self._find(name))

    def __delitem__(self, name):
        self.remove(name)

    def __contains__(self, name):
        return name in self._names()

    def __iter__(self):
        return iter(self._names())

    @property
    def settings(self):
        """The picture, `[render]` of a scene: width, height, antialiasing, ambient, background, ..."""
        return Handle(self, "render", 0)

    def add_mesh(self, vertices, faces=None, *, normals=None, uv=None, colors=None, static=False, **fields):
        """Adds a triangle mesh from arrays, of which it keeps one copy; or a mesh of trimesh or Open3D, as `add` does.

        Parameters
        ----------
        vertices : array of shape (n, 3), or a mesh of another package
            Places in metres; of any float or integer type, in any order in memory.
        faces : array of shape (m, 3)
            The three vertices of each triangle, counted from 0, of any integer type; only of arrays.
        normals : array of shape (n, 3), optional
            A normal for each vertex.
        uv : array of shape (n, 2) or (sets, n, 2), optional
            A texture coordinate for each vertex, in one set or in several: `uv=[uv0, uv1]`. Textures with `uv_set` are
            laid by the set of that number, all others by the `uv_set` of the mesh, which is 0 unless said.
        colors : array of shape (n, 3) or (n, 4), optional
            A colour for each vertex: linear floats, or uint8, 0 to 255 in sRGB. Alpha is not looked at.
        static : bool
            Whether it is joined with other static meshes in one tree, which is built again when one of them moves.
        **fields
            `transform` (a matrix of 4 x 4, or a table), `material`, `name`, and all else of the list below.

        Returns
        -------
        Handle
        """
        if faces is None:
            given = {"normals": normals, "uv": uv, "colors": colors, "static": static or None}
            return self.add(vertices, **{key: value for key, value in given.items() if value is not None}, **fields)
        if colors is not None:
            colors = np.asarray(colors)
            if colors.dtype.kind == "f" and colors.ndim == 2 and colors.size and (most := colors[:, :3].max()) > 1:
                _models.warn(f"colors: up to {most:g}, where 1 reflects all light; are they 0 to 255? then give uint8")
        own = {key: fields.pop(key) for key in _OF_TRIANGLES if key in fields}
        place = self._add_mesh(
            vertices, faces, normals=normals, uv=uv, colors=colors, own=own, fields=fields, static=static
        )
        return Handle(self, *place)

    def add_camera(self, camera=None, *, name="", **fields):
        """Adds a camera: a `Camera`, or the fields of one. The first of a scene is the one that is used.

        Parameters
        ----------
        camera : Camera, optional
            One that is there; its size becomes that of the scene's picture.
        name : str
            What the scene calls it.
        **fields
            Those of the list below.

        Returns
        -------
        Handle
        """
        if camera is not None:
            width, height = camera.width, camera.height
            fields = {**camera.to_dict(), **fields}
            if width is not None and height is not None:
                self.settings.update(width=width, height=height)
        return Handle(self, *self._add("camera", "camera", name, fields))

    def add(self, thing, **fields):
        """Adds a mesh or a scene of trimesh, or a mesh or a model of Open3D, with the fields that `add_mesh` takes.

        Taken are triangles, texture coordinates, colours of vertices and of faces, and materials with their textures.
        What is not taken is told in one `SceneWarning` for each mesh, with its name.

        `normals` and `smooth_deg` decide how smooth a mesh is. Where neither is given, a mesh of Open3D has its own
        normals, and is flat without. A mesh of trimesh is flat where all faces around each vertex lie in one plane, as
        where each has vertices of its own, and else smooth across edges of up to 30 degrees: its `vertex_normals`,
        which trimesh computes when they are looked at, are taken only if they are given as `normals`.

        Parameters
        ----------
        thing : trimesh.Trimesh or trimesh.Scene, or of Open3D a mesh, a mesh of tensors, or a model
            A model is what `open3d.io.read_triangle_model` gives, or a dict of the same: `meshes`, each with `mesh`,
            `mesh_name` and `material_idx`, and `materials`; or a dict of one `geometry` and its `material`.
        **fields
            What `add_mesh` takes. `name` and `transform` of a scene go before those of its nodes: `room/chair`.

        Returns
        -------
        Handle, or a list of them for a scene or a model
        """
        return self._add_thing(thing, fields)

    def _add_thing(self, thing, fields):
        """The same, with a dict of fields."""
        graph = getattr(thing, "graph", None)
        if graph is not None and hasattr(graph, "nodes_geometry"):
            return _models.add_graph(self, thing, fields)
        parts = _models.parts_of(thing)
        if parts is not None:
            return _models.add_parts(self, parts, fields)
        model = _models.of(thing)
        if model is None:
            raise TypeError(f"a {type(thing).__name__} has neither vertices and faces nor vertices and triangles")
        return model.add(self, fields.get("name"), fields)[0]

    def remove(self, thing, *, family=None):
        """Removes a thing: a shape, a light, a camera, a material or a texture.

        Handles of other things stay theirs. What names a material or a texture that was removed is told by the next
        render, unless another one of that name was added.

        Parameters
        ----------
        thing : str or Handle
            Its name, or what `scene[name]` and the methods that add give.
        family : {"shape", "light", "camera", "material", "texture"}, optional
            Of which family it is. Without it, it is the first of that name, in this order, as in `scene[name]`.
        """
        if isinstance(thing, Handle):
            place = thing._family, thing._number
        else:
            place = self._find(thing, family)
        self._remove(*place)

    def render_many(self, cameras, *, buffers=None, workers=None, **options):
        """Renders the scene from many cameras, on all processors, and yields each `Render` in order.

        At most twice as many pictures as there are workers are in memory; `cameras` may be endless.

        Parameters
        ----------
        cameras : iterable of Camera, str or dict
        buffers : str or list of str, optional
        workers : int, optional
            Pictures that are rendered at once, each on one thread; as many as there are processors unless said.
        **options
            All else that `render` takes.
        """
        workers = workers or os.cpu_count() or 1
        stop = Event()

        def still_wanted(done, total):
            if stop.is_set():
                raise RuntimeError("nobody waits for this picture any more")

        def one(camera):
            still_wanted(0, 0)
            return self.render(camera=camera, buffers=buffers, threads=1, progress=still_wanted, **options)

        process, pool, pending = None, None, deque()

        def threads():
            """Those of this process: others after a fork, which copies none of them into the child."""
            nonlocal process, pool
            if process != os.getpid():
                process, pool = os.getpid(), ThreadPoolExecutor(workers, thread_name_prefix="firstlight")
                for k, (camera, _) in enumerate(pending):
                    pending[k] = camera, pool.submit(one, camera)
            return pool

        try:
            for camera in cameras:
                pending.append((camera, threads().submit(one, camera)))
                if len(pending) > workers:
                    yield pending.popleft()[1].result()
            while threads() and pending:
                yield pending.popleft()[1].result()
        finally:
            stop.set()
            if process == os.getpid():
                pool.shutdown(wait=True, cancel_futures=True)

    def cast(self, origins, directions, *, time=None):
        """What each of many rays meets first, on all processors.

        Parameters
        ----------
        origins, directions : arrays of shape (..., 3), or (3,) for all
            In metres, world space; directions of any length.

        Returns
        -------
        Hits
            Arrays with the shape of the rays.
        """
        origins, directions = np.broadcast_arrays(
            np.asarray(origins, dtype=np.float64), np.asarray(directions, dtype=np.float64)
        )
        shape = origins.shape[:-1]
        flat = self._cast(origins.reshape(-1, 3), directions.reshape(-1, 3), time)
        return Hits(**{key: array.reshape(shape + array.shape[1:]) for key, array in flat.items()})

    def visible(self, points, *, light, normals=None, time=None):
        """The share of a light that each point sees: 1 where it is lit, 0 in the umbra, between in the penumbra.

        Parameters
        ----------
        points : array of shape (..., 3)
            In metres, world space.
        light : str or int
            The light's name, or which it is in the scene's order, from 1 on: 1 is that of the buffer `light:#1`.
        normals : array of shape (..., 3), optional
            The unit normal at points on surfaces: what is below their horizon is not seen.

        Returns
        -------
        array of shape (...), float32
        """
        points = np.asarray(points, dtype=np.float64)
        if normals is not None:
            normals = np.broadcast_to(np.asarray(normals, dtype=np.float64), points.shape).reshape(-1, 3)
        return self._visible(points.reshape(-1, 3), light, normals, time).reshape(points.shape[:-1])

    def __reduce__(self):
        return _restored, (type(self), *self._state())

    def __repr__(self):
        width, height = self.size
        counts = [f"{count} {family}{'s' * (count != 1)}" for family, count in self._counts() if count > 0]
        return f"<firstlight.Scene {width} x {height}: {', '.join(counts) or 'empty'}>"


def _restored(cls, text, files, meshes, shown):
    scene = cls()
    scene._restore(text, files, meshes, shown)
    return scene


def _assets(assets):
    """A folder, or names and bytes."""
    if assets is None:
        return None, None
    if isinstance(assets, (str, os.PathLike)):
        return os.fspath(assets), None
    return None, {name: bytes(content) for name, content in assets.items()}


def builtin(name):
    """The scene of that name that is built in, one of `firstlight.BUILTIN`."""
    scene = Scene()
    scene._load_builtin(name)
    return scene


def _add_model(
    self,
    file,
    *,
    studio=None,
    ground=None,
    view=None,
    margin=None,
    background=None,
    transparent=None,
    **fields,
):
    """Adds a model: all that a glTF, OBJ, PLY or STL file shows, or a mesh or scene of trimesh or Open3D.

    A scene without a camera is given one that sees all of it; `view` and `margin` say how. Without a light it is
    as dark as its `ambient` is; with `studio` a studio lights all of it, as `use_studio` does.

    Parameters
    ----------
    file : path, bytes or open file, or a mesh or scene of trimesh or Open3D
        In the scene's folder or below it; of a scene without a folder, from the working folder. Of meshes of other
        packages that is taken which `add` takes.
    studio : {"soft", "hard", "flat", "clay", "none"}, optional
        What lights the scene, beside its own lights.
    ground : bool, optional
        Whether there is a ground that takes shadows, in a studio.
    view, margin : optional
        Of the camera that is found, as `render` takes them.
    background, transparent : optional
        Those of `settings`.
    **fields
        Those of the list below.

    Returns
    -------
    Handle, or a list of them for a scene of trimesh and a model of Open3D
    """
    words = {} if studio is None else {"studio": studio, "ground": ground}
    if studio is None and ground is not None:
        raise ValueError("ground is for studios: name one, as studio='soft'")
    shown = self._fields_in(words)
    content = _models.content_of(file)
    if content is not None:
        path = self._give_file(content[0], sha256(content[0]).hexdigest(), f"/{content[1] or 'model'}")
    elif isinstance(file, (str, os.PathLike)):
        path = self._find_model(os.path.normpath(os.fspath(file)).replace(os.sep, "/"))
    else:
        path, own = None, {"unlit": shown["unlit"], "_material": shown["material"]}
        of_mesh = {**{key: value for key, value in own.items() if value}, **fields}
        if of_mesh.get("material") is not None:
            of_mesh.pop("_material", None)
        added = self._add_thing(file, of_mesh)
    if path is not None:
        fields = {**{key: value for key, value in shown.items() if value}, **fields}
        added = Handle(self, *self._add("shape", "model", "", {"file": path, **fields}))
    try:
        self._use_studio(words, view, margin)
        given = {"background": background, "transparent": transparent}
        self.settings.update(**{key: value for key, value in given.items() if value is not None})
    except BaseException:
        _models.remove_all(self, added if isinstance(added, list) else [added])
        raise
    return added


def _add_methods():
    """One method for each kind of thing that a scene may hold; what it takes are the fields of that kind's table."""
    families = [("shape", SHAPES, ""), ("light", LIGHTS, "_light")]
    families += [("material", MATERIALS, "_material"), ("texture", TEXTURES, "_texture")]
    tables = _fields.TABLES
    for family, kinds, ending in families:
        for kind in kinds:
            name = f"add_{kind.replace('-', '_')}{ending}"
            if name not in ("add_mesh", "add_model"):
                setattr(Scene, name, _fields.method(name, family, kind, tables[family, kind], Handle))
    own = set(tables["shape", "mesh"]["properties"]) - set(_OF_TRIANGLES)
    _fields.add_to_doc(Scene.add_mesh, (tables["shape", "instance"], {"of"}), (tables["shape", "mesh"], own))
    setattr(Scene, "add_model", _fields.extended(_add_model, "add_model", tables["shape", "model"]))
    _fields.add_to_doc(Scene.add_camera, (tables["camera", "camera"], ()))


_add_methods()

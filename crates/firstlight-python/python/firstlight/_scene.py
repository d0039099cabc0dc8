"""Scenes: what is thin enough to be said in Python."""

import json
import os
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event

import numpy as np

from . import _firstlight
from ._firstlight import LIGHTS, MATERIALS, SHAPES, TEXTURES, SceneBase

# Fields of a mesh that belong to its triangles; all others belong to the thing that is placed
_OF_TRIANGLES = ("smooth_deg",)


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

    `handle["field"]` reads a field as the scene's text says it, `handle["field"] = value` and `handle.update(...)`
    change it. `handle.transform` is the matrix that places it.
    """

    __slots__ = ("_family", "_index", "_scene")

    def __init__(self, scene, family, index):
        self._scene = scene
        self._family = family
        self._index = index

    @property
    def kind(self):
        """What it is: "sphere", "point", "phong", ..."""
        return self._scene._item(self._family, self._index)[1]

    @property
    def name(self):
        """What the scene calls it, if it has a name."""
        return self._scene._item(self._family, self._index)[2]

    @property
    def fields(self):
        """The fields that differ from their defaults, as a dict."""
        return json.loads(self._scene._item(self._family, self._index)[3])

    def __getitem__(self, field):
        return self.fields[field]

    def __setitem__(self, field, value):
        self.update(**{field: value})

    def update(self, **fields):
        """Changes fields. One that is None goes back to its default."""
        self._scene._update(self._family, self._index, fields)

    @property
    def transform(self):
        """The matrix from its own space to the world: (4, 4), float64, metres. At 0 s where it has keys."""
        rows = np.array(self._scene._transform(self._family, self._index, 0.0)).reshape(3, 4)
        return np.vstack([rows, [0.0, 0.0, 0.0, 1.0]])

    @transform.setter
    def transform(self, value):
        self.update(transform=value)

    def __repr__(self):
        return f"<firstlight.Handle {self.kind} {self.name!r}>"


class Scene(SceneBase):
    """A scene, empty at first."""

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

    def __getitem__(self, name):
        return Handle(self, *self._find(name))

    def __contains__(self, name):
        return name in self._names()

    def __iter__(self):
        return iter(self._names())

    @property
    def settings(self):
        """The picture, `[render]` of a scene: width, height, antialiasing, ambient, background, ..."""
        return Handle(self, "render", 0)

    def add_mesh(self, vertices, faces, *, normals=None, uv=None, colors=None, static=False, **fields):
        """Adds a triangle mesh from arrays, of which it keeps one copy.

        Parameters
        ----------
        vertices : array of shape (n, 3)
            Places in metres; of any float or integer type, in any order in memory.
        faces : array of shape (m, 3)
            The three vertices of each triangle, counted from 0, of any integer type.
        normals : array of shape (n, 3), optional
            A normal for each vertex.
        uv : array of shape (n, 2), optional
            A texture coordinate for each vertex.
        colors : array of shape (n, 3) or (n, 4), optional
            A colour for each vertex: linear floats, or bytes, which are sRGB. Alpha is not looked at.
        static : bool
            Whether it is joined with other static meshes in one tree, which is built again when one of them moves.
        **fields
            `transform` (a matrix of 4 x 4, or a table), `material`, `name`, `smooth_deg`, `visible`, `casts_shadow`,
            and all else that a shape takes.
        """
        own = {key: fields.pop(key) for key in _OF_TRIANGLES if key in fields}
        place = self._add_mesh(
            vertices, faces, normals=normals, uv=uv, colors=colors, own=own, fields=fields, static=static
        )
        return Handle(self, *place)

    def add_camera(self, camera=None, *, name="", **fields):
        """Adds a camera: a `Camera`, or the fields of one. The first of a scene is the one that is used."""
        if camera is not None:
            width, height = camera.width, camera.height
            fields = {**camera.to_dict(), **fields}
            if width is not None and height is not None:
                self.settings.update(width=width, height=height)
        return Handle(self, *self._add("camera", "camera", name, fields))

    def add(self, thing, **fields):
        """Adds a mesh or a scene of trimesh, or a mesh of Open3D, with the fields that `add_mesh` takes.

        Returns
        -------
        Handle, or a list of them for a scene
        """
        graph = getattr(thing, "graph", None)
        if graph is not None and hasattr(graph, "nodes_geometry"):
            return [self._add_node(thing, node, fields) for node in graph.nodes_geometry]
        if hasattr(thing, "faces") and hasattr(thing, "vertices"):
            return self.add_mesh(thing.vertices, thing.faces, **{**_of_trimesh(thing), **fields})
        # A mesh of tensors
        if hasattr(thing, "to_legacy"):
            thing = thing.to_legacy()
        if hasattr(thing, "triangles") and hasattr(thing, "vertices"):
            arrays = np.asarray(thing.vertices), np.asarray(thing.triangles)
            return self.add_mesh(*arrays, **{**_of_open3d(thing), **fields})
        raise TypeError(f"a {type(thing).__name__} has neither vertices and faces nor vertices and triangles")

    def _add_node(self, scene, node, fields):
        matrix, geometry = scene.graph[node]
        outer = fields.get("transform")
        if outer is not None:
            matrix = np.asarray(outer, dtype=np.float64) @ matrix
        return self.add(scene.geometry[geometry], **{"name": str(node), **fields, "transform": matrix})

    def render_many(self, cameras, *, buffers=None, workers=None, **options):
        """Renders the scene from many cameras, on all processors, and yields each `Render` in order.

        At most twice as many pictures as there are workers are in memory; `cameras` may be endless.

        Parameters
        ----------
        cameras : iterable of Camera, str or dict
        buffers : list of str, optional
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

        pool = ThreadPoolExecutor(workers, thread_name_prefix="firstlight")
        pending = deque()
        try:
            for camera in cameras:
                pending.append(pool.submit(one, camera))
                if len(pending) > workers:
                    yield pending.popleft().result()
            while pending:
                yield pending.popleft().result()
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)

    def cast(self, origins, directions, *, time=0.0):
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

    def visible(self, points, *, light, normals=None, time=0.0):
        """The share of a light that each point sees: 1 where it is lit, 0 in the umbra, between in the penumbra.

        Parameters
        ----------
        points : array of shape (..., 3)
            In metres, world space.
        light : str or int
            The light's name, or which it is in the scene's order.
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
        return f"<firstlight.Scene {width} x {height}>"


def _restored(cls, text, files, meshes):
    scene = cls()
    scene._restore(text, files, meshes)
    return scene


def _assets(assets):
    """A folder, or names and bytes."""
    if assets is None:
        return None, None
    if isinstance(assets, (str, os.PathLike)):
        return os.fspath(assets), None
    return None, {name: bytes(content) for name, content in assets.items()}


def _of_trimesh(mesh):
    """What a mesh of trimesh has beside its triangles."""
    found = {}
    visual = getattr(mesh, "visual", None)
    kind = getattr(visual, "kind", None)
    if kind == "vertex":
        found["colors"] = np.asarray(visual.vertex_colors)
    elif kind == "texture" and getattr(visual, "uv", None) is not None:
        found["uv"] = np.asarray(visual.uv)
    # Those that were given: trimesh would compute some where there are none
    cache = getattr(mesh, "_cache", None)
    if cache is not None and "vertex_normals" in cache:
        found["normals"] = np.asarray(mesh.vertex_normals)
    return found


def _of_open3d(mesh):
    """What a mesh of Open3D has beside its triangles."""
    found = {}
    if len(getattr(mesh, "vertex_normals", ())):
        found["normals"] = np.asarray(mesh.vertex_normals)
    if len(getattr(mesh, "vertex_colors", ())):
        found["colors"] = np.asarray(mesh.vertex_colors)
    return found


def builtin(name):
    """The scene of that name that is built in, one of `firstlight.BUILTIN`."""
    scene = Scene()
    scene._load_builtin(name)
    return scene


def _named(family, kind):
    """A method that adds things that are called by a key."""

    def add(self, name, **fields):
        return Handle(self, *self._add(family, kind, name, fields))

    return add


def _unnamed(family, kind):
    """A method that adds things whose name is a field."""

    def add(self, **fields):
        return Handle(self, *self._add(family, kind, "", fields))

    return add


def _add_methods():
    """One method for each kind of thing that a scene may hold; what it takes are the fields of that kind's table."""
    families = [("shape", SHAPES, "", _unnamed), ("light", LIGHTS, "_light", _unnamed)]
    families += [("material", MATERIALS, "_material", _named), ("texture", TEXTURES, "_texture", _named)]
    for family, kinds, ending, make in families:
        for kind in kinds:
            name = f"add_{kind.replace('-', '_')}{ending}"
            if name == "add_mesh":
                continue
            method = make(family, kind)
            method.__name__, method.__qualname__ = name, f"Scene.{name}"
            table = {"shape": f"[[{kind}]]", "light": f"[[light.{kind}]]"}.get(family, f"[{family}.{kind}.NAME]")
            method.__doc__ = f"Adds a {family}: the keyword arguments are the fields of `{table}` in a scene's text."
            setattr(Scene, name, method)


_add_methods()

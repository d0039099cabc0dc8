"""Direct light, without noise, with the same bits on every machine.

A scene is read (`Scene.from_file`, `Scene.from_text`, `Scene.from_dict`, `builtin`), shows a model by itself
(`Scene.from_model`), or is built (`Scene()`, `add_mesh`, `add_sphere`, `add_rectangle_light`, ...), and is rendered to
numpy arrays (`Scene.render`, `Scene.render_many`). Without a picture it says what rays meet (`Scene.cast`) and what
points see of a light (`Scene.visible`).

Lengths are in metres, angles in degrees, colours linear Rec. 709. y is up, axes are right-handed, row 0 of an array is
the top of the picture.
"""

import os as _os
from collections.abc import Mapping as _Mapping

from . import _firstlight
from ._camera import Camera
from ._coco import Coco
from ._diagnostics import Diagnostic, Place
from ._firstlight import (
    BUFFERS,
    BUILTIN,
    LIGHTS,
    MATERIALS,
    SHAPES,
    TEXTURES,
    Render,
    SceneError,
    SceneWarning,
    __version__,
)
from ._scene import Handle, Hits, Scene, builtin

_Mapping.register(Render)
# So that a child that is forked while other threads are at work finds nothing locked
if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(
        before=_firstlight._before_fork,
        after_in_parent=_firstlight._after_fork_in_parent,
        after_in_child=_firstlight._after_fork_in_child,
    )

__all__ = [
    "BUFFERS",
    "BUILTIN",
    "LIGHTS",
    "MATERIALS",
    "SHAPES",
    "TEXTURES",
    "Camera",
    "Coco",
    "Diagnostic",
    "Handle",
    "Hits",
    "Place",
    "Render",
    "Scene",
    "SceneError",
    "SceneWarning",
    "__version__",
    "builtin",
]

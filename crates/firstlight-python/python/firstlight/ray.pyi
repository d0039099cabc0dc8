"""Renders on the machines of a Ray cluster."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from . import Buffer, Camera, Render, Scene

def render_many(
    scene: Scene,
    cameras: Iterable[Camera | str | Mapping[str, Any]],
    *,
    buffers: Buffer | Sequence[Buffer] | None = None,
    in_flight: int | None = None,
    retries: int = 3,
    **options: Any,
) -> Iterator[Render]: ...

"""Renders on the machines of a Ray cluster. Ray is needed by this module alone: `pip install ray`."""

from collections import deque


def render_many(scene, cameras, *, buffers=None, in_flight=None, retries=3, **options):
    """Renders a scene from many cameras on a Ray cluster, and yields each `Render` in order.

    The scene is shipped once, with the bytes of its files; each camera is one task on one processor. The results have
    the same bits as on one machine. Begin Ray yourself (`ray.init(...)`) to choose the cluster; otherwise a local one
    is begun.

    Parameters
    ----------
    scene : firstlight.Scene
        As it is now: later changes of it are not seen.
    cameras : iterable of Camera, str or dict
        May be endless.
    buffers : str or list of str, optional
        As `Scene.render` takes them.
    in_flight : int, optional
        Pictures that are under way or wait to be yielded; twice the processors of the cluster unless said.
    retries : int
        How often a task is tried again whose worker or machine was lost; -1 is without end.
    **options
        All else that `Scene.render` takes, but for `progress`.

    Yields
    ------
    Render
        What `Scene.render` gives.

    Raises
    ------
    firstlight.SceneError, ValueError
        What the render of a camera raises, in the words of one machine.
    ray.exceptions.RayError
        A task was lost more often than it was to be tried again.
    """
    import ray

    if not ray.is_initialized():
        ray.init()
    shared = ray.put(scene)
    if in_flight is None:
        in_flight = max(2, 2 * int(ray.cluster_resources().get("CPU", 1)))
    task = ray.remote(num_cpus=1, max_retries=retries)(_rendered)
    pending = deque()
    try:
        for camera in cameras:
            pending.append(task.remote(shared, camera, buffers, options))
            if len(pending) >= in_flight:
                yield _get(pending.popleft())
        while pending:
            yield _get(pending.popleft())
    finally:
        for reference in pending:
            ray.cancel(reference, force=False)


def _rendered(scene, camera, buffers, options):
    return scene.render(camera=camera, buffers=buffers, **{"threads": 1, **options})


def _get(reference):
    import ray

    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause if error.cause is not None else error

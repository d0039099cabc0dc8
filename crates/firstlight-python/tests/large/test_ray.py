"""A cluster of two workers, one of which is killed: the same bits as on one machine."""

import os
import signal
import sys

import pytest

import firstlight as fl
import firstlight.ray

ray = pytest.importorskip("ray")
# Workers do not import this file
ray.cloudpickle.register_pickle_by_value(sys.modules[__name__])


@pytest.fixture(scope="module", autouse=True)
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def cameras(count):
    return [fl.Camera(position=[0.1 * k, 1.0, 9.0], width=40, height=30) for k in range(count)]


def test_frames_are_those_of_one_machine():
    scene = fl.builtin("config11")
    buffers = ["color", "depth", "object-id"]
    found = list(firstlight.ray.render_many(scene, cameras(7), buffers=buffers, in_flight=3))
    for one, other in zip(found, scene.render_many(cameras(7), buffers=buffers), strict=True):
        assert all((one[name] == other[name]).all() for name in buffers)
        assert one.receipt == other.receipt


def test_a_killed_worker_costs_no_frame(tmp_path):
    scene = fl.builtin("config11")
    mark = tmp_path / "killed"

    class Deadly:
        """A camera that kills the worker that first takes it."""

        def _resolve(self, width, height):
            if not mark.exists():
                mark.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            return cameras(1)[0]._resolve(width, height)

    all_cameras = [*cameras(3), Deadly(), *cameras(3)]
    found = list(firstlight.ray.render_many(scene, all_cameras, buffers=["color"]))
    assert mark.exists() and len(found) == 7
    expected = scene.render(camera=cameras(1)[0], buffers=["color"])["color"]
    assert all((found[k]["color"] == expected).all() for k in (0, 3, 4))


def test_faults_keep_their_words():
    scene = fl.builtin("config11")
    with pytest.raises(fl.SceneError, match="no camera is called"):
        list(firstlight.ray.render_many(scene, ["nobody"]))

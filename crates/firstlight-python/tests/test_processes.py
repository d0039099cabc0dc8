"""Forked, spawned and threaded: every way works, and none waits for threads that are not there.

Each way is a program of its own, which is ended after a while, so that one that hangs is a failure.
"""

import subprocess
import sys

import pytest

# Of a whole program; a child that hangs is ended earlier
SECONDS = 240

PRELUDE = """
import concurrent.futures
import hashlib
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings

import numpy as np

import firstlight as fl

# Python's own, of processes that have threads
warnings.simplefilter("ignore", DeprecationWarning)
SIZE = {"width": 24, "height": 18, "aa": 2}


def grid(n):
    x, z = np.meshgrid(np.linspace(-5, 5, n), np.linspace(-5, 5, n))
    i = np.arange(n * (n - 1)).reshape(n - 1, n)[:, :-1].ravel()
    faces = np.concatenate([np.stack([i, i + n, i + 1], -1), np.stack([i + 1, i + n, i + n + 1], -1)])
    return np.stack([x.ravel(), 0.1 * np.sin(3 * x).ravel(), z.ravel()], -1), faces


def room(n=40):
    scene = fl.Scene()
    scene.add_camera(position=[0, 3, 8], look_at=[0, 1, 0])
    scene.add_sphere(center=[0, 1, 0], radius=1, name="ball")
    scene.add_mesh(*grid(n), name="floor", smooth_deg=30)
    scene.add_rectangle_light(center=[0, 5, 0], e0=[2, 0, 0], e1=[0, 0, 2], strength=20, name="lamp")
    scene.add_rectangle_light(center=[3, 5, 0], e0=[1, 0, 0], e1=[0, 0, 1], strength=9, name="grid", samples=64)
    return scene


def everything(scene):
    # All that runs on several threads, as a digest of what it gives
    digest = hashlib.sha256()
    buffers = ["color", "depth", "object-id", "crypto-object"]
    frame = scene.render(buffers=buffers, **SIZE)
    for array in [*frame.values(), frame.rgb8()]:
        digest.update(array.tobytes())
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a.png", "a.exr", "a.npz", "a.hdr"):
            frame.save(os.path.join(folder, name))
            with open(os.path.join(folder, name), "rb") as file:
                digest.update(file.read())
    hits = scene.cast([0, 5, 0], np.random.default_rng(1).normal(size=(2000, 3)))
    digest.update(hits.distance.tobytes())
    digest.update(scene.visible(hits.position, light="lamp").tobytes())
    coco = fl.Coco()
    coco.add(frame, "a.png")
    digest.update(coco.to_json().encode())
    other = room(50)
    other.remove("ball")
    digest.update(other.render(**SIZE)["color"].tobytes())
    digest.update(pickle.loads(pickle.dumps(scene)).hash.encode())
    return digest.hexdigest()


def child(work):
    # Starts a child that does some work
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            work()
            status = 0
        except BaseException as error:
            print("in the child:", repr(error), file=sys.stderr, flush=True)
        finally:
            os._exit(status)
    return pid


def wait(*pids, seconds=90):
    until = time.monotonic() + seconds
    for pid in pids:
        while (done := os.waitpid(pid, os.WNOHANG)) == (0, 0):
            if time.monotonic() > until:
                os.kill(pid, signal.SIGKILL)
                raise SystemExit("a child hangs")
            time.sleep(0.01)
        assert done[1] == 0, f"a child ended with {done[1]}"


class Busy:
    # A thread that does something again and again
    def __init__(self, work):
        self.work, self.stop, self.rounds = work, threading.Event(), 0
        self.thread = threading.Thread(target=self.run)

    def run(self):
        while not self.stop.is_set():
            self.work()
            self.rounds += 1

    def __enter__(self):
        self.thread.start()
        while self.rounds == 0:
            time.sleep(0.001)
        return self

    def __exit__(self, *_):
        self.stop.set()
        self.thread.join()


def check(scene, expected):
    found = everything(scene)
    assert found == expected, "other bits"


def forks_while(work, times=6):
    scene = room()
    expected = everything(scene)
    with Busy(lambda: work(scene)) as busy:
        for _ in range(times):
            before = busy.rounds
            wait(child(lambda: check(scene, expected)))
            while busy.rounds == before:
                time.sleep(0.001)


def saves(scene, kept=[]):
    if not kept:
        kept.append(scene.render(buffers=["color", "depth", "normal"], width=200, height=150, aa=1))
    with tempfile.TemporaryDirectory() as folder:
        kept[0].save(os.path.join(folder, "a.exr"))


def several(context, task, **how):
    scene = room()
    expected = everything(scene)
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context(context), **how) as pool:
        assert list(pool.map(task, [scene] * 3, timeout=200)) == [expected] * 3


def feed(scene, cameras, results):
    for k in iter(cameras.get, None):
        results.put((k, scene.render(camera={"position": [k, 3, 8]}, buffers=["color", "object-id"], **SIZE)))
"""

WAYS = {
    "a fork after work": """
scene = room()
expected = everything(scene)
wait(child(lambda: check(scene, expected)))
check(scene, expected)
""",
    "a fork before any work": """
scene = room()
expected = None
wait(child(lambda: everything(scene)))
everything(scene)
""",
    "a child of a child": """
scene = room()
expected = everything(scene)
def both():
    check(scene, expected)
    wait(child(lambda: check(scene, expected)))
    check(scene, expected)
wait(child(both))
""",
    "children at the same time": """
scene = room()
expected = everything(scene)
wait(*[child(lambda: check(scene, expected)) for _ in range(4)])
""",
    "a fork by a thread": """
scene = room()
expected = everything(scene)
with concurrent.futures.ThreadPoolExecutor(1) as pool:
    pool.submit(lambda: wait(child(lambda: check(scene, expected)))).result()
check(scene, expected)
""",
    "forks by several threads at once": """
scene = room()
expected = everything(scene)
with concurrent.futures.ThreadPoolExecutor(3) as pool:
    list(pool.map(lambda _: wait(child(lambda: check(scene, expected))), range(6)))
""",
    "forks while a thread renders": "forks_while(lambda scene: scene.render(width=60, height=45))",
    "forks while a thread compiles": """
lamps = iter(range(10**9))
def compiles(scene, other=room()):
    other["lamp"]["strength"] = next(lamps)
    other.hash
forks_while(compiles)
""",
    "forks while a thread changes the same scene": """
def moves(scene):
    scene["ball"]["center"] = [0, 1, 0]
    scene.bounds
forks_while(moves)
""",
    "forks while a thread builds meshes": "forks_while(lambda scene: room(150).bounds)",
    "forks while a thread saves": "forks_while(saves)",
    "forks while a thread casts rays": """
rays = np.random.default_rng(1).normal(size=(20000, 3))
forks_while(lambda scene: scene.cast([0, 5, 0], rays))
""",
    "forks while many cameras are rendered": """
cameras = [{"position": [k, 3, 8]} for k in range(4)]
forks_while(lambda scene: list(scene.render_many(cameras, **SIZE)))
""",
    "a fork within progress": """
scene = room()
expected = everything(scene)
pids = []
def fork(done, total):
    if not pids:
        pids.append(child(lambda: check(scene, expected)))
scene.render(progress=fork, width=60, height=45)
wait(*pids)
""",
    "a child that comes back from progress": """
scene = room()
expected = everything(scene)
pids = []
def fork(done, total):
    if not pids:
        pids.append(os.fork())
try:
    scene.render(progress=fork, width=200, height=150, aa=8)
except RuntimeError as error:
    assert pids == [0] and "forked" in str(error), error
    check(scene, expected)
    os._exit(0)
if pids == [0]:
    # It was forked as the render was done
    os._exit(0)
wait(*pids)
""",
    "a child goes on with the cameras of its parent": """
scene = room()
cameras = [{"position": [k, 3, 8]} for k in range(8)]
expected = [scene.render(camera=camera, **SIZE)["color"].tobytes() for camera in cameras]
frames = scene.render_many(cameras, workers=2, **SIZE)
begun = [next(frames)["color"].tobytes()]
def rest():
    assert begun + [frame["color"].tobytes() for frame in frames] == expected
wait(child(rest))
rest()
""",
    "multiprocessing, forked": """
scene = room()
expected = everything(scene)
context = multiprocessing.get_context("fork")
processes = [context.Process(target=check, args=(scene, expected)) for _ in range(2)]
[process.start() for process in processes]
[process.join(90) for process in processes]
assert [process.exitcode for process in processes] == [0, 0], processes
""",
    "a pool of multiprocessing, forked": """
scene = room()
expected = everything(scene)
with multiprocessing.get_context("fork").Pool(2) as pool:
    assert pool.map_async(everything, [scene] * 3).get(200) == [expected] * 3
""",
    "executors of forked processes": 'several("fork", everything)',
    "executors of spawned processes": 'several("spawn", everything)',
    "executors of a fork server": 'several("forkserver", everything)',
    "workers that feed frames": """
scene = room()
everything(scene)
context = multiprocessing.get_context("fork")
cameras, results = context.Queue(), context.Queue()
workers = [context.Process(target=feed, args=(scene, cameras, results)) for _ in range(2)]
[worker.start() for worker in workers]
[cameras.put(k) for k in [0, 1, 2, 3, None, None]]
found = dict(results.get(timeout=90) for _ in range(4))
[worker.join(90) for worker in workers]
for k, frame in found.items():
    expected = scene.render(camera={"position": [k, 3, 8]}, buffers=["color", "object-id"], **SIZE)
    assert all((frame[name] == expected[name]).all() for name in expected)
""",
    "a child that reads what a thread saves": """
frame = room().render(width=400, height=300, aa=1)
frame.save("whole.exr")
os.mkfifo("pipe.exr")
writer = threading.Thread(target=lambda: frame.save("pipe.exr"))
writer.start()
time.sleep(0.5)
def read():
    with open("pipe.exr", "rb") as pipe, open("whole.exr", "rb") as whole:
        assert pipe.read() == whole.read()
wait(child(read))
writer.join(60)
assert not writer.is_alive()
""",
    "a child with a terminal": """
scene = room()
expected = everything(scene)
pid, terminal = os.forkpty()
if pid == 0:
    check(scene, expected)
    os._exit(0)
wait(pid)
""",
    "programs with a hook before they start": """
scene = room()
def start(scene):
    subprocess.run([sys.executable, "-c", "pass"], preexec_fn=lambda: None, check=True)
with Busy(lambda: room(150).bounds):
    for _ in range(5):
        start(scene)
everything(scene)
""",
    "a child that ends as programs do": """
scene = room()
expected = everything(scene)
pid = os.fork()
check(scene, expected)
if pid == 0:
    sys.exit(0)
wait(pid)
""",
    "threads that share a scene": """
scene = room()
expected = everything(scene)
with concurrent.futures.ThreadPoolExecutor(4) as pool:
    assert set(pool.map(everything, [scene] * 8)) == {expected}
""",
    "the end of a program while a thread renders": """
scene = room()
begun = threading.Event()
def forever():
    while True:
        scene.render(progress=lambda *_: begun.set(), width=60, height=45)
threading.Thread(target=forever, daemon=True).start()
begun.wait(60)
""",
}


@pytest.mark.skipif(sys.platform == "win32", reason="there is no fork")
@pytest.mark.parametrize("way", WAYS.values(), ids=list(WAYS))
def test_this_way_works(way, tmp_path):
    program = tmp_path / "program.py"
    body = "".join(f"    {line}\n" for line in way.strip().splitlines())
    # What several processes run has to be found by its name
    program.write_text(f'{PRELUDE}\n\nif __name__ == "__main__":\n{body}    print("the end")\n')
    how = {"cwd": tmp_path, "capture_output": True, "text": True, "timeout": SECONDS}
    ran = subprocess.run([sys.executable, program], **how)
    assert (ran.returncode, ran.stdout.strip().endswith("the end")) == (0, True), ran.stdout + ran.stderr

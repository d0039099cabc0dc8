"""How fast firstlight is beside Open3D and pyrender, measured in one run, as a Markdown table.

    python speed.py --pyrender PYTHON --rounds 5 --memory --out speed.md

Each program is a process of its own that is started once and told by lines what to draw, so that its start is not
counted. They take turns, round by round, and only one of them works at a time. Firstlight and Open3D are those of the
interpreter that runs this file; pyrender is that of PYTHON. A program that does not start is left out, with a note.
"""

import argparse
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

FOV_Y_DEG = 45.0
LARGE, SMALL = (640, 480), (256, 256)
FRAMES, VIEWS = 10, 50
IDS = ["object-id", "primitive-id"]
PLANES = "depth, normal and ids of 6,962 triangles, 640 x 480"
MANY = f"{VIEWS} views with colour, depth, normal, ids, 256 x 256"
# The task, its program, what the program does, its job; the first row of each task is what others are compared with
ROWS = [
    (PLANES, "firstlight", "firstlight", "smooth"),
    (PLANES, "firstlight", "firstlight, `normal-geometric`", "facets"),
    (PLANES, "open3d", "Open3D, rays and their hits", "planes"),
    (PLANES, "egl", "pyrender, EGL: depth and ids, no normals", "planes"),
    (PLANES, "osmesa", "pyrender, OSMesa: depth and ids, no normals", "planes"),
    (MANY, "firstlight", "firstlight", "views1"),
    (MANY, "firstlight", "firstlight, `aa=4`", "views4"),
    (MANY, "egl", "pyrender, EGL: colour in 8 bits and depth", "views"),
    (MANY, "osmesa", "pyrender, OSMesa: colour in 8 bits and depth", "views"),
]
IMPORT = "import numpy, time; t = time.perf_counter(); import firstlight; print((time.perf_counter() - t) * 1e3)"


def model(triangles):
    """A bumpy ball of about so many triangles."""
    k = int((triangles / 2) ** 0.5)
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, k + 1), np.linspace(0.01, np.pi - 0.01, k + 1))
    r = 1 + 0.1 * np.sin(7 * u) * np.sin(5 * v)
    vertices = np.stack([r * np.sin(v) * np.cos(u), r * np.cos(v), r * np.sin(v) * np.sin(u)], -1).reshape(-1, 3)
    i = np.arange(k * k)
    a = i // k * (k + 1) + i % k
    faces = np.concatenate([np.stack([a, a + 1, a + k + 2], -1), np.stack([a, a + k + 2, a + k + 1], -1)])
    return vertices, faces


def eye(angle):
    """Where the camera is on its way around the ball, at which it looks."""
    return np.array([4 * np.sin(angle), 1, 4 * np.cos(angle)])


def pose(at):
    """From a camera that looks at the origin to the world: x right, y up, z backwards."""
    back = at / np.linalg.norm(at)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(back, right), back, at], axis=1)
    return matrix


def seen(depth):
    """The mean nearness of a picture, by which one sees that all programs draw the same."""
    there = np.isfinite(depth) & (depth > 0)
    return float(np.where(there, 1 / np.where(there, depth, 1), 0).mean())


class Firstlight:
    def __init__(self):
        import firstlight as fl

        self.fl, self.scene = fl, fl.Scene()
        self.scene.add_mesh(*model(7000), smooth_deg=40, name="ball")
        self.scene.add_directional_light(direction=[-1, -1, -1])
        self.versions = {"firstlight": fl.__version__}

    def camera(self, angle, size):
        fields = {"look_at": [0, 0, 0], "fov_y_deg": FOV_Y_DEG, "width": size[0], "height": size[1]}
        return self.fl.Camera(position=eye(angle), **fields)

    def draw(self, job, angle):
        buffers = ["depth", "normal" if job == "smooth" else "normal-geometric", *IDS]
        return self.scene.render(camera=self.camera(angle, LARGE), buffers=buffers)["depth"]

    def views(self, job, angles):
        cameras = [self.camera(angle, SMALL) for angle in angles]
        buffers = ["color", "depth", "normal", *IDS]
        for frame in self.scene.render_many(cameras, buffers=buffers, aa=int(job[-1])):
            depth = frame["depth"]
        return depth

    def memory(self):
        """The MiB that 10,000 small pictures leave behind, those of the first 200 left out."""
        held = []
        for k in range(10200):
            self.scene.render(camera=self.camera(k * 0.01, (32, 32)), buffers=["color", "depth"])
            if k in (199, 10199):
                with open("/proc/self/statm") as file:
                    held.append(int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20)
        return held[1] - held[0]


class Open3D:
    def __init__(self):
        import open3d

        self.scene = open3d.t.geometry.RaycastingScene()
        vertices, faces = model(7000)
        self.scene.add_triangles(vertices.astype(np.float32), faces.astype(np.uint32))
        # Its field of view is that of the picture's width
        width, height = LARGE
        self.fov = math.degrees(2 * math.atan(math.tan(math.radians(FOV_Y_DEG / 2)) * width / height))
        self.versions = {"Open3D": open3d.__version__}

    def draw(self, job, angle):
        hits = self.scene.cast_rays(self.scene.create_rays_pinhole(self.fov, [0, 0, 0], eye(angle), [0, 1, 0], *LARGE))
        return [hits[name].numpy() for name in ("t_hit", "primitive_normals", "geometry_ids", "primitive_ids")][0]


class Pyrender:
    def __init__(self):
        if not hasattr(np, "infty"):
            np.infty = np.inf  # a name that pyrender asks for and numpy 2 no longer has
        import pyrender
        from OpenGL import GL

        self.flags = pyrender.RenderFlags
        # A mesh belongs to one context
        self.of_size = {size: self.prepared(pyrender, size) for size in (LARGE, SMALL)}
        self.of_size[LARGE][0]._platform.make_current()
        self.versions = {"pyrender": pyrender.__version__, "OpenGL": GL.glGetString(GL.GL_RENDERER).decode()}

    def prepared(self, pyrender, size):
        import trimesh

        scene = pyrender.Scene()
        ball = scene.add(pyrender.Mesh.from_trimesh(trimesh.Trimesh(*model(7000), process=False)))
        camera = scene.add(pyrender.PerspectiveCamera(math.radians(FOV_Y_DEG)))
        scene.add(pyrender.DirectionalLight(intensity=3), pose=pose(np.ones(3)))
        return pyrender.OffscreenRenderer(*size), scene, camera, {ball: (255, 0, 0)}

    def render(self, angle, size, flags):
        renderer, scene, camera, ids = self.of_size[size]
        scene.set_pose(camera, pose(eye(angle)))
        return renderer.render(scene, flags=flags, seg_node_map=ids)[1]

    def draw(self, job, angle):
        return self.render(angle, LARGE, self.flags.SEG)

    def views(self, job, angles):
        for angle in angles:
            depth = self.render(angle, SMALL, self.flags.SHADOWS_DIRECTIONAL)
        return depth


def work(program, job, first):
    """Milliseconds a picture, of each or their mean, and what was seen in the last one."""
    if job == "memory":
        return program.memory()
    times, angles = [], [first + 0.1 * k for k in range(VIEWS if "views" in job else FRAMES)]
    for part in [angles] if "views" in job else angles:
        start = time.perf_counter()
        depth = program.views(job, part) if "views" in job else program.draw(job, part)
        times.append((time.perf_counter() - start) * 1e3 / (VIEWS if "views" in job else 1))
    return times, seen(depth)


def child(name):
    """Answers each line of its input, a job and an angle, by a line."""
    # What libraries print is no answer
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    program = {"firstlight": Firstlight, "open3d": Open3D}.get(name, Pyrender)()
    print(json.dumps(program.versions), file=answers, flush=True)
    for line in sys.stdin:
        print(json.dumps(work(program, *json.loads(line))), file=answers, flush=True)


class Child:
    """A program in a process of its own."""

    def __init__(self, name, python):
        if python is None:
            raise RuntimeError("--pyrender was not given")
        environment = {**os.environ, **({"PYOPENGL_PLATFORM": name} if name in ("egl", "osmesa") else {})}
        self.faults = tempfile.TemporaryFile("w+")
        files = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": self.faults}
        command = [python, os.path.abspath(__file__), "--child", name]
        self.process = subprocess.Popen(command, env=environment, text=True, **files)
        self.versions = self.answer()

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            self.faults.seek(0)
            raise RuntimeError((self.faults.read().strip().splitlines() or ["it ended"])[-1])
        return json.loads(line)

    def ask(self, job, first=0.0):
        print(json.dumps([job, first]), file=self.process.stdin, flush=True)
        return self.answer()


def start(pyrender):
    """The programs that start, and notes on the others."""
    pythons = {"firstlight": sys.executable, "open3d": sys.executable, "egl": pyrender, "osmesa": pyrender}
    children, notes = {}, []
    for name, python in pythons.items():
        try:
            children[name] = Child(name, python)
        except (RuntimeError, OSError) as fault:
            notes.append(f"{name} was left out: {fault}")
    return children, notes


def measure(children, rounds):
    """The milliseconds of each row, but for a first round that warms up; and notes on what is not comparable."""
    times, notes = {row: [] for row in ROWS if row[1] in children}, []
    for number in range(rounds + 1):
        first = {}
        for row in times:
            found, near = children[row[1]].ask(row[3], number * 1.003)
            times[row] += found if number > 0 else []
            expected = first.setdefault(row[0], near)
            if number == 0 and abs(near / expected - 1) > 0.005:
                notes.append(f"{row[2]} draws something else: {near:.4f}, not {expected:.4f}")
    return times, notes


def about(children):
    """The line on the machine and the versions."""
    processor = platform.processor() or platform.machine()
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo") as file:
            processor = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), processor)
    versions = {"Python": platform.python_version(), "numpy": np.__version__}
    for one in children.values():
        versions.update(one.versions)
    return "; ".join([f"{processor}, {os.cpu_count()} cores", *(f"{key} {value}" for key, value in versions.items())])


def table(times):
    lines, first = ["| task | program | ms a picture | by firstlight's |", "|---|---|--:|--:|"], {}
    for (task, _, label, _), some in times.items():
        median = statistics.median(some)
        lines.append(f"| {task} | {label} | {median:.2f} | {median / first.setdefault(task, median):.2f} |")
    imports = [float(subprocess.check_output([sys.executable, "-c", IMPORT], text=True)) for _ in range(8)]
    return [*lines, f"| `import firstlight` after numpy | firstlight | {statistics.median(imports[1:]):.2f} | |"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5, help="how often each program has its turn")
    parser.add_argument("--pyrender", metavar="PYTHON", help="the interpreter that has pyrender")
    parser.add_argument("--memory", action="store_true", help="also what 10,000 small pictures leave in memory")
    parser.add_argument("--out", metavar="FILE", help="a file for the table")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        return child(options.child)
    children, notes = start(options.pyrender)
    times, others = measure(children, options.rounds)
    lines = [about(children), "", *table(times)]
    if options.memory:
        # In a process that has no memory to reuse
        grown = Child("firstlight", sys.executable).ask("memory")
        lines += ["", f"Memory after 10,000 small pictures: {grown:+.1f} MiB"]
    text = "\n".join(lines + [line for note in notes + others for line in ("", note)]) + "\n"
    print(text, end="")
    if options.out:
        with open(options.out, "w") as file:
            file.write(text)


if __name__ == "__main__":
    main()

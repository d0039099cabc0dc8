"""The stubs against the package, by mypy."""

import os
import pathlib
import subprocess
import sys
import sysconfig

import pytest

import firstlight as fl

pytest.importorskip("mypy")

# What the stubs have alone: words for types, and what Python's own Mapping says better
ALLOWED = [
    r"firstlight\.(Buffer|Color|ColorParam|Content|NumberParam|Studio|Transform|Vector|View)",
    r"firstlight\.Handle\.__init__",
    r"firstlight\.Render\.get",
]
# A class of Rust is always one that others cannot lie beside
LAYOUT = "is a disjoint base at runtime"

PROGRAM = """
import numpy as np
from numpy.typing import NDArray
from typing import Any
import firstlight as fl

scene = fl.Scene()
chair = scene.add_mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]), name="chair")
scene.add_sphere(center=[0, 0, 0], radius=1)
camera = fl.Camera(position=[0, 0, 1], look_at=[0, 0, 0], fov_y_deg=45, width=3, height=4)
frame = scene.render(camera=camera, buffers=["color", "depth", "light:*"], aa=1)
depth: NDArray[Any] = frame["depth"]
version: str = frame.receipt["version"]
frame.save("x.exr", half=True)
for frame in scene.render_many([camera], buffers=["depth"]):
    print(frame["depth"].shape)
scene["chair"].transform = np.eye(4)
"""


def mypy(folder, module, *arguments):
    package, environment = str(pathlib.Path(fl.__file__).parents[1]), dict(os.environ)
    # Where packages are installed, mypy looks by itself
    if package != sysconfig.get_paths()["platlib"]:
        environment["MYPYPATH"] = package
    command = [sys.executable, "-m", module, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


def test_the_stubs_say_what_the_package_has(tmp_path):
    (tmp_path / "mypy.ini").write_text("[mypy]\nignore_missing_imports = True\n")
    (tmp_path / "allowed").write_text("\n".join(ALLOWED))
    options = ["--mypy-config-file", "mypy.ini", "--allowlist", "allowed", "--ignore-missing-stub", "--concise"]
    ran = mypy(tmp_path, "mypy.stubtest", "firstlight", *options)
    faults = [line for line in ran.stdout.splitlines() if line and LAYOUT not in line]
    assert faults == [], ran.stdout + ran.stderr
    assert ran.stderr == ""


def test_a_program_is_well_typed(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    ran = mypy(tmp_path, "mypy", "--strict", "program.py")
    assert ran.returncode == 0, ran.stdout
    wrong = PROGRAM.replace('half=True', 'half="yes"').replace("radius=1", "radios=1")
    (tmp_path / "program.py").write_text(wrong)
    ran = mypy(tmp_path, "mypy", "--strict", "program.py")
    assert '"half"' in ran.stdout and '"radios"' in ran.stdout, ran.stdout

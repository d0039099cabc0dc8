"""One picture of a mesh in F3D with software OpenGL, as a whole process. Usage: mesh_f3d.py MESH OUT.png SIZE"""

import sys

import f3d

engine = f3d.Engine.create_egl()
size = int(sys.argv[3])
engine.window.size = size, size
engine.scene.add([sys.argv[1]])
engine.window.render_to_image().save(sys.argv[2])

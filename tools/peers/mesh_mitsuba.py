"""One picture of a mesh in Mitsuba 3, as a whole process. Usage: mesh_mitsuba.py MESH.ply OUT.png SIZE

One sample for each pixel, one point light with shadows, direct light only; variant scalar_rgb."""

import sys

import drjit
import mitsuba

mitsuba.set_variant("scalar_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Warn)
drjit.set_thread_count(2)
mesh, out, size = sys.argv[1], sys.argv[2], int(sys.argv[3])
look = mitsuba.ScalarTransform4f().look_at([0.9, 1.1, 2.3], [0, 0, 0], [0, 1, 0])
film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
scene = mitsuba.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sensor": {
            "type": "perspective",
            "fov": 45,
            "to_world": look,
            "film": film,
            "sampler": {"type": "independent", "sample_count": 1},
        },
        "mesh": {"type": "ply", "filename": mesh, "face_normals": True, "bsdf": {"type": "diffuse"}},
        "light": {"type": "point", "position": [2, 2, 1], "intensity": {"type": "rgb", "value": [12, 12, 12]}},
    }
)
mitsuba.util.write_bitmap(out, mitsuba.render(scene, spp=1))

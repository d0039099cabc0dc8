"""Config 11 in Mitsuba 3, as a whole process. Usage: config11_mitsuba.py SIZE RAYS LIGHT_SAMPLES OUT.png

RAYS camera rays in each pixel, LIGHT_SAMPLES samples of the light for each of them; direct light only, 2 threads, variant
llvm_ad_rgb. Mitsuba's materials and lamp are physical, so the picture is another than ours in tone, but not in shadow."""

import sys

import drjit
import mitsuba
import numpy

mitsuba.set_variant("llvm_ad_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Warn)
drjit.set_thread_count(2)
size, rays, light_samples, out = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
T = mitsuba.ScalarTransform4f
# Camera rays of one pass, as memory grows with them
PASS = 16


def rgb(*color):
    return {"type": "rgb", "value": list(color)}


def plastic(color, shininess):
    # The width of the GGX lobe that looks like a Blinn-Phong exponent
    alpha = (2 / (shininess + 2)) ** 0.5
    return {
        "type": "roughplastic",
        "distribution": "ggx",
        "alpha": alpha,
        "diffuse_reflectance": color,
        "nonlinear": False,
    }


def quad(p, a, b, normal, color):
    p, a, b = map(numpy.array, (p, a, b))
    if numpy.dot(numpy.cross(a, b), normal) < 0:
        a, b = b, a
    matrix = numpy.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = a / 2, b / 2, normal, p + (a + b) / 2
    return {"type": "rectangle", "to_world": T(matrix.tolist()), "bsdf": plastic(rgb(*color), 16)}


def ball(center, radius, color0, color1, squares, shininess):
    to_uv = T().scale([squares, squares / 2, 1])
    board = {"type": "checkerboard", "color0": rgb(*color0), "color1": rgb(*color1), "to_uv": to_uv}
    to_world = T().translate(center).rotate([1, 0, 0], -90).scale(radius)
    return {"type": "sphere", "to_world": to_world, "bsdf": plastic(board, shininess)}


GRAY = (0.7, 0.7, 0.7)
lamp = quad((-1, 5.9, -7), (2, 0, 0), (0, 0, 2), (0, -1, 0), (0, 0, 0))
lamp["emitter"] = {"type": "area", "radiance": rgb(40, 40, 40)}
film = {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb", "rfilter": {"type": "box"}}
scene = mitsuba.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": light_samples, "bsdf_samples": 0},
        "sensor": {
            "type": "perspective",
            "fov": 45,
            "fov_axis": "y",
            "to_world": T().look_at([0, 0, 10], [0, 0, 0], [0, 1, 0]),
            "film": film,
            "sampler": {"type": "independent", "sample_count": PASS},
        },
        "back": quad((-10, -10, -10), (20, 0, 0), (0, 20, 0), (0, 0, 1), GRAY),
        "left": quad((-6, -7, -11), (0, 0, 20), (0, 20, 0), (1, 0, 0), (1, 0, 0)),
        "right": quad((6, -7, -11), (0, 0, 20), (0, 20, 0), (-1, 0, 0), (0, 1, 0)),
        "floor": quad((-7, -6, -11), (20, 0, 0), (0, 0, 20), (0, 1, 0), GRAY),
        "ceiling": quad((-7, 6, -11), (20, 0, 0), (0, 0, 20), (0, -1, 0), GRAY),
        "ball 1": ball((3, 1, -7), 1.5, (0, 0, 1), (1, 1, 1), 4, 22),
        "ball 2": ball((2, -3.2, -5), 1.0, (0.2, 0.5, 0), (0.9, 0, 0.4), 4, 40),
        "ball 3": ball((-4, 2, -5), 1.8, (1, 1, 1), (0, 0, 0), 8, 120),
        "ball 4": ball((-2, -4.5, -8), 2.0, (0.3, 1, 0.4), (0.3, 0.7, 0.2), 4, 16),
        "lamp": lamp,
    }
)
passes = max(rays // PASS, 1)
# Other seeds for other numbers of rays: pictures that are compared share no sample
total = sum(numpy.array(mitsuba.render(scene, spp=min(rays, PASS), seed=rays + i)) for i in range(passes)) / passes
picture = mitsuba.Bitmap(total.astype(numpy.float32))
picture.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt16, srgb_gamma=True).write(out)

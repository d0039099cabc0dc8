"""Two smooth meshes under two area lights in Mitsuba 3.

Usage: soft_meshes_mitsuba.py SIZE SAMPLES PASSES [textured] OUT.png

SIZE x 9/16 SIZE pixels, the mean of PASSES pictures of SAMPLES samples in each pixel, one point of one light for each
of them; direct light only, 2 threads, variant llvm_ad_rgb. The scene is that of soft_meshes.toml, or of
textured_meshes.toml, where a lobe is sampled as well as the lights. Prints the processor
seconds of the render alone: start, loading and compilation are left out."""

import pathlib
import sys
import time

import drjit
import mitsuba
import numpy

mitsuba.set_variant("llvm_ad_rgb")
mitsuba.set_log_level(mitsuba.LogLevel.Error)
drjit.set_thread_count(2)
size, samples, passes, out = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[-1]
textured = sys.argv[4] == "textured"
T = mitsuba.ScalarTransform4f
LEFT, RIGHT, FLOOR = [{"type": "ref", "id": name} for name in ("left", "right", "ground")]
COBBLES = str(pathlib.Path(__file__).parents[2] / "scenes/gallery/textures/cobbles-color.jpg")
OBJ = pathlib.Path(__file__).parents[2] / "crates/firstlight/tests/models/obj/spot.obj"
MESH = out + ".ply"
WIDTH, HEIGHT = size, size * 9 // 16
# Mitsuba takes the field of view across, soft_meshes.toml has 30 degrees from bottom to top
FOV_X = 2 * numpy.degrees(numpy.arctan(numpy.tan(numpy.radians(15)) * WIDTH / HEIGHT))


def write_ply(path):
    # A vertex for each pair of position and texture coordinate, with the normal of the position: Mitsuba would split
    # normals of its own at the seams of texture coordinates
    rows = [line.split() for line in OBJ.read_text().splitlines()]
    points = numpy.array([[float(x) for x in row[1:4]] for row in rows if row[:1] == ["v"]])
    uvs = [row[1:3] for row in rows if row[:1] == ["vt"]]
    faces = [[tuple(int(i) - 1 for i in corner.split("/")[:2]) for corner in row[1:]] for row in rows if row[:1] == ["f"]]
    triangles = [[face[0], face[k], face[k + 1]] for face in faces for k in range(1, len(face) - 1)]
    normals = numpy.zeros_like(points)
    for corners in triangles:
        a, b, c = [points[corner[0]] for corner in corners]
        for corner in corners:
            normals[corner[0]] += numpy.cross(b - a, c - a)
    normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
    numbers = {}
    for corner in (corner for corners in triangles for corner in corners):
        numbers.setdefault(corner, len(numbers))
    vertices = [" ".join(map(str, [*points[p], *normals[p], *uvs[t]])) for p, t in numbers]
    properties = [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v")]
    head = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", *properties]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(str, [3, *(numbers[corner] for corner in corners)])) for corners in triangles]
    pathlib.Path(path).write_text("\n".join(head + vertices + rows) + "\n")


def quad(center, e0, e1, **more):
    normal = numpy.cross(e0, e1)
    matrix = numpy.eye(4)
    matrix[:3, 0], matrix[:3, 1] = numpy.array(e0) / 2, numpy.array(e1) / 2
    matrix[:3, 2], matrix[:3, 3] = normal / numpy.linalg.norm(normal), center
    return {"type": "rectangle", "to_world": T(matrix.tolist()), **more}


def lamp(center, e0, e1, radiance):
    return quad(center, e0, e1, emitter={"type": "area", "radiance": {"type": "rgb", "value": radiance}})


def model(at, degrees, bsdf):
    return {"type": "ply", "filename": MESH, "to_world": T().translate(at).rotate([0, 1, 0], degrees), "bsdf": bsdf}


def diffuse(reflectance):
    return {"type": "twosided", "nested": {"type": "diffuse", "reflectance": reflectance}}


def cobbles(times):
    return {"type": "bitmap", "filename": COBBLES, "to_uv": T().scale([times, -times, 1])}


gray = diffuse({"type": "rgb", "value": 0.7})
metal = {
    "type": "roughconductor",
    "distribution": "ggx",
    "material": "none",
    "alpha": 0.25,
    "specular_reflectance": {"type": "rgb", "value": [1.0, 0.77, 0.34]},
}


write_ply(MESH)
scene = mitsuba.load_dict(
    {
        "type": "scene",
        "integrator": {
            "type": "direct",
            "emitter_samples": 1,
            "bsdf_samples": int(textured),
            "hide_emitters": True,
        },
        "ground": diffuse(cobbles(40)) if textured else gray,
        "left": metal if textured else gray,
        "right": diffuse(cobbles(1)) if textured else gray,
        "sensor": {
            "type": "perspective",
            "fov": FOV_X,
            "fov_axis": "x",
            "to_world": T().look_at([0, 1.9, 6.2], [0, 0.72, 0], [0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": WIDTH,
                "height": HEIGHT,
                "pixel_format": "rgb",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "multijitter", "sample_count": 16},
        },
        "floor": quad([0, 0, 0], [100, 0, 0], [0, 0, -100], bsdf=FLOOR),
        "left cow": model([-1, 0.737, 0], -145, LEFT),
        "right cow": model([1, 0.737, 0], 160, RIGHT),
        "key": lamp([-3.5, 4, 3.5], [1.41421, 0, 1.41421], [-0.80072, -1.64854, 0.80072], 24.0),
        "rim": lamp([4, 3, -3], [-1.30158, 0, -1.51851], [0.70124, -1.77397, -0.60106], 10.0),
    }
)
numpy.array(mitsuba.render(scene, spp=samples, seed=0))
start = time.process_time()
# Seeds by the number of samples: pictures that are compared share none
seeds = [samples * (passes + i) for i in range(passes)]
total = sum(numpy.array(mitsuba.render(scene, spp=samples, seed=seed)) for seed in seeds) / passes
print(time.process_time() - start)
picture = mitsuba.Bitmap(total.astype(numpy.float32))
picture.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt16, srgb_gamma=True).write(out)

"""Two smooth meshes under two area lights in Mitsuba 3. Usage: soft_meshes_mitsuba.py SIZE SAMPLES PASSES OUT.png

SIZE x 9/16 SIZE pixels, the mean of PASSES pictures of SAMPLES samples in each pixel, one point of one light for each
of them; direct light only, 2 threads, variant llvm_ad_rgb. The scene is that of soft_meshes.toml. Prints the processor
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
size, samples, passes, out = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
T = mitsuba.ScalarTransform4f
GRAY = {"type": "ref", "id": "gray"}
OBJ = pathlib.Path(__file__).parents[2] / "crates/firstlight/tests/models/obj/spot.obj"
MESH = out + ".ply"
WIDTH, HEIGHT = size, size * 9 // 16
# Mitsuba takes the field of view across, soft_meshes.toml has 30 degrees from bottom to top
FOV_X = 2 * numpy.degrees(numpy.arctan(numpy.tan(numpy.radians(15)) * WIDTH / HEIGHT))


def write_ply(path):
    # Positions alone: with texture coordinates Mitsuba would split the normals at their seams
    rows = [line.split() for line in OBJ.read_text().splitlines()]
    points = [" ".join(row[1:4]) for row in rows if row[:1] == ["v"]]
    faces = [[int(corner.split("/")[0]) - 1 for corner in row[1:]] for row in rows if row[:1] == ["f"]]
    triangles = [f"3 {face[0]} {face[k]} {face[k + 1]}" for face in faces for k in range(1, len(face) - 1)]
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}", *(f"property float {axis}" for axis in "xyz")]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    pathlib.Path(path).write_text("\n".join(head + points + triangles) + "\n")


def quad(center, e0, e1, **more):
    normal = numpy.cross(e0, e1)
    matrix = numpy.eye(4)
    matrix[:3, 0], matrix[:3, 1] = numpy.array(e0) / 2, numpy.array(e1) / 2
    matrix[:3, 2], matrix[:3, 3] = normal / numpy.linalg.norm(normal), center
    return {"type": "rectangle", "to_world": T(matrix.tolist()), **more}


def lamp(center, e0, e1, radiance):
    return quad(center, e0, e1, emitter={"type": "area", "radiance": {"type": "rgb", "value": radiance}})


def model(at, degrees):
    return {"type": "ply", "filename": MESH, "to_world": T().translate(at).rotate([0, 1, 0], degrees), "bsdf": GRAY}


write_ply(MESH)
scene = mitsuba.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": True},
        "gray": {
            "type": "twosided",
            "nested": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.7}},
        },
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
        "floor": quad([0, 0, 0], [100, 0, 0], [0, 0, -100], bsdf=GRAY),
        "left": model([-1, 0.737, 0], -145),
        "right": model([1, 0.737, 0], 160),
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

#!/usr/bin/env python3
"""The numbers of the book's page "From text to pixel", computed from the formulas alone.

    python3 docs/walk.py            prints them
    python3 docs/walk.py --check    and sees whether each of them stands in docs/src/walk.md

Plain Python, nothing to install, and nothing of the renderer is used: this is a second opinion. It computes with 64 bits
where the renderer computes with 32, so the last digits differ; the page shows fewer digits than that.
"""

import math
import pathlib
import sys

# ---------------------------------------------------------------------------------------------- vectors


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def mul(a, s):
    return tuple(x * s for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return math.sqrt(dot(a, a))


def normalize(a):
    return mul(a, 1 / length(a))


# ---------------------------------------------------------------------------------------------- config 11

W = H = 1024
N = 4
FOV = math.radians(45)
EYE, LOOK_AT, UP = (0, 0, 10), (0, 0, 0), (0, 1, 0)
AMBIENT = 0.1
GAMMA = 2.2
SAMPLES = 400
LIGHT_CORNER, LIGHT_E0, LIGHT_E1 = (-1, 5.9, -7), (2, 0, 0), (0, 0, 2)

# name, centre, radius, counts, first colour, second colour, shininess
SPHERES = [
    ("blue and white", (3, 1, -7), 1.5, 4, (0, 0, 1), (1, 1, 1), 22),
    ("olive and pink", (2, -3.2, -5), 1.0, 4, (0.2, 0.5, 0), (0.9, 0, 0.4), 40),
    ("white and black", (-4, 2, -5), 1.8, 8, (1, 1, 1), (0, 0, 0), 120),
    ("light and dark green", (-2, -4.5, -8), 2.0, 4, (0.3, 1, 0.4), (0.3, 0.7, 0.2), 16),
]
# name, corner, edges, normal, colour
WALLS = [
    ("back wall", (-10, -10, -10), (20, 0, 0), (0, 20, 0), (0, 0, 1), (0.7, 0.7, 0.7)),
    ("left wall", (-6, -7, -11), (0, 0, 20), (0, 20, 0), (1, 0, 0), (1, 0, 0)),
    ("right wall", (6, -7, -11), (0, 0, 20), (0, 20, 0), (-1, 0, 0), (0, 1, 0)),
    ("floor", (-7, -6, -11), (20, 0, 0), (0, 0, 20), (0, 1, 0), (0.7, 0.7, 0.7)),
    ("ceiling", (-7, 6, -11), (20, 0, 0), (0, 0, 20), (0, -1, 0), (0.7, 0.7, 0.7)),
]

# ---------------------------------------------------------------------------------------------- camera


def camera_basis():
    forward = normalize(sub(LOOK_AT, EYE))
    right = normalize(cross(forward, UP))
    return forward, right, cross(right, forward)


def camera_ray(x, y):
    """The ray through the film at (x, y) in pixels from its upper left corner."""
    forward, right, up = camera_basis()
    film_x = (2 * x / W - 1) * math.tan(FOV / 2) * W / H
    film_y = (1 - 2 * y / H) * math.tan(FOV / 2)
    towards = add(add(mul(right, film_x), mul(up, film_y)), forward)
    return film_x, film_y, towards, normalize(towards)


# ---------------------------------------------------------------------------------------------- shapes


def sphere_roots(o, d, centre, radius):
    """b, the discriminant, and both roots of |o + t d - c|^2 = r^2 (None where there are none); d is unit."""
    f = sub(o, centre)
    b = -dot(f, d)
    discriminant = b * b - (dot(f, f) - radius * radius)
    if discriminant < 0:
        return b, discriminant, None
    root = math.sqrt(discriminant)
    return b, discriminant, (b - root, b + root)


def wall_meets(o, d, wall):
    """t, and (u, v) there; t is None where the ray is parallel to the wall."""
    _, p, e0, e1, n, _ = wall
    cos = dot(n, d)
    if cos == 0:
        return None, None
    t = -dot(n, sub(o, p)) / cos
    q = sub(add(o, mul(d, t)), p)
    return t, (dot(q, e0) / dot(e0, e0), dot(q, e1) / dot(e1, e1))


def nearest(o, d):
    """(t, what) of the first surface."""
    best = None
    for i, (_, centre, radius, *_) in enumerate(SPHERES):
        _, _, roots = sphere_roots(o, d, centre, radius)
        for t in roots or ():
            if t > 0 and (best is None or t < best[0]):
                best = (t, ("sphere", i))
    for i, wall in enumerate(WALLS):
        t, uv = wall_meets(o, d, wall)
        if t is not None and t > 0 and 0 <= uv[0] <= 1 and 0 <= uv[1] <= 1 and (best is None or t < best[0]):
            best = (t, ("wall", i))
    return best


def blocker(p, l, own):
    """Who stands between p and p + l; `own` is the surface p lies on."""
    a = dot(l, l)
    for i, (name, centre, radius, *_) in enumerate(SPHERES):
        f = sub(p, centre)
        b = -dot(f, l)
        c = dot(f, f) - radius * radius
        if own == ("sphere", i):
            # The point lies on it: c is 0, the other root is 2 b / a
            if 0 < 2 * b / a < 1:
                return name
        elif b * b - a * c >= 0 and 0 < (b - math.sqrt(b * b - a * c)) / a < 1:
            return name
    for i, wall in enumerate(WALLS):
        if own == ("wall", i):
            continue
        t, uv = wall_meets(p, l, wall)
        if t is not None and 0 < t < 1 and 0 <= uv[0] <= 1 and 0 <= uv[1] <= 1:
            return wall[0]
    return None


# ---------------------------------------------------------------------------------------------- light


def sobol(k):
    """Point k of the light's fixed set: Sobol's sequence under a fixed Owen scramble (Burley 2020)."""
    mask = 0xFFFFFFFF

    def reverse(v):
        return int(f"{v:032b}"[::-1], 2)

    def owen(v, seed):
        v = reverse(v)
        v ^= v * 0x3D20ADEA & mask
        v = v + seed & mask
        v = v * (seed >> 16 | 1) & mask
        v ^= v * 0x05526C56 & mask
        v ^= v * 0x53A22864 & mask
        return reverse(v)

    second, direction, rest = 0, 1 << 31, k
    while rest:
        if rest & 1:
            second ^= direction
        direction ^= direction >> 1
        rest >>= 1
    return ((owen(reverse(k), 0x5BE0CD19) + 0.5) / 2**32, (owen(second, 0x1F83D9AB) + 0.5) / 2**32)


def light_point(k):
    a, b = sobol(k)
    return add(add(LIGHT_CORNER, mul(LIGHT_E0, a)), mul(LIGHT_E1, b))


LIGHT_POINTS = [light_point(k) for k in range(SAMPLES)]

# ---------------------------------------------------------------------------------------------- shading


def look(x, y):
    """What the ray through (x, y) sees, in numbers."""
    d = camera_ray(x, y)[3]
    t, what = nearest(EYE, d)
    p = add(EYE, mul(d, t))
    kind, i = what
    if kind == "sphere":
        _, centre, radius, counts, first, second, shininess = SPHERES[i]
        n = normalize(sub(p, centre))
        uv = (math.acos(n[0]) / math.pi, math.acos(n[1]) / math.pi)
        squares = (math.floor(uv[0] * counts), math.floor(uv[1] * counts))
        texel = first if sum(squares) % 2 == 0 else second
    else:
        n, texel, shininess, uv, squares = WALLS[i][4], WALLS[i][5], 16, None, None
    wo = mul(d, -1)
    return dict(t=t, what=what, p=p, n=n, uv=uv, squares=squares, texel=texel, shininess=shininess, wo=wo)


def sample(s, k):
    """What point k of the light sends: a dict of numbers, `lit` last."""
    q = LIGHT_POINTS[k]
    l = sub(q, s["p"])
    distance = length(l)
    wi = mul(l, 1 / distance)
    h = normalize(add(wi, s["wo"]))
    cos_i, cos_h = dot(s["n"], wi), dot(s["n"], h)
    above = cos_i > 0
    hidden = blocker(s["p"], l, s["what"]) if above else None
    lit = above and hidden is None
    return dict(
        q=q,
        l=l,
        distance=distance,
        wi=wi,
        h=h,
        cos_i=cos_i,
        cos_h=cos_h,
        above=above,
        hidden=hidden,
        lit=lit,
        diffuse=cos_i if lit else 0.0,
        specular=max(cos_h, 0.0) ** s["shininess"] if lit else 0.0,
    )


def shade(s):
    """The means over the light of diffuse and specular, how many points are below the horizon, how many hidden."""
    parts = [sample(s, k) for k in range(SAMPLES)]
    below = sum(not p["above"] for p in parts)
    hidden = {}
    for p in parts:
        if p["hidden"]:
            hidden[p["hidden"]] = hidden.get(p["hidden"], 0) + 1
    return sum(p["diffuse"] for p in parts) / SAMPLES, sum(p["specular"] for p in parts) / SAMPLES, below, hidden


def sub_samples(i, j):
    """The 4 x 4 places of a pixel, row by row."""
    return [(i + (c + 0.5) / N, j + (r + 0.5) / N) for r in range(N) for c in range(N)]


def pixel(i, j):
    """The film's colour, and its parts, of a pixel."""
    ambient, diffuse, specular = [0.0] * 3, [0.0] * 3, [0.0] * 3
    for x, y in sub_samples(i, j):
        s = look(x, y)
        d, h, _, _ = shade(s)
        for c in range(3):
            ambient[c] += AMBIENT * s["texel"][c] / N**2
            diffuse[c] += s["texel"][c] * d / N**2
            specular[c] += s["texel"][c] * h / N**2
    return ambient, diffuse, specular, [a + b + c for a, b, c in zip(ambient, diffuse, specular)]


def encode(linear):
    return 255 * min(max(linear, 0.0), 1.0) ** (1 / GAMMA)


# ---------------------------------------------------------------------------------------------- the page

PIXEL = (330, 846)
COLUMN, ROW = 1, 1  # the sub-sample that the page follows
SHADOWED = (800, 620)  # the second pixel: half in the shadow of a sphere


def number(x, digits=4):
    """As the page writes it: minus signs as hyphens, no -0."""
    return f"{x + 0.0:.{digits}f}".replace("-0." + "0" * digits, "0." + "0" * digits)


def vector(v, digits=4):
    return "(" + ", ".join(number(x, digits) for x in v) + ")"


def facts():
    """Every number of the page, as (what it is, how the page writes it)."""
    i, j = PIXEL
    x, y = i + (COLUMN + 0.5) / N, j + (ROW + 0.5) / N
    yield "place on the film", f"({x}, {y})"

    film_x, film_y, towards, d = camera_ray(x, y)
    yield "tan(fov/2)", number(math.tan(FOV / 2), 6)
    yield "film x", number(film_x)
    yield "film y", number(film_y)
    yield "length of the direction", number(length(towards))
    yield "d", vector(d)

    for name, centre, radius, *_ in SPHERES:
        b, discriminant, roots = sphere_roots(EYE, d, centre, radius)
        yield f"{name}: b", number(b, 3)
        yield f"{name}: discriminant", number(discriminant, 3)
        for t in roots or ():
            yield f"{name}: t", number(t, 3)
    for wall in WALLS:
        t, uv = wall_meets(EYE, d, wall)
        yield f"{wall[0]}: t", number(t, 3)
        if t > 0:
            yield f"{wall[0]}: uv", f"({number(uv[0], 3)}, {number(uv[1], 3)})"

    s = look(x, y)
    name, _, _, counts, *_ = SPHERES[s["what"][1]]
    yield "surface", name
    yield "t", number(s["t"])
    yield "p", vector(s["p"])
    yield "n", vector(s["n"])
    yield "wo", vector(s["wo"])
    yield "n.wo", number(dot(s["n"], s["wo"]))
    yield "u", number(s["uv"][0])
    yield "v", number(s["uv"][1])
    yield "angle to x", number(math.degrees(s["uv"][0] * math.pi), 2)
    yield "angle to y", number(math.degrees(s["uv"][1] * math.pi), 2)
    yield "u n", number(s["uv"][0] * counts, 3)
    yield "v n", number(s["uv"][1] * counts, 3)
    yield "square", f"({s['squares'][0]}, {s['squares'][1]})"
    yield "texel", f"({s['texel'][0]}, {s['texel'][1]}, {s['texel'][2]})"

    for k in (0, 2):
        q = sample(s, k)
        yield f"point {k}: place on the light", f"({number(sobol(k)[0])}, {number(sobol(k)[1])})"
        yield f"point {k}: q", vector(q["q"])
        yield f"point {k}: l", vector(q["l"])
        yield f"point {k}: distance", number(q["distance"])
        yield f"point {k}: wi", vector(q["wi"])
        yield f"point {k}: n.wi", number(q["cos_i"])
        assert q["lit"] == (k == 0)
        if q["lit"]:
            yield f"point {k}: h", vector(q["h"])
            yield f"point {k}: n.h", number(q["cos_h"])
            yield f"point {k}: (n.h)^s", number(q["specular"], 6)
            # The shadow ray against the other spheres: how near it passes
            for other, centre, radius, *_ in SPHERES:
                f = sub(s["p"], centre)
                t = -dot(f, q["l"]) / dot(q["l"], q["l"])
                if other == name:
                    yield f"shadow, {other}: b", number(-dot(f, q["l"]), 3)
                else:
                    yield f"shadow, {other}: t", number(t, 3)
                    yield f"shadow, {other}: distance", number(length(add(f, mul(q["l"], t))), 3)
            for wall in WALLS:
                yield f"shadow, {wall[0]}: t", number(wall_meets(s["p"], q["l"], wall)[0], 3)

    diffuse, specular, below, hidden = shade(s)
    assert not hidden
    yield "points below the horizon", str(below)
    yield "points that count", str(SAMPLES - below)
    yield "mean of n.wi", number(diffuse, 5)
    yield "mean of (n.h)^s", number(specular, 6)
    green = AMBIENT * s["texel"][1], s["texel"][1] * diffuse, s["texel"][1] * specular
    yield "green of the sub-sample: ambient", number(green[0], 5)
    yield "green of the sub-sample: diffuse", number(green[1], 5)
    yield "green of the sub-sample: highlight", number(green[2], 5)
    yield "green of the sub-sample", number(sum(green), 5)

    for row in range(N):
        means = [shade(look(i + (c + 0.5) / N, j + (row + 0.5) / N))[0] for c in range(N)]
        yield f"row {row} of the pixel", " | ".join(number(m, 4) for m in means)

    ambient, diffuse, specular, total = pixel(i, j)
    for c, channel in enumerate(("red", "green", "blue")):
        yield f"{channel}: ambient", number(ambient[c], 5)
        yield f"{channel}: diffuse", number(diffuse[c], 5)
        yield f"{channel}: highlight", number(specular[c], 5)
        yield f"{channel}: film", number(total[c], 5)
        yield f"{channel}: encoded", number(encode(total[c]), 2)
    yield "the pixel's bytes", "(" + ", ".join(str(math.floor(encode(c) + 0.5)) for c in total) + ")"
    yield "as a colour", "#" + "".join(f"{math.floor(encode(c) + 0.5):02x}" for c in total)

    # The second pixel, one sub-sample of it
    i, j = SHADOWED
    s = look(i + (COLUMN + 0.5) / N, j + (ROW + 0.5) / N)
    assert s["what"] == ("wall", 0)
    diffuse, _, below, hidden = shade(s)
    yield "second pixel: p", vector(s["p"], 3)
    yield "second pixel: below the horizon", str(below)
    ((by, count),) = hidden.items()
    yield "second pixel: hidden by", by
    yield "second pixel: hidden", str(count)
    yield "second pixel: lit", str(SAMPLES - count - below)
    yield "second pixel: mean of n.wi", number(diffuse, 4)
    yield "second pixel: without the shadow", number(unshadowed(s), 4)


def unshadowed(s):
    return sum(max(sample(s, k)["cos_i"], 0.0) for k in range(SAMPLES)) / SAMPLES


def main(facts, page, manual):
    """Prints the facts, or with --check sees whether each of them stands on a page of docs/src."""
    found = list(facts)
    if sys.argv[1:] == []:
        width = max(len(what) for what, _ in found)
        for what, text in found:
            print(f"{what:{width}}  {text}")
        return 0
    if sys.argv[1:] != ["--check"]:
        print(manual.strip(), file=sys.stderr)
        return 2
    text_of_page = (pathlib.Path(__file__).parent / "src" / page).read_text(encoding="utf-8")
    # A line may break wherever there is a space
    words = " ".join(text_of_page.split())
    missing = [(what, text) for what, text in found if " ".join(text.split()) not in words]
    for what, text in missing:
        print(f"docs/src/{page} does not say {text} ({what})", file=sys.stderr)
    print(f"{len(found) - len(missing)} of {len(found)} numbers stand in docs/src/{page}")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main(facts(), "walk.md", __doc__))

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

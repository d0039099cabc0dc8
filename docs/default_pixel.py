#!/usr/bin/env python3
"""The numbers of the book's page "A pixel of the default renderer", computed from the formulas alone.

    python3 docs/default_pixel.py            prints them
    python3 docs/default_pixel.py --check    and sees whether each of them stands in docs/src/default-pixel.md

Plain Python, nothing to install, and nothing of the renderer is used: this is a second opinion. It follows one point at
a time with 64 bits where the renderer takes sixteen at once with 32, so the last digits differ; the page shows fewer
digits than that. Vectors, the camera and the scene are those of walk.py.
"""

import math
import sys

from walk import AMBIENT, EYE, LIGHT_CORNER, LIGHT_E0, LIGHT_E1, SPHERES, WALLS
from walk import add, camera_ray, cross, dot, encode, length, main, mul, normalize, number, pixel, sub, sub_samples
from walk import vector, wall_meets

# ---------------------------------------------------------------------------------------------- the scene

PIXEL = (752, 985)
FLOOR = WALLS[3]
COLOR = FLOOR[5][0]  # gray: one channel stands for all three
SHININESS = 16
UP = FLOOR[4]
# The light: its middle, and half of its edges. Its places are the middle + x A + y B, x and y from -1 to 1
MIDDLE, A, B = (0, 5.9, -6), (1, 0, 0), (0, 0, 1)
CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))

# ---------------------------------------------------------------------------------------------- rules

GAUSS_5 = (  # node and weight on [-1, 1]
    (-0.9061798459386640, 0.2369268850561891),
    (-0.5384693101056831, 0.4786286704993665),
    (0.0, 0.5688888888888889),
    (0.5384693101056831, 0.4786286704993665),
    (0.9061798459386640, 0.2369268850561891),
)
KRONROD_7 = (  # node, weight, and weight in the Gauss rule of three nodes inside
    (-0.9604912687080203, 0.1046562260264673, 0.0),
    (-0.7745966692414834, 0.2684880898683334, 5 / 9),
    (-0.4342437493468026, 0.4013974147759622, 0.0),
    (0.0, 0.4509165386584741, 8 / 9),
    (0.4342437493468026, 0.4013974147759622, 0.0),
    (0.7745966692414834, 0.2684880898683334, 5 / 9),
    (0.9604912687080203, 0.1046562260264673, 0.0),
)


def spread():
    """Where on a panel, 0 to 1, its rows lie, and what each counts in both rules."""
    for node, fine, coarse in KRONROD_7:
        t = 0.5 + 0.5 * node
        density = 3 * t * (1 - t)
        yield t * t * (3 - 2 * t), fine * density, coarse * density


ROWS = list(spread())


def legendre(k, x):
    """P_k(x) for k of 1 or more, by Bonnet's recursion."""
    before, p = 1.0, x
    for j in range(1, k):
        before, p = p, ((2 * j + 1) * x * p - j * before) / (j + 1)
    return p


def lagrange(i):
    """Coefficients of x^0 to x^4 of the polynomial that is 1 at node i and 0 at the others."""
    p = [1.0]
    for j, (node, _) in enumerate(GAUSS_5):
        if j != i:
            scale = 1 / (GAUSS_5[i][0] - node)
            p = [scale * (before - node * here) for before, here in zip([0.0] + p, p + [0.0])]
    return p


LAGRANGE = [lagrange(i) for i in range(5)]

# ---------------------------------------------------------------------------------------------- display steps

FIRST_OCTAVE, LAST_OCTAVE = -40, 24
TABLE = [
    (value, 255 * value ** (1 / 2.2) if value < 1 else 255 * (1 + math.log(value) / 2.2))
    for value in (2.0 ** (k // 8) * (1 + k % 8 / 8) for k in range(8 * FIRST_OCTAVE, 8 * LAST_OCTAVE + 1))
]


def steps(value):
    """The display curve in steps of 8 bits, from a table with 8 entries for each doubling, straight between them."""
    if value <= TABLE[0][0]:
        return TABLE[0][1] * value / TABLE[0][0]
    octave = math.floor(math.log2(value))
    k = 8 * (octave - FIRST_OCTAVE) + math.floor(8 * (value / 2.0**octave - 1))
    (v0, s0), (v1, s1) = TABLE[k], TABLE[k + 1]
    return s0 + (s1 - s0) * (value - v0) / (v1 - v0)


def shows(value, error):
    """How many steps a value is away from what is smaller by the error."""
    low = max(value - error, 0.0)
    return steps(low + error) - steps(low)


TINY = 2.0**-126  # the least normal number in single precision
FIT_PART = 0.1  # the part of the tails of a partly visible cell that counts as error
ALLOWED = 0.15  # steps, at a point that stands for a pixel
PART = 0.5  # of that, for a cell or a panel
SPREAD_CUT = 5.0  # steps between quadrants, where shadows cut the light
LEAST = next(value for value, step in TABLE if step >= ALLOWED)


def slope(value):
    """Steps for each unit of film."""
    error = max(LEAST, max(value, LEAST) / 16)
    return shows(max(value, LEAST), error) / error


def film(sums):
    """Ambient light, and what sums of both moments make."""
    return AMBIENT * COLOR + COLOR * (sums[0] + sums[1])


# ---------------------------------------------------------------------------------------------- one point


class View:
    """The light as a point of the floor sees it: l = l0 + x A + y B leads to its places."""

    def __init__(self, p, wo):
        self.p, self.wo = p, wo
        self.l0 = sub(MIDDLE, p)
        self.cones = [self.cone(centre, radius) for _, centre, radius, *_ in SPHERES]

    def l(self, x, y):
        return add(self.l0, add(mul(A, x), mul(B, y)))

    def corners(self):
        return [self.l(x, y) for x, y in CORNERS]

    def moments(self, x, y):
        wi = normalize(self.l(x, y))
        h = normalize(add(wi, self.wo))
        return dot(UP, wi), dot(UP, h) ** SHININESS

    def cone(self, centre, radius):
        """(c, x, y, xx, xy, yy) of Q = (r^2 - |s|^2) |l|^2 + (l.s)^2, which is above 0 where l meets the sphere."""
        s = sub(centre, self.p)
        k = radius * radius - dot(s, s)
        ls = dot(s, self.l0), dot(s, A), dot(s, B)
        ll = (dot(self.l0, self.l0), dot(self.l0, A), dot(self.l0, B), 1.0, 0.0, 1.0)
        squares = (ls[0] * ls[0], ls[0] * ls[1], ls[0] * ls[2], ls[1] * ls[1], ls[1] * ls[2], ls[2] * ls[2])
        return [k * a + b for a, b in zip(ll, squares)]

    def sides(self):
        """Outward unit normals of the pyramid over the light."""
        q = self.corners()
        normals = [normalize(cross(q[i], q[(i + 1) % 4])) for i in range(4)]
        return [n if dot(n, self.l0) < 0 else mul(n, -1) for n in normals]

    def gap(self, sphere):
        """How far a sphere is outside of that pyramid."""
        _, centre, radius, *_ = sphere
        return max(dot(n, sub(centre, self.p)) for n in self.sides()) - radius

    def between(self):
        """Numbers of the spheres that may hide a part of the light; None if one of them hides all of it."""
        some = []
        for k, sphere in enumerate(SPHERES):
            if self.gap(sphere) <= 0:
                if all(at(self.cones[k], x, y) >= 0 for x, y in CORNERS):
                    return None
                some.append(k)
        return some


def at(q, x, y):
    c, qx, qy, xx, xy, yy = q
    return c + 2 * (x * qx + y * qy) + x * x * xx + 2 * x * y * xy + y * y * yy


def roots(a, b, c):
    """Where a t^2 + 2 b t + c is 0: none, or the smaller and the larger."""
    discriminant = b * b - a * c
    if discriminant <= 0:
        return ()
    q = -(b + math.copysign(math.sqrt(discriminant), b))
    return sorted((q / a, c / q))


def row_of(q, y):
    """a, b, c of a x^2 + 2 b x + c on row y."""
    c, qx, qy, xx, xy, yy = q
    return xx, qx + y * xy, c + y * (2 * qy + y * yy)


def breaks(q):
    """Rows at which what a sphere hides begins or ends, or crosses a side of the light."""
    c, qx, qy, xx, xy, yy = q
    tangents = roots(xy * xy - xx * yy, qx * xy - xx * qy, qx * qx - xx * c)
    found = [y for y in tangents if abs((y * xy + qx) / xx) < 1]
    for x in (-1, 1):
        found += roots(yy, qy + x * xy, c + x * (2 * qx + x * xx))
    return [y for y in found if -1 < y < 1]


class Fit:
    """Both moments over the whole light, from 5 x 5 nodes."""

    def __init__(self, view):
        self.nodes = [[view.moments(x, y) for x, _ in GAUSS_5] for y, _ in GAUSS_5]
        self.sums, self.tails = [], []
        self.rows = {}
        for m in range(2):
            v = [[moments[m] for moments in row] for row in self.nodes]
            self.sums.append(sum(GAUSS_5[i][1] * GAUSS_5[j][1] * v[j][i] for i in range(5) for j in range(5)) / 4)
            columns = [list(column) for column in zip(*v)]
            self.tails.append([self.tail(v), self.tail(columns)])

    @staticmethod
    def tail(lines):
        """The mean over the lines of |c4| + |c3| / 4."""
        total = 0.0
        for (_, weight), line in zip(GAUSS_5, lines):
            c = [
                (k + 0.5) * sum(w * legendre(k, x) * value for (x, w), value in zip(GAUSS_5, line)) for k in (3, 4)
            ]
            total += 0.5 * weight * (abs(c[1]) + abs(c[0]) / 4)
        return total

    def row(self, y, m):
        """Coefficients of x^0 to x^4 on row y."""
        if (y, m) not in self.rows:
            across = [sum(c * y**k for k, c in enumerate(LAGRANGE[j])) for j in range(5)]
            values = [sum(across[j] * self.nodes[j][i][m] for j in range(5)) for i in range(5)]
            self.rows[y, m] = [sum(values[i] * LAGRANGE[i][k] for i in range(5)) for k in range(5)]
        return self.rows[y, m]

    def stretch(self, y, m, start, end):
        """The integral along a row."""
        powers = self.row(y, m)
        return sum(c * (end ** (k + 1) - start ** (k + 1)) / (k + 1) for k, c in enumerate(powers))


class Row:
    """What of a row is seen, and what a fit says that it sends."""

    def __init__(self, view, between, fit, y):
        self.y = y
        self.hidden = {k: roots(*row_of(view.cones[k], y)) for k in between}
        assert all(view.cones[k][3] < 0 for k in between), "what is hidden is between the roots"
        self.left, begin = [], -1.0
        for low, high in sorted(interval for interval in self.hidden.values() if interval) + [(1.0, 1.0)]:
            if begin < min(low, 1.0):
                self.left.append((begin, min(low, 1.0)))
            begin = max(begin, high)
        self.sums = [sum(fit.stretch(y, m, *part) for part in self.left) for m in range(2)] if fit else None


class Panel:
    """A range of rows."""

    def __init__(self, view, between, fit, ends):
        self.view, self.between, self.fit, self.ends = view, between, fit, ends
        start, end = ends
        self.rows = [Row(view, between, fit, start + (end - start) * place) for place, _, _ in ROWS]
        share = (end - start) / 4
        self.sums = [share * sum(w * row.sums[m] for (_, w, _), row in zip(ROWS, self.rows)) for m in range(2)]
        self.coarse = [share * sum(w * row.sums[m] for (_, _, w), row in zip(ROWS, self.rows)) for m in range(2)]
        self.seen = share * sum(w * sum(b - a for a, b in row.left) for (_, w, _), row in zip(ROWS, self.rows))

    def differences(self):
        return [abs(a - b) for a, b in zip(self.sums, self.coarse)]

    def errors(self):
        """How far off the sums are taken to be."""
        pairs = zip(self.differences(), self.sums)
        return [difference * min(1.0, 4 * math.sqrt(difference / max(value, TINY))) for difference, value in pairs]

    def halves(self):
        start, end = self.ends
        middle = 0.5 * (start + end)
        return [Panel(self.view, self.between, self.fit, ends) for ends in ((start, middle), (middle, end))]


def total(parts):
    return [sum(part[m] for part in parts) for m in range(2)]


class Evaluation:
    """What of the light arrives at a point, and how that was found."""

    def __init__(self, p, wo):
        self.view = View(p, wo)
        self.between = self.view.between()
        self.sums, self.rounds = [0.0, 0.0], []
        if self.between is None:
            return
        assert len(self.between) > 0, "nothing in the way: the renderer asks fewer nodes there"
        self.fit = Fit(self.view)
        ends = sorted([-1.0, 1.0] + [y for k in self.between for y in breaks(self.view.cones[k])])
        panels = [Panel(self.view, self.between, self.fit, e) for e in zip(ends, ends[1:])]
        seen = sum(panel.seen for panel in panels)
        while panels:
            # How much an error weighs beside all that arrives, as far as that is known
            estimate = total([self.sums] + [panel.sums for panel in panels])
            weight = COLOR * slope(film(estimate)) / ALLOWED
            if not self.rounds:
                self.fit_error = weight * sum(
                    FIT_PART * tail for m in range(2) for tail in self.fit.tails[m]
                )
                assert self.fit_error < PART, "the cell would be halved"
            errors = [weight * sum(panel.errors()) for panel in panels]
            self.rounds.append((panels, errors, estimate, weight))
            self.sums = total([self.sums] + [p.sums for p, error in zip(panels, errors) if error <= PART])
            panels = [half for p, error in zip(panels, errors) if error > PART for half in p.halves()]

    def halved(self):
        return sum(error > PART for _, errors, _, _ in self.rounds for error in errors)


# ---------------------------------------------------------------------------------------------- places of the film


def floor_at(x, y):
    """Where the ray through (x, y) meets the floor, and its direction."""
    d = camera_ray(x, y)[3]
    t, _ = wall_meets(EYE, d, FLOOR)
    return add(EYE, mul(d, t)), d


def mean(vectors):
    return mul(tuple(map(sum, zip(*vectors))), 1 / len(vectors))


def node(x, y):
    p, d = floor_at(x, y)
    return Evaluation(p, mul(d, -1))


def quadrant(column, row):
    """Where the ray through the middle of a quarter of the pixel ends, and the direction to the viewer."""
    i, j = PIXEL
    end, d = floor_at(i + 0.25 + column / 2, j + 0.25 + row / 2)
    return end, mul(d, -1)


def reach_of_quadrants():
    """How far rays end from the middle of their quadrant: a quarter of the way to that of the opposite one."""
    ends = {(column, row): quadrant(column, row)[0] for column in range(2) for row in range(2)}
    return 0.25 * max(length(sub(ends[0, 0], ends[1, 1])), length(sub(ends[1, 0], ends[0, 1])))


def motion(view, reach):
    """How far a shadow's outline moves on the light, as a part of its size, within `reach` of a point; how far away the
    light is at most, how large it looks, and how far away what casts the shadow is at least."""
    far = max(length(l) for l in view.corners())
    size = 2 * dot(UP, view.l0) / length(view.l0)
    moves = []
    for sphere in SPHERES:
        _, centre, radius, *_ = sphere
        if view.gap(sphere) <= reach:
            toward = max(length(sub(centre, view.p)) - reach, radius)
            near = math.sqrt(toward * toward - radius * radius)
            t = near / far
            moves.append((2 * reach * (1 - t) / (t * size), far, size, near))
    return max(moves)


def middle_of(x, y, side):
    """The point of the floor that stands for a square of pixels, and its reach."""
    p, d = floor_at(x + side / 2, y + side / 2)
    reach = 1.01 * max(length(sub(floor_at(x + a, y + b)[0], p)) for a in (0, side) for b in (0, side))
    return View(p, mul(d, -1)), reach


def turn(view, reach):
    """How far a highlight turns within a reach: directions to the light and to the viewer, and the root of the exponent
    as it counts for half of the angle between them."""
    nearest = math.hypot(*(max(abs(way) - 1, 0) for way in (view.l0[0], view.l0[2])), dot(UP, view.l0))
    return 0.5 * (reach / nearest + reach / length(sub(EYE, view.p))) * math.sqrt(SHININESS)


def foretold(x, y, side):
    """Of the nine places of a square: what arrives there, and by how many steps the corners are wrong about it."""
    half = side / 2
    nine = [node(x + c * half, y + r * half).sums for r in range(3) for c in range(3)]
    wrong = {}
    for k, corners in {1: (0, 2), 3: (0, 6), 4: (0, 2, 6, 8), 5: (2, 8), 7: (6, 8)}.items():
        said = mean([nine[corner] for corner in corners])
        wrong[k] = shows(film(nine[k]), COLOR * sum(abs(a - b) for a, b in zip(nine[k], said)))
    return nine, wrong


def pyramid_may_meet(x, y, side, shape):
    """Whether the pyramid of rays through a square of pixels may meet a sphere or a wall."""
    d = [camera_ray(x + a, y + b)[3] for a, b in ((0, 0), (side, 0), (side, side), (0, side))]
    middle = camera_ray(x + side / 2, y + side / 2)[3]
    for i in range(4):
        n = normalize(cross(d[i], d[(i + 1) % 4]))
        n = n if dot(n, middle) < 0 else mul(n, -1)
        if len(shape) == 7:
            outside = dot(n, sub(shape[1], EYE)) > shape[2]
        else:
            _, p, e0, e1, *_ = shape
            corners = (p, add(p, e0), add(p, e1), add(add(p, e0), e1))
            outside = all(dot(n, sub(q, EYE)) > 0 for q in corners)
        if outside:
            return False
    return True


def depths(x, y, side, wall):
    """How far in front of the camera the corner rays of a square meet the plane of a wall, at least and at most."""
    rays = [camera_ray(x + a, y + b)[3] for a in (0, side) for b in (0, side)]
    all_depths = [wall_meets(EYE, d, wall)[0] * -d[2] for d in rays]
    return min(all_depths), max(all_depths)


def converged(view, between):
    """The integral of n.wi by very many rows, each cut where it is seen, without any polynomial."""
    rows, sum_of_rows = 4000, 0.0
    for k in range(rows):
        row = Row(view, between, None, -1 + 2 * (k + 0.5) / rows)
        for a, b in row.left:
            places = [(0.5 * (a + b) + 0.5 * (b - a) * x, w) for x, w in GAUSS_5]
            sum_of_rows += sum(0.5 * (b - a) * w * view.moments(x, row.y)[0] for x, w in places)
    return sum_of_rows * 2 / rows / 4


# ---------------------------------------------------------------------------------------------- the page

CELL = (736, 960)  # where the pixel's cell of 32 x 32 pixels begins
SQUARES = ((752, 976, 16), (752, 984, 8), (752, 984, 4), (752, 984, 2))  # those of the grid that hold the pixel
MOTION = 1.0  # what the grid allows, as a part of the light's size
CROSSED = 0.3  # beyond it, squares of more than two pixels have a lower tolerance
PREDICTED = (1.6, 0.56)  # the tolerance in display steps, and that lower one
FOLLOWED = 3  # the row of the first panel that is worked out, counted from 0


def line(*cells):
    """A row of a table."""
    return "| " + " | ".join(cells) + " |"


def part(interval, digits=4):
    return f"{number(interval[0], digits)} to {number(interval[1], digits)}"


def facts():
    """Every number of the page, as (what it is, how the page writes it)."""
    yield from facts_of_primary()
    yield from facts_of_grid()
    followed = Evaluation(*quadrant(0, 0))
    yield from facts_of_view(followed.view)
    yield from facts_of_fit(followed)
    yield from facts_of_rows(followed)
    yield from facts_of_panels(followed)
    yield from facts_of_pixel()


def facts_of_primary():
    light = ("light", LIGHT_CORNER, LIGHT_E0, LIGHT_E1)
    may_meet = [shape[0] for shape in SPHERES + WALLS + [light] if pyramid_may_meet(*CELL, 32, shape)]
    assert may_meet == ["back wall", "floor"]
    yield "cell", f"({CELL[0]}, {CELL[1]})"
    nearest, farthest = depths(*CELL, 32, FLOOR)
    yield "floor: depths", f"{number(nearest, 2)} to {number(farthest, 2)} m"
    yield "back wall: depth", f"{number(depths(*CELL, 32, WALLS[0])[0], 2)} m"


def facts_of_grid():
    for x, y, side in SQUARES:
        view, reach = middle_of(x, y, side)
        moves, far, size, near = motion(view, reach)
        if side == 16:
            yield "square: middle", vector(view.p)
            yield "square: reach", f"reach = {number(reach)}"
            yield "square: near", f"near  = {number(near)}"
            yield "square: far", f"far   = {number(far)}"
            yield "square: t", f"t     = near / far = {number(near / far)}"
            yield "square: size", f"size  = {number(size)}"
            yield "square: motion", f"2 reach (1 - t) / (t size) = {number(moves)}"
            yield "square: turn", number(turn(view, reach), 2)
        told = ("-", "-", "moves too far")
        if moves <= MOTION:
            nine, wrong = foretold(x, y, side)
            allowed = PREDICTED[side > 2 and moves > CROSSED]
            assert max(wrong.values()) > allowed
            told = (number(max(wrong.values()), 2), f"{allowed:g}", "not predicted")
        yield f"square of {side}", line(
            str(side), f"({x}, {y})", number(reach, 3), number(moves, 2), number(MOTION, 1), *told
        )
    for r in range(3):
        yield f"nine places, row {r}", line(*(number(nine[3 * r + c][0]) for c in range(3)))
    said = (nine[0][0] + nine[6][0]) / 2
    yield "what the corners say of the west", f"({number(nine[0][0])} + {number(nine[6][0])}) / 2 = {number(said)}"
    yield "the west", f"{number(nine[3][0])}"
    yield "steps apart", f"{number(wrong[3], 2)} display steps"


def facts_of_view(view):
    yield "p", vector(view.p)
    yield "wo", vector(view.wo)
    yield "n.wo", number(dot(UP, view.wo))
    yield "l0", f"({number(view.l0[0])}, {number(view.l0[1], 1)}, {number(view.l0[2])})"
    yield "n.l", number(dot(UP, view.l0), 1)
    for k, sphere in enumerate(SPHERES):
        gap = view.gap(sphere)
        hides = [("hidden" if at(view.cones[k], *q) >= 0 else "seen") if gap <= 0 else "-" for q in CORNERS]
        yield f"{sphere[0]}: pyramid", line(sphere[0], number(gap, 2), *hides)
    for _, p, _, _, n, _ in WALLS:
        heights = [dot(n, sub(q, p)) for q in [view.p] + [add(view.p, l) for l in view.corners()]]
        assert min(heights) > -1e-9, "the point and the light are on one side of each wall"
    nearest = math.hypot(*(max(abs(way) - 1, 0) for way in (view.l0[0], view.l0[2])), view.l0[1])
    yield "distance of the light", f"{number(nearest, 2)} m"
    yield "how wide it is", f"{number(math.sqrt(2) / nearest, 2)}"


def facts_of_fit(followed):
    fit = followed.fit
    yield "nodes", line("", *(f"x = {number(x, 3)}" for x, _ in GAUSS_5))
    for (y, _), row in zip(GAUSS_5, fit.nodes):
        yield "row of nodes", line(f"y = {number(y, 3)}", *(number(moments[0]) for moments in row))
    yield "mean of n.wi, unhidden", number(fit.sums[0], 5)
    yield "mean of (n.h)^s, unhidden", number(fit.sums[1], 5)
    for m, moment in enumerate(("n.wi", "(n.h)^16")):
        yield f"{moment}: tails", line(f"`{moment}`", *(number(1e6 * tail, 1) for tail in fit.tails[m]))


def facts_of_rows(followed):
    view = followed.view
    assert followed.between == [0, 1]
    for k, name in ((0, "blue and white"), (1, "olive and pink")):
        (y,) = breaks(view.cones[k])
        yield f"{name}: break row", f"{number(y)}"
        c, qx, qy, xx, xy, yy = view.cones[k]
        s = sub(SPHERES[k][1], view.p)
        yield f"{name}: s", vector(s)
        yield f"{name}: r^2 - |s|^2", number(SPHERES[k][2] ** 2 - dot(s, s), 3)
    panels = followed.rounds[0][0]
    assert all(panel.sums == [0, 0] for panel in panels[1:])
    yield "panels", f"{part(panels[0].ends)}, {part(panels[1].ends)} and {part(panels[2].ends)}"
    row = panels[0].rows[FOLLOWED]
    yield "followed row", f"y = {number(row.y)}"
    for k, name in ((0, "blue and white"), (1, "olive and pink")):
        a, b, c = row_of(view.cones[k], row.y)
        numbers = number(a, 3), number(b, 3), number(c, 3)
        yield f"{name}: on the row", line(name, *numbers, part(row.hidden[k]))
    (left,) = row.left
    yield "left of the row", part(left)
    powers = followed.fit.row(row.y, 0)
    antiderivative = [c / (k + 1) for k, c in enumerate(powers)]
    terms = "".join(
        f" {'+' if c >= 0 else '-'} {number(abs(c), 6)} x^{k + 1}" for k, c in enumerate(antiderivative) if k > 0
    )
    yield "antiderivative", f"F(x) = {number(antiderivative[0], 6)} x{terms}"
    ends = [sum(c * x ** (k + 1) for k, c in enumerate(antiderivative)) for x in left]
    yield "integral of the row", (
        f"F({number(left[1])}) - F({number(left[0])}) = {number(ends[1], 5)} - {number(ends[0], 5)}"
        f" = {number(row.sums[0], 5)}"
    )


def facts_of_panels(followed):
    panels, errors, estimate, weight = followed.rounds[0]
    panel = panels[0]
    for row, (_, fine, coarse) in zip(panel.rows, ROWS):
        blue, olive = (part(row.hidden[k], 3) for k in (0, 1))
        left = part(row.left[0], 3) if row.left else "nothing"
        coarse = number(coarse, 4) if coarse else ""
        yield "row of the panel", line(number(row.y), blue, olive, left, number(row.sums[0], 5), number(fine), coarse)
    low, high = panel.ends
    bisected = (low, high)
    for _ in range(60):
        y = 0.5 * sum(bisected)
        bisected = (y, bisected[1]) if Row(followed.view, followed.between, None, y).left else (bisected[0], y)
    yield "where the strip ends", f"y = {number(y, 3)}"
    yield "height of the panel over 4", number((high - low) / 4, 5)
    for m, moment in enumerate(("`n.wi`", "`(n.h)^16`")):
        error = panel.errors()[m]
        numbers = panel.sums[m], panel.coarse[m], panel.differences()[m], error
        yield f"{moment}: both rules", line(moment, *(number(n, 6) for n in numbers))
    yield "value", number(film(estimate), 4)
    yield "slope", number(slope(film(estimate)), 0)
    yield "weight", number(weight, 0)
    yield "fit: share", number(followed.fit_error, 4)
    yield "first panel: share", number(errors[0], 3)
    assert errors[0] > PART and len(followed.rounds) == 2
    halves, errors, _, _ = followed.rounds[1]
    for half, error in zip(halves, errors):
        assert error <= PART
        yield "half of the panel", line(part(half.ends), *(number(n, 6) for n in half.sums), number(error, 3))
    yield "sum of n.wi", number(followed.sums[0], 5)
    yield "sum of (n.h)^16", number(followed.sums[1], 5)
    truth = converged(followed.view, followed.between)
    yield "converged", number(truth, 5)
    yield "steps off", f"{number(abs(truth - followed.sums[0]) * COLOR * slope(film(followed.sums)), 3)} steps"


def facts_of_pixel():
    i, j = PIXEL
    fours = [quadrant(c, r) for r in range(2) for c in range(2)]
    quadrants = [Evaluation(*place) for place in fours]
    for r in range(2):
        yield "quadrants", line(*(number(q.sums[0], 5) for q in quadrants[2 * r : 2 * r + 2]))
    yield "quadrants with a halved panel", str(sum(q.halved() for q in quadrants))
    most, least = ([of(q.sums[m] for q in quadrants) for m in range(2)] for of in (max, min))
    apart = COLOR * sum(a - b for a, b in zip(most, least))
    spread_of_quadrants = shows(film(most), apart)
    assert spread_of_quadrants > SPREAD_CUT
    reach = reach_of_quadrants()
    moves = [motion(q.view, reach)[0] for q in quadrants]
    yield "motion over a quadrant", f"at most {number(max(moves), 3)}"
    yield "brightest quadrant: film", number(film(most), 4)
    yield "quadrants apart", f"{number(spread_of_quadrants, 2)} display steps"
    rays = [node(x, y) for x, y in sub_samples(i, j)]
    for r in range(4):
        yield "rays", line(*(number(e.sums[0], 4) for e in rays[4 * r : 4 * r + 4]))
    yield "rays with a halved panel", str(sum(e.halved() for e in rays))
    sums = [s / 16 for s in total([e.sums for e in rays])]
    yield "mean of n.wi", number(sums[0], 5)
    yield "mean of (n.h)^16", number(sums[1], 5)
    yield "ambient", line("ambient", "0.1 x 0.7", number(AMBIENT * COLOR, 5))
    yield "diffuse", line("diffuse", f"0.7 x {number(sums[0], 5)}", number(COLOR * sums[0], 5))
    yield "highlight", line("highlight", f"0.7 x {number(sums[1], 5)}", number(COLOR * sums[1], 5))
    yield "film", number(film(sums), 5)
    shown = encode(film(sums))
    yield "encoded", f"255 x {number(film(sums), 5)}^(1/2.2) = {number(shown, 2)}"
    byte = math.floor(shown + 0.5)
    yield "the pixel's bytes", f"({byte}, {byte}, {byte})"
    yield "as a colour", "#" + 3 * f"{byte:02x}"
    yield "by quadrants", number(encode(film([s / 4 for s in total([q.sums for q in quadrants])])), 2)
    truth = sum(converged(e.view, e.between) for e in rays) / 16
    yield "converged", number(encode(film([truth, sums[1]])), 2)
    sampled = encode(pixel(i, j)[3][0])
    yield "by 400 points", number(sampled, 2)
    yield "by 400 points, byte", str(math.floor(sampled + 0.5))


if __name__ == "__main__":
    sys.exit(main(facts(), "default-pixel.md", __doc__))

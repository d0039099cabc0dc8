//! The test of a solid against a light, for sixteen points.

use fearless_simd::{f32x16, prelude::*};

use super::{LightPyramid16, OccluderTest, SLACK};
use crate::integrate::batch::Exact;
use crate::integrate::emitter::Emitter;
use crate::integrate::hull::SolidOccluder;
use crate::integrate::occluder::{Occluder, Shadow};
use crate::material::ShadingPoint;
use crate::math::{DAffine3, DMat3, DVec3, LANES, Vec3x16};
use crate::shape::{Canonical, Placement, Solid, Sphere, SphereUv};

/// A solid in the world: convex, or with a straight hole.
pub(super) struct PlacedSolid {
    placement: Placement,
    solid: Solid,
    kind: Canonical,
    canonical_from_world: DAffine3,
    /// Its bounding box, if it is bounded.
    bounds: Option<[DVec3; 2]>,
    /// Whether a part of the light may be inside, and whether all is.
    pub may_contain_light: bool,
    contains: bool,
}

/// The sphere that a placed solid is, if it is one in the world as well.
pub(super) fn sphere(solid: &Solid, placement: &Placement) -> Option<Sphere> {
    let (object_from_canonical, Canonical::Ball) = solid.canonical()? else { return None };
    let DAffine3 { matrix3, translation } = placement.world_from_object * object_from_canonical;
    let product = matrix3.transpose() * matrix3;
    let r2 = product.x_axis.x;
    let [x, y, z] = (product - DMat3::from_diagonal(DVec3::splat(r2))).to_cols_array_2d().map(DVec3::from);
    let off = x.abs().max(y.abs()).max(z.abs()).max_element();
    let uv = SphereUv::Angles;
    (off <= r2 * ROUND).then(|| Sphere { c: translation, r: r2.sqrt(), uv, single_sided: false })
}

/// As a part: the largest variation of a sphere's squared radius with the direction.
const ROUND: f64 = 1e-12;

/// The distance of a point to a box, in metres.
fn distance([low, high]: &[DVec3; 2], p: DVec3) -> f64 {
    (*low - p).max(p - *high).max(DVec3::ZERO).length()
}

impl PlacedSolid {
    /// `None` if the projection has no closed form.
    pub fn new(solid: Solid, placement: Placement, emitter: &Emitter) -> Option<(PlacedSolid, SolidOccluder)> {
        let (object_from_canonical, kind) = solid.canonical()?;
        let world_from_canonical = placement.world_from_object * object_from_canonical;
        let bounds = solid.bounds().map(|bounds| placement.bounds(bounds));
        let canonical_from_world = world_from_canonical.inverse();
        let mut made = PlacedSolid {
            placement,
            solid,
            kind,
            canonical_from_world,
            bounds,
            may_contain_light: false,
            contains: emitter.corners().iter().all(|q| kind.holds(canonical_from_world.transform_point3(*q), ROUNDING)),
        };
        made.may_contain_light = made.touches(emitter);
        let occluder = SolidOccluder::new(&world_from_canonical, kind, made.may_contain_light);
        Some((made, occluder))
    }

    fn touches(&self, emitter: &Emitter) -> bool {
        match emitter {
            Emitter::Ball { center, radius, .. } | Emitter::Face { center, radius, .. } => {
                self.apart(*center) < *radius
            }
            // What is flat has no inside
            Emitter::Flat(_) if self.kind.is_flat() => false,
            Emitter::Flat(flat) if self.apart(flat.c) > f64::from(flat.a.length() + flat.b.length()) => false,
            Emitter::Flat(flat) => {
                let Some([low, high]) = self.bounds else { return true };
                let (a, b) = (flat.a.as_dvec3(), flat.b.as_dvec3());
                let reach = a.abs() + b.abs();
                let is_apart = (flat.c + reach).cmplt(low).any() || (flat.c - reach).cmpgt(high).any();
                // All of it on one side of the light's plane
                let n = flat.n.as_dvec3();
                let plane = n.dot(flat.c);
                !is_apart && self.reach(n) > plane && self.reach(-n) > -plane
            }
        }
    }

    /// The support function: the largest n.q of its points q.
    pub fn reach(&self, n: DVec3) -> f64 {
        let to_world = &self.placement.world_from_object;
        self.solid.support(to_world.matrix3.transpose() * n) + n.dot(to_world.translation)
    }

    /// The distance of a point from the plane of a flat solid, in metres.
    fn height(&self, p: DVec3) -> f64 {
        let row = self.canonical_from_world.matrix3.transpose().z_axis;
        self.canonical_from_world.transform_point3(p).z / row.length()
    }

    /// Lower bound of the distance to a point, in metres.
    fn apart(&self, p: DVec3) -> f64 {
        self.bounds.as_ref().map_or_else(|| self.height(p).abs(), |bounds| distance(bounds, p))
    }

    /// Whether a point is in the plane of a flat solid within rounding, and its surface is parallel to it.
    fn is_under(&self, point: &ShadingPoint) -> bool {
        let row = self.canonical_from_world.matrix3.transpose().z_axis;
        let at = self.canonical_from_world.transform_point3(point.p.as_dvec3());
        // What a point is on is met to within its rounding, and that of the way along the plane
        let room = 2.0 * row.abs().dot(point.error.0.as_dvec3()) + 4e-7 * at.truncate().length();
        let is_along = || row.cross(point.horizon.as_dvec3()).length() <= f64::from(SLACK) * row.length();
        self.kind.is_flat() && at.z.abs() <= room && is_along()
    }
}

/// In the solid's own units: points no farther outside are on its surface, within the rounding of f32.
const ROUNDING: f64 = 1e-6;

/// Where a solid is, as seen from a point and the places within its reach.
enum Lies {
    /// It hides nothing.
    Aside,
    /// It hides nothing from the point, but may from a place within reach.
    Near,
    /// The point and all places within reach are inside.
    Inside,
    /// The point is inside, and a place within reach may be outside.
    NearlyInside,
    Between,
}

impl PlacedSolid {
    fn lies(&self, point: &ShadingPoint) -> Lies {
        let p = point.p.as_dvec3();
        let far = match &self.bounds {
            Some([low, high]) => (*low - p).abs().max((*high - p).abs()).length(),
            None => p.length(),
        };
        let (n, error) = (point.horizon.as_dvec3(), point.error.0.as_dvec3());
        let room = f64::from(SLACK) * far + 2.0 * n.abs().dot(error);
        let above = self.reach(n) - n.dot(p);
        let around = f64::from(point.reach) + f64::from(point.turn) * (far + f64::from(point.reach));
        if above < -(room + around) || self.is_under(point) {
            Lies::Aside
        } else if above < -room {
            Lies::Near
        } else if above <= room {
            // It touches the horizon: what the point is on, for one
            Lies::Aside
        } else {
            let at = self.canonical_from_world.transform_point3(p);
            let rows = self.canonical_from_world.matrix3.transpose();
            let size = |v: DVec3| [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.abs().dot(v));
            let largest = |sizes: [f64; 3]| sizes.into_iter().fold(0.0, f64::max);
            let room = ROUNDING + 2.0 * largest(size(error));
            if !self.kind.holds(at, room) {
                Lies::Between
            } else if self.is_left(at, n, room) {
                Lies::Aside
            } else if self.surrounds(point, room + largest(size(DVec3::splat(f64::from(point.turn * point.reach))))) {
                Lies::Inside
            } else {
                Lies::NearlyInside
            }
        }
    }

    /// Whether a point on the surface or inside, at `at` in the solid's own space, is left along the normal `n` of its
    /// horizon: then the point is on a face of the solid, however the normal is rounded.
    fn is_left(&self, at: DVec3, n: DVec3, room: f64) -> bool {
        let way = self.canonical_from_world.transform_vector3(n);
        let step = way * (8.0 * room / way.abs().max_element());
        !self.kind.has_hole() && !self.kind.holds(at, -room) && !self.kind.holds(at + step, room)
    }

    /// Whether all places within reach of a point are inside, within `room`.
    fn surrounds(&self, point: &ShadingPoint, room: f64) -> bool {
        let reach = f64::from(point.reach);
        if reach == 0.0 {
            return true;
        }
        // A square around them: what is convex holds all of it with its corners
        let (n, p) = (point.horizon.as_dvec3(), point.p.as_dvec3());
        let u = n.any_orthonormal_vector() * reach;
        let v = n.cross(u);
        let corners = [u + v, u - v, v - u, -u - v];
        corners.iter().all(|way| self.kind.holds(self.canonical_from_world.transform_point3(p + *way), room))
    }
}

/// Tests a solid for the points in `lanes`.
#[inline(always)]
pub(super) fn test_solid<S: Simd>(
    simd: S,
    pyramid: &LightPyramid16<S>,
    shape: &PlacedSolid,
    occluder: &Occluder,
    points: &[ShadingPoint],
    lanes: u64,
) -> OccluderTest<S> {
    let zero = simd.splat_f32x16(0.0);
    let mut test = OccluderTest::nothing(zero);
    let (mut around, mut near) = (lanes, lanes);
    if let Some([low, high]) = shape.bounds {
        let s: Vec3x16<S> = Exact::new((low + high) * 0.5).seen_from(simd, pyramid.p);
        [around, near] = pyramid.meets(s, s.dot(s).sqrt(), ((high - low).length() * 0.5) as f32, lanes);
    }
    if around == 0 {
        return test;
    }
    let mut distances = [0.0f32; LANES];
    let (mut hidden, mut firm) = (0, 0);
    for (k, point) in points.iter().enumerate() {
        let bit = 1 << k;
        if around & bit == 0 {
            continue;
        }
        match shape.lies(point) {
            Lies::Aside => {
                around &= !bit;
                near &= !bit;
            }
            Lies::Near => near &= !bit,
            lies @ (Lies::Inside | Lies::NearlyInside) => {
                near &= !bit;
                if shape.kind.has_hole() || shape.may_contain_light && !shape.contains {
                    test.other |= bit;
                    continue;
                }
                // All of the light is inside, or none of it
                hidden |= if shape.contains { 0 } else { bit };
                if matches!(lies, Lies::Inside) {
                    around &= !bit;
                    firm |= bit;
                }
            }
            Lies::Between => {
                distances[k] = (shape.apart(point.p.as_dvec3()) as f32 - point.reach).max(0.0);
            }
        }
    }
    near &= around;
    (test.hidden, test.firm) = (hidden, hidden & firm);
    if around == 0 {
        return test;
    }
    let shadow = Shadow::new(simd, occluder, pyramid.p, &pyramid.light_vectors);
    if shape.kind == Canonical::Plane && pyramid.depth == 0.0 {
        // From within reach no more of the light is beyond a plane than from the point, if that is farther off
        let mut some = 0;
        for [x, y] in pyramid.square() {
            some |= shadow.hides(x, y).to_bitmask();
        }
        let close = f32x16::simd_from(simd, distances).simd_le(zero).to_bitmask();
        near &= some;
        around &= some | close;
    }
    test.moving = around & pyramid.reach.simd_gt(zero).to_bitmask();
    test.motion = pyramid.motion(f32x16::simd_from(simd, distances));
    if !shape.kind.has_hole() {
        // It is convex: what hides all corners hides all
        test.hidden |= pyramid.hidden(&shadow, near);
        test.firm |= test.hidden & !test.moving;
    }
    test.other |= if shape.may_contain_light && shape.kind.has_hole() && !shape.kind.is_flat() { near } else { 0 };
    test.outside = near & !test.hidden;
    test
}

//! Occluders of an area light, tested against the whole light for sixteen points at once.
//!
//! With reach 0 the result is the visibility of the light from a point: full, none, or the occluders that may hide
//! a part. With a reach it is a proof for all places within it, and a bound on how far a silhouette moves on the
//! light between the point and any of them.

mod flat;
mod light_contact;
mod solid;

use fearless_simd::{f32x16, prelude::*};

use super::batch::{
    Exact, FrameLanes, FrameNumber, LightFrame16, Linear16, light_vectors, point_numbers, point_vectors,
};
use super::emitter::Emitter;
use super::hull::SolidOccluder;
use super::occluder::{Occluder, Shadow, corners_from};
use super::panels::{MAX_INTERVALS, OccluderMask};
use crate::ids::LightId;
use crate::material::ShadingPoint;
use crate::math::{DAffine3, LANES, Vec3x16};
use crate::scene::{PlacedTarget, Scene};
use crate::shape::{Parallelogram, Placement, PlaneSide, Solid, Sphere};
use flat::test_parallelogram;
use light_contact::{LightContact, LightSides};
use solid::{PlacedSolid, test_solid};

/// All occluders of one light.
#[derive(Default)]
pub(crate) struct LightOccluders<'a> {
    /// For projection onto the light, and for exact tests; with equal indices.
    pub occluders: Vec<Occluder>,
    exact: Vec<ExactShape<'a>>,
    /// Whether each intersects or contains a sphere light.
    contacts: Vec<LightContact>,
    /// The sides of a flat light's plane that each reaches into.
    sides: Vec<LightSides>,
    /// The indices of the placed solids among them.
    placed: Vec<u32>,
    /// Whether some did not fit.
    has_more: bool,
}

/// The shape of an occluder in f64.
enum ExactShape<'a> {
    Sphere(Sphere),
    Flat {
        flat: &'a Parallelogram,
        /// The side of the plane on which all of the light is.
        side: PlaneSide,
        /// The same if the camera is there too: then no point behind the plane is visible.
        seen_side: PlaneSide,
    },
    Solid(Box<PlacedSolid>),
}

/// The most occluders of a light, listed ones and those in trees together: the bits of a mask.
pub(crate) const MAX_OCCLUDERS: usize = 64;

impl<'a> LightOccluders<'a> {
    /// Those of light `index` that are listed, and solids.
    pub fn new(scene: &'a Scene, index: usize, emitter: &Emitter) -> LightOccluders<'a> {
        let id = LightId(index as u32);
        let mut all = LightOccluders::default();
        if !scene.lights[index].shadows {
            return all;
        }
        let listed = &scene.occluders;
        for (_, sphere) in scene.that_stop(&listed.spheres, id) {
            all.sphere(&sphere.shape);
        }
        let sides = listed.sides(id);
        for (i, flat) in scene.that_stop(&listed.flats, id) {
            let side = sides.get(i).copied().unwrap_or(PlaneSide::Both);
            let seen_side = if listed.flats_seen.get(i) == Some(&true) { side } else { PlaneSide::Both };
            all.flat(&flat.shape, side, seen_side);
        }
        for (_, disk) in scene.that_stop(&listed.disks, id) {
            all.solid(PlacedSolid::new(Solid::Disk(disk.shape), Placement::new(DAffine3::IDENTITY), emitter));
        }
        all.has_more = all.occluders.len() > MAX_OCCLUDERS;
        all.occluders.truncate(MAX_OCCLUDERS);
        all.exact.truncate(MAX_OCCLUDERS);
        for (k, thing) in scene.geometry.placed.iter().enumerate() {
            let PlacedTarget::Solid(solid) = thing.target else { continue };
            // What is not opaque is met by rays only
            let is_left_out = thing.layered || !scene.geometry.stops(thing.shadow, id);
            if is_left_out || all.occluders.len() == MAX_OCCLUDERS {
                continue;
            }
            let solid = scene.geometry.solids[solid as usize];
            match solid::sphere(&solid, &thing.placement) {
                Some(sphere) => all.sphere(&sphere),
                None if all.solid(PlacedSolid::new(solid, thing.placement, emitter)) => {}
                None => continue,
            }
            all.placed.push(k as u32);
        }
        all.add_contacts(emitter);
        all
    }

    fn sphere(&mut self, sphere: &Sphere) {
        self.occluders.push(Occluder::Sphere { center: Exact::new(sphere.c), radius: sphere.r as f32 });
        self.exact.push(ExactShape::Sphere(*sphere));
    }

    fn flat(&mut self, flat: &'a Parallelogram, side: PlaneSide, seen_side: PlaneSide) {
        self.occluders.push(Occluder::Flat { corners: flat.deep_corners().map(Exact::new) });
        self.exact.push(ExactShape::Flat { flat, side, seen_side });
    }

    /// Computes the contacts and sides of all.
    fn add_contacts(&mut self, emitter: &Emitter) {
        self.contacts.extend(self.exact.iter().map(|exact| LightContact::of(emitter, exact)));
        self.sides.extend(self.exact.iter().map(|exact| LightSides::of(emitter, exact)));
    }

    /// Adds a solid if its projection has a closed form.
    fn solid(&mut self, solid: Option<(PlacedSolid, SolidOccluder)>) -> bool {
        let Some((shape, occluder)) = solid else { return false };
        self.occluders.push(Occluder::Solid(occluder));
        self.exact.push(ExactShape::Solid(Box::new(shape)));
        true
    }

    /// Each occluder, with its sides of the light and its contact with it.
    #[inline(always)]
    fn each(&self) -> impl Iterator<Item = (&Occluder, &ExactShape<'a>, LightSides, LightContact)> {
        let all = self.occluders.iter().zip(&self.exact).zip(self.sides.iter().zip(&self.contacts));
        all.map(|((occluder, exact), (sides, contact))| (occluder, exact, *sides, *contact))
    }

    /// Whether placed object `thing` is among them.
    pub fn has_placed(&self, thing: u32) -> bool {
        self.placed.binary_search(&thing).is_ok()
    }
}

#[cfg(test)]
impl<'a> LightOccluders<'a> {
    /// Spheres alone, and parallelograms.
    pub fn of(spheres: &'a [Sphere], flats: &'a [Parallelogram], emitter: &Emitter) -> LightOccluders<'a> {
        let mut listed = LightOccluders::default();
        spheres.iter().for_each(|sphere| listed.sphere(sphere));
        flats.iter().for_each(|flat| listed.flat(flat, PlaneSide::Both, PlaneSide::Both));
        listed.add_contacts(emitter);
        listed
    }
}

/// The occlusion of a light from a point and its surroundings.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OcclusionClass {
    /// The occluders that may hide a part of the light from the point.
    pub mask: OccluderMask,
    /// Whether the point is in the umbra.
    pub hidden: bool,
    /// Whether an occluder has no closed form here.
    pub other: bool,
    /// The largest motion of a silhouette on the light between the point and a place within its reach, as a part of the
    /// light's size; 0 if all those places are proved to be in full light or in the umbra.
    pub motion: f32,
}

/// As a part of a distance: a bound of its rounding.
const SLACK: f32 = 1e-5;

/// The pyramid with its apex at a point that is bounded by a light's edges, and the cone around it, for sixteen points.
struct LightPyramid16<S: Simd> {
    p: Vec3x16<S>,
    light_vectors: [Vec3x16<S>; 3],
    x: [f32x16<S>; 2],
    y: [f32x16<S>; 2],
    /// Outward unit normals of the pyramid's sides.
    sides: [Vec3x16<S>; 4],
    axis: Vec3x16<S>,
    sin: f32x16<S>,
    cos: f32x16<S>,
    far: f32x16<S>,
    /// The least size of the light across the line of sight, in metres.
    size: f32x16<S>,
    normal: Vec3x16<S>,
    horizon: Vec3x16<S>,
    /// The error bound of each point.
    error: Vec3x16<S>,
    reach: f32x16<S>,
    turn: f32x16<S>,
    /// In metres: occluders so far behind the light's plane count.
    depth: f32,
}

/// The unit vector, or 0 where `v` is 0.
#[inline(always)]
fn unit<S: Simd>(v: Vec3x16<S>) -> Vec3x16<S> {
    let length2 = v.dot(v);
    let simd = length2.token();
    let is_long = length2.simd_gt(f32::MIN_POSITIVE);
    let inverse = 1.0 / is_long.select(length2, simd.splat_f32x16(1.0)).sqrt();
    v * is_long.select(inverse, simd.splat_f32x16(0.0))
}

/// The vector from the point to a place of the light.
#[inline(always)]
fn way<S: Simd>(l: &[Vec3x16<S>; 3], x: f32x16<S>, y: f32x16<S>) -> Vec3x16<S> {
    l[0] + (l[1] * x + l[2] * y)
}

impl<S: Simd> LightPyramid16<S> {
    #[inline(always)]
    fn new(simd: S, frames: &LightFrame16, points: &[ShadingPoint]) -> LightPyramid16<S> {
        use FrameNumber::*;
        let l = light_vectors(simd, frames);
        let (x, y) =
            ([frames.lanes(simd, X0), frames.lanes(simd, X1)], [frames.lanes(simd, Y0), frames.lanes(simd, Y1)]);
        let corners = [way(&l, x[0], y[0]), way(&l, x[1], y[0]), way(&l, x[1], y[1]), way(&l, x[0], y[1])];
        let middle = way(&l, (x[0] + x[1]) * 0.5, (y[0] + y[1]) * 0.5);
        let zero = simd.splat_f32x16(0.0);
        let turns = corners[0].cross(corners[1]).dot(corners[2]).simd_gt(zero);
        let sign = turns.select(simd.splat_f32x16(-1.0), simd.splat_f32x16(1.0));
        let mut sides = corners;
        for (i, side) in sides.iter_mut().enumerate() {
            *side = unit(corners[i].cross(corners[(i + 1) % 4])) * sign;
        }
        let (one, other) = (corners[1] - middle, corners[2] - middle);
        let radius = one.dot(one).max(other.dot(other)).sqrt();
        let distance = middle.dot(middle).sqrt().max(simd.splat_f32x16(f32::MIN_POSITIVE));
        let sin = (radius / distance).min(simd.splat_f32x16(1.0));
        let mut far = zero;
        for l in &corners {
            far = far.max(l.dot(*l));
        }
        let far = far.sqrt();
        let slant = frames.lanes(simd, Height) / distance;
        let size = frames.lanes(simd, La).min(frames.lanes(simd, Lb)) * slant.max(simd.splat_f32x16(0.02)) * 2.0;
        LightPyramid16 {
            p: frames.vectors(simd, [Px, Py, Pz]),
            light_vectors: l,
            x,
            y,
            sides,
            axis: middle * (1.0 / distance),
            sin,
            cos: (1.0 - sin * sin).sqrt(),
            far,
            size,
            normal: unit(l[1].cross(l[2])),
            horizon: point_vectors(simd, points, |point| point.horizon),
            error: point_vectors(simd, points, |point| point.error.0),
            reach: point_numbers(simd, points, |point| point.reach),
            turn: point_numbers(simd, points, |point| point.turn),
            depth: 0.0,
        }
    }

    /// The largest distance of the convex hull of `hull` outside of a side of the pyramid.
    #[inline(always)]
    fn gap(&self, hull: &[Vec3x16<S>]) -> f32x16<S> {
        let mut gap = self.far.token().splat_f32x16(f32::NEG_INFINITY);
        for n in &self.sides {
            let mut least = n.dot(hull[0]);
            for q in &hull[1..] {
                least = least.min(n.dot(*q));
            }
            gap = gap.max(least);
        }
        gap
    }

    /// Of the points in `of`: those from which some of the light's square is on the inner side of each line, the first
    /// of which is the occluder's plane, and those from which all of it is on the inner side of all.
    #[inline(always)]
    fn covered(&self, lines: &[Linear16<S>; 5], of: u64) -> [u64; 2] {
        let zero = self.far.token().splat_f32x16(0.0);
        let (mut some, mut all) = (of, if self.depth > 0.0 { 0 } else { of });
        for line in &lines[usize::from(self.depth > 0.0)..] {
            let Linear16 { c, x, y } = *line;
            let ([left, right], [low, high]) = (self.x, self.y);
            let most = c + (left * x).max(right * x) + (low * y).max(high * y);
            let least = c + (left * x).min(right * x) + (low * y).min(high * y);
            some &= most.simd_ge(zero).to_bitmask();
            all &= least.simd_ge(zero).to_bitmask();
        }
        [some, some & all]
    }

    /// The corners of the light's square.
    #[inline(always)]
    fn square(&self) -> [[f32x16<S>; 2]; 4] {
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    /// Of the points in `of`: those from which all corners of the light are hidden.
    #[inline(always)]
    fn hidden(&self, shadow: &Shadow<S>, of: u64) -> u64 {
        let mut hidden = of;
        for [x, y] in self.square() {
            if hidden != 0 {
                hidden &= shadow.hides(x, y).to_bitmask();
            }
        }
        hidden
    }

    /// Of the points in `of`: those for which the ball of radius `r` around `s` may be between the light and some place
    /// within reach, and those for which it may be between the light and the point itself.
    #[inline(always)]
    fn meets(&self, s: Vec3x16<S>, distance: f32x16<S>, r: f32, of: u64) -> [u64; 2] {
        if of == 0 {
            return [0; 2];
        }
        let simd = distance.token();
        let zero = simd.splat_f32x16(0.0);
        // The cone around the light, and its pyramid
        let along = s.dot(self.axis);
        let aside = (distance * distance - along * along).max(zero).sqrt();
        // The cone around the light, and its pyramid
        let misses = (aside * self.cos - along * self.sin)
            .simd_gt((self.reach + r) * 1.001 + (along.abs() + aside) * SLACK)
            & self.sin.simd_lt(1.0);
        let mut around = of & !misses.to_bitmask();
        if around == 0 {
            return [0; 2];
        }
        let mut gap = simd.splat_f32x16(f32::NEG_INFINITY);
        for n in &self.sides {
            gap = gap.max(n.dot(s));
        }
        let gap = gap - r;
        let rounding = distance * SLACK;
        // Behind the light's plane
        let to_plane = self.normal.dot(self.light_vectors[0]);
        let beyond = (self.normal.dot(s) - to_plane)
            * to_plane.simd_lt(zero).select(simd.splat_f32x16(-1.0), simd.splat_f32x16(1.0));
        let far = r + self.depth;
        around &= gap.simd_le(rounding + self.reach).to_bitmask() & !beyond.simd_gt(self.reach + far).to_bitmask();
        [around, around & gap.simd_le(rounding).to_bitmask() & !beyond.simd_gt(far).to_bitmask()]
    }

    /// The motion of the silhouette on the light of an occluder at distance `near`, as a part of the light's size.
    #[inline(always)]
    fn motion(&self, near: f32x16<S>) -> f32x16<S> {
        let simd = near.token();
        let t = (near / self.far).max(simd.splat_f32x16(1e-6)).min(simd.splat_f32x16(1.0));
        self.reach * 2.0 * (1.0 - t) / (t * self.size)
    }
}

/// The occlusion of a light from the points in `lanes`, of up to sixteen whose coordinates are in `frames`. To be
/// called within `vectorize`.
#[inline(always)]
pub(crate) fn classify<S: Simd>(
    simd: S,
    listed: &LightOccluders,
    emitter: &Emitter,
    frames: &LightFrame16,
    points: &[ShadingPoint],
    mut lanes: u64,
) -> [OcclusionClass; LANES] {
    let mut classes = [OcclusionClass::default(); LANES];
    if lanes == 0 {
        return classes;
    }
    let mut pyramid = LightPyramid16::new(simd, frames, points);
    let places = LightSides::of_points(emitter, points);
    for (i, (occluder, exact, sides, contact)) in listed.each().enumerate() {
        if lanes == 0 {
            break;
        }
        let before = lanes & sides.of_these(places);
        if before == 0 {
            continue;
        }
        // An occluder that intersects a sphere light may hide some of its far half
        pyramid.depth = match emitter {
            Emitter::Ball { radius, both_sides: true, .. } if contact == LightContact::Intersects => {
                2.0 * *radius as f32
            }
            // From inside nothing else is between
            Emitter::Face { .. } if contact != LightContact::Intersects => continue,
            Emitter::Ball { .. } | Emitter::Flat(_) | Emitter::Face { .. } => 0.0,
        };
        let mut test = match (occluder, exact) {
            (Occluder::Sphere { center, radius }, ExactShape::Sphere(sphere)) => {
                test_sphere(simd, &pyramid, center.seen_from(simd, pyramid.p), *radius, sphere, points, before)
            }
            (Occluder::Flat { corners }, ExactShape::Flat { flat, side, seen_side }) => {
                let corners = corners_from(simd, corners, pyramid.p);
                test_parallelogram(simd, &pyramid, corners, (flat, *side, *seen_side), points, before)
            }
            (Occluder::Solid(_), ExactShape::Solid(shape)) => {
                test_solid(simd, &pyramid, shape, occluder, points, before)
            }
            _ => unreachable!("both lists hold the same things"),
        };
        // The visible part of the sphere is not that of its disk
        if contact == LightContact::Intersects {
            // Of the ball more may be seen than of its disk, and of its far half less
            test.other |= test.outside | test.within | test.around | test.hidden;
            (test.outside, test.within, test.hidden, test.firm) = (0, 0, 0, 0);
        }
        if (test.outside | test.within | test.hidden | test.moving | test.other) & lanes == 0 {
            continue;
        }
        if contact == LightContact::Contains {
            test.hidden |= test.outside;
            (test.outside, test.within) = (0, 0);
        }
        let motion = test.motion.to_array();
        for (k, class) in classes.iter_mut().enumerate().take(points.len()) {
            if lanes >> k & 1 == 0 {
                continue;
            }
            if test.moving >> k & 1 == 1 {
                class.motion = class.motion.max(motion[k]);
            }
            if test.hidden >> k & 1 == 1 {
                class.hidden = true;
                if test.firm >> k & 1 == 1 {
                    class.motion = 0.0;
                }
                lanes &= !(1 << k);
                continue;
            }
            class.other |= test.other >> k & 1 == 1;
            class.mask.outside |= (test.outside >> k & 1) << i;
            class.mask.within |= (test.within >> k & 1) << i;
        }
    }
    for class in &mut classes {
        let OccluderMask { outside, within } = class.mask;
        let many = 2 * (outside.count_ones() + within.count_ones()) as usize;
        class.other |= many > MAX_INTERVALS || listed.has_more;
    }
    classes
}

/// The test of one occluder against the light, as bits of sixteen points.
struct OccluderTest<S: Simd> {
    /// It may hide a part of the light from a point outside of it, or within it.
    outside: u64,
    within: u64,
    /// It contains the point.
    around: u64,
    /// It hides all of the light.
    hidden: u64,
    /// Its projection has no closed form.
    other: u64,
    /// It hides all of the light from all places within reach.
    firm: u64,
    /// Its silhouette moves on the light, by `motion`.
    moving: u64,
    motion: f32x16<S>,
}

impl<S: Simd> OccluderTest<S> {
    #[inline(always)]
    fn nothing(zero: f32x16<S>) -> Self {
        OccluderTest { outside: 0, within: 0, around: 0, hidden: 0, other: 0, firm: 0, moving: 0, motion: zero }
    }
}

#[inline(always)]
fn test_sphere<S: Simd>(
    simd: S,
    pyramid: &LightPyramid16<S>,
    s: Vec3x16<S>,
    r: f32,
    sphere: &Sphere,
    points: &[ShadingPoint],
    lanes: u64,
) -> OccluderTest<S> {
    let zero = simd.splat_f32x16(0.0);
    let mut test = OccluderTest::nothing(zero);
    let distance2 = s.dot(s);
    let distance = distance2.sqrt();
    // On which side of the sphere the points are: where that is close, to the last bit
    let power = distance2 - r * r;
    let margin = s.abs().dot(pyramid.error) * 2.0;
    let room = margin + (distance2 + r * r) * 1e-6;
    let mut close = power.abs().simd_le(room).to_bitmask() & lanes;
    let mut inside = power.simd_lt(zero).to_bitmask() & lanes & !close;
    let mut on = 0;
    while close != 0 {
        let k = close.trailing_zeros() as usize;
        close &= close - 1;
        let shadow = sphere.shadow(points[k].p, points[k].error);
        if shadow.is_on() {
            on |= 1 << k;
        } else if (sphere.c - points[k].p.as_dvec3()).length() <= sphere.r {
            inside |= 1 << k;
        }
    }
    // Above whose horizon it rises, for any of the places around
    let height = pyramid.horizon.dot(s);
    let slack = distance * SLACK + 4e-4 * r;
    let around = pyramid.reach + pyramid.turn * (distance + pyramid.reach);
    let below = (-height).simd_gt(slack + r).to_bitmask();
    let below_all = (-height).simd_gt(slack + r + around).to_bitmask();
    // From its outside nothing of it is above the horizon, but by rounding
    let outer = on & height.simd_lt(zero).to_bitmask();
    let within = (inside | on & !outer) & lanes;
    let outside = lanes & !on & !inside;
    if within != 0 {
        let mut all_in = within;
        let mut none_in = within;
        let smaller = Shadow::cone(simd, s, r * (1.0 - 1e-6), &pyramid.light_vectors);
        let larger = Shadow::cone(simd, s, r * (1.0 + 1e-6), &pyramid.light_vectors);
        for [x, y] in pyramid.square() {
            all_in &= smaller.holds(x, y).to_bitmask();
            none_in &= !larger.holds(x, y).to_bitmask();
        }
        // All of the light is outside only if the sphere does not reach through it
        let from_center = pyramid.light_vectors[0] - s;
        none_in &= pyramid.normal.dot(from_center).abs().simd_gt(r * (1.0 + 1e-6)).to_bitmask();
        // What is hidden is the same from everywhere inside, and on a surface that bends as the sphere does
        let deep = (r - distance).simd_gt(pyramid.reach * 2.0).to_bitmask();
        let touches = on & (pyramid.turn * r).simd_lt(pyramid.reach * 0.5).to_bitmask();
        let moving = within & (inside | touches) & !deep & pyramid.reach.simd_gt(zero).to_bitmask();
        test.around = within;
        test.hidden |= none_in;
        test.firm |= none_in & !moving;
        test.within = within & !all_in & !none_in;
        // From outside it hides a light that is inside of it as well
        let all_around = (r - distance).simd_gt(pyramid.reach).to_bitmask();
        test.moving |= moving & !(all_in & all_around);
        test.motion = simd.splat_f32x16(f32::INFINITY);
    }
    let [around, mut near] = pyramid.meets(s, distance, r, outside & !below_all);
    if around == 0 {
        return test;
    }
    let toward = (distance - pyramid.reach).max(simd.splat_f32x16(r));
    let tangent = (toward * toward - r * r).max(zero).sqrt();
    let motion = pyramid.motion(tangent);
    test.motion = if test.moving != 0 {
        let moving = fearless_simd::mask32x16::from_bitmask(simd, test.moving);
        moving.select(test.motion, motion)
    } else {
        motion
    };
    test.moving |= around & pyramid.reach.simd_gt(zero).to_bitmask();
    near &= !below;
    if near == 0 {
        return test;
    }
    // One convex thing hides all of the light if it hides its corners
    let shadow = Shadow::cone(simd, s, r, &pyramid.light_vectors);
    let hidden = pyramid.hidden(&shadow, near);
    test.hidden |= hidden;
    test.outside = near & !hidden;
    // From everywhere around: ways to the corners pass its middle nearly as closely. From inside of it, more may be
    // seen
    let patches = hidden & pyramid.reach.simd_gt(zero).to_bitmask();
    test.firm |= hidden & !patches;
    let mut patches = patches & (distance - r).simd_gt(pyramid.reach).to_bitmask();
    while patches != 0 {
        let k = patches.trailing_zeros() as usize;
        patches &= patches - 1;
        let smaller = r - points[k].reach;
        if smaller > 0.0 {
            let shadow = Shadow::cone(simd, s, smaller, &pyramid.light_vectors);
            test.firm |= pyramid.hidden(&shadow, 1 << k);
        }
    }
    test
}

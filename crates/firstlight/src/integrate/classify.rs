//! What may stand between points and a light: for sixteen points at once, and for all within a radius of each.
//!
//! With radius 0 it is the class of a point: it sees all of the light, none of it, or what these convex things leave of
//! it. With a radius it is a proof of the same for all places within it, and a bound on how far the outline of a shadow
//! moves on the light from one of them to another.

mod solid;

use fearless_simd::{f32x16, prelude::*};

use super::batch::{Linear16, Members, ShadingPoint, ViewNumber};
use super::cut;
use super::emitter::Emitter;
use super::hull::SolidOccluder;
use super::occluder::{Exact, Occluder, Shadow, corners_from, edges, ways};
use super::panels::{Between, MAX_BETWEEN, MAX_CUTS};
use crate::ids::LightId;
use crate::math::{DAffine3, LANES, Vec3x16};
use crate::scene::{Meets, Scene, Target};
use crate::shape::{Parallelogram, Placement, PlaneSide, Solid, Sphere};
use solid::{ConvexSolid, solid_between};

/// All things that may stand in the way of one light.
#[derive(Default)]
pub(crate) struct Obstacles<'a> {
    /// As they are met row by row, and as they are; number by number the same.
    pub occluders: Vec<Occluder>,
    exact: Vec<ExactShape<'a>>,
    /// How each lies to the light, if that is a ball; that ball, and which of them reach into it, bit by bit.
    touches: Vec<Touch>,
    pub ball: Option<(Exact, f32)>,
    pub cuts: u64,
    /// Which placed things are among them.
    placed: Vec<u32>,
}

/// What decides on which side a point is.
enum ExactShape<'a> {
    Sphere(&'a Sphere),
    Flat {
        flat: &'a Parallelogram,
        /// On which side all of the light is.
        side: PlaneSide,
        /// The same if the camera sees it: then nobody sees what is behind it.
        seen_side: PlaneSide,
    },
    Solid(Box<ConvexSolid>),
}

/// The most obstacles of a light.
pub(crate) const MAX_OBSTACLES: usize = 64;

impl<'a> Obstacles<'a> {
    /// Those of light `index`; `None` if they are too many.
    pub fn new(scene: &'a Scene, index: usize, emitter: &Emitter) -> Option<Obstacles<'a>> {
        let id = LightId(index as u32);
        let mut obstacles = Obstacles::default();
        if !scene.lights[index].shadows {
            return Some(obstacles);
        }
        let [sphere_links, flat_links] = &scene.obstacle_links;
        let listed = scene.obstacles.iter().enumerate().filter(|(i, _)| scene.casts(sphere_links, *i, id));
        let lights = scene.light_obstacles.spheres.iter().filter(|(light, _)| *light != index);
        for sphere in listed.map(|(_, sphere)| sphere).chain(lights.map(|(_, sphere)| sphere)) {
            obstacles.occluders.push(Occluder::Sphere { center: Exact::new(sphere.c), radius: sphere.r as f32 });
            obstacles.exact.push(ExactShape::Sphere(sphere));
        }
        let sides = &scene.light_sides[index];
        for (i, flat) in scene.flat_obstacles.iter().enumerate().filter(|(i, _)| scene.casts(flat_links, *i, id)) {
            let side = sides.get(i).copied().unwrap_or(PlaneSide::Both);
            let seen_side = if scene.flats_seen.get(i) == Some(&true) { side } else { PlaneSide::Both };
            obstacles.occluders.push(Occluder::Flat { corners: flat.deep_corners().map(Exact::new) });
            obstacles.exact.push(ExactShape::Flat { flat, side, seen_side });
        }
        for (_, disk) in scene.light_obstacles.disks.iter().filter(|(light, _)| *light != index) {
            obstacles.add(ConvexSolid::new(Solid::Disk(*disk), Placement::new(DAffine3::IDENTITY), emitter));
        }
        if obstacles.occluders.len() > MAX_OBSTACLES {
            return None;
        }
        for (k, thing) in scene.geometry.placed.iter().enumerate() {
            let Target::Solid(solid) = thing.target else { continue };
            let casts = match thing.shadow {
                Meets::All => true,
                Meets::None => false,
                Meets::Some => scene.geometry.casts(thing.surface, id),
            };
            if !casts || obstacles.occluders.len() == MAX_OBSTACLES {
                continue;
            }
            let solid = scene.geometry.solids[solid as usize];
            if obstacles.add(ConvexSolid::new(solid, thing.placement, emitter)) {
                obstacles.placed.push(k as u32);
            }
        }
        obstacles.touch(emitter);
        Some(obstacles)
    }

    /// Finds out what reaches into a light that is a ball.
    fn touch(&mut self, emitter: &Emitter) {
        if let Emitter::Ball { center, radius, .. } = emitter {
            self.ball = Some((Exact::new(*center), *radius as f32));
        }
        for (i, (exact, occluder)) in self.exact.iter().zip(&self.occluders).enumerate() {
            let touch = Touch::of(emitter, exact);
            self.touches.push(touch);
            self.cuts |= u64::from(touch == Touch::Cuts && cut::knows(occluder)) << i;
        }
    }

    /// Adds a solid, if rows tell it.
    fn add(&mut self, solid: Option<(ConvexSolid, SolidOccluder)>) -> bool {
        let Some((shape, occluder)) = solid else { return false };
        self.occluders.push(Occluder::Solid(occluder));
        self.exact.push(ExactShape::Solid(Box::new(shape)));
        true
    }

    /// Whether a placed thing is among them.
    pub fn has_placed(&self, thing: u32) -> bool {
        self.placed.binary_search(&thing).is_ok()
    }

    /// Whether any is.
    pub fn has_solids(&self) -> bool {
        !self.placed.is_empty()
    }
}

#[cfg(test)]
impl<'a> Obstacles<'a> {
    /// Spheres alone.
    pub fn of_spheres(spheres: &'a [Sphere], emitter: &Emitter) -> Obstacles<'a> {
        let occluder = |sphere: &Sphere| Occluder::Sphere { center: Exact::new(sphere.c), radius: sphere.r as f32 };
        let mut obstacles = Obstacles {
            occluders: spheres.iter().map(occluder).collect(),
            exact: spheres.iter().map(ExactShape::Sphere).collect(),
            ..Obstacles::default()
        };
        obstacles.touch(emitter);
        obstacles
    }
}

/// What is between a point, with what lies around it, and a light.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Class {
    /// What may hide a part of it from the point.
    pub between: Between,
    /// Whether all of it is hidden from the point.
    pub hidden: bool,
    /// Whether something is in the way that is not told row by row.
    pub other: bool,
    /// How far the outline of a shadow moves on the light from the point to a place within its reach, as a part of the
    /// light's size; 0 where all those places are proved to be lit or hidden as one.
    pub motion: f32,
}

/// Room for the rounding of a distance.
const SLACK: f32 = 1e-5;

/// The light as sixteen points see it: the pyramid over it, and the cone around it.
struct Sight<S: Simd> {
    p: Vec3x16<S>,
    ways: [Vec3x16<S>; 3],
    x: [f32x16<S>; 2],
    y: [f32x16<S>; 2],
    /// Outward unit normals.
    sides: [Vec3x16<S>; 4],
    axis: Vec3x16<S>,
    sin: f32x16<S>,
    cos: f32x16<S>,
    far: f32x16<S>,
    /// Across the line of sight, at least.
    size: f32x16<S>,
    normal: Vec3x16<S>,
    horizon: Vec3x16<S>,
    /// How sure we are of each point.
    error: Vec3x16<S>,
    reach: f32x16<S>,
    turn: f32x16<S>,
}

/// Unit, or 0 where `v` is.
#[inline(always)]
fn unit<S: Simd>(v: Vec3x16<S>) -> Vec3x16<S> {
    let length2 = v.dot(v);
    let simd = length2.token();
    let is_long = length2.simd_gt(f32::MIN_POSITIVE);
    let inverse = 1.0 / is_long.select(length2, simd.splat_f32x16(1.0)).sqrt();
    v * is_long.select(inverse, simd.splat_f32x16(0.0))
}

/// The way to a place of the light.
#[inline(always)]
fn way<S: Simd>(l: &[Vec3x16<S>; 3], x: f32x16<S>, y: f32x16<S>) -> Vec3x16<S> {
    l[0] + (l[1] * x + l[2] * y)
}

impl<S: Simd> Sight<S> {
    #[inline(always)]
    fn new(simd: S, members: &Members, points: &[ShadingPoint]) -> Sight<S> {
        use ViewNumber::*;
        let point = |f: fn(&ShadingPoint) -> f32| {
            let mut numbers = [0.0; LANES];
            for (number, point) in numbers.iter_mut().zip(points) {
                *number = f(point);
            }
            numbers
        };
        let l = ways(simd, members);
        let (x, y) =
            ([members.lanes(simd, X0), members.lanes(simd, X1)], [members.lanes(simd, Y0), members.lanes(simd, Y1)]);
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
        let slant = members.lanes(simd, Height) / distance;
        let size = members.lanes(simd, La).min(members.lanes(simd, Lb)) * slant.max(simd.splat_f32x16(0.02)) * 2.0;
        Sight {
            p: members.vectors(simd, [Px, Py, Pz]),
            ways: l,
            x,
            y,
            sides,
            axis: middle * (1.0 / distance),
            sin,
            cos: (1.0 - sin * sin).sqrt(),
            far,
            size,
            normal: unit(l[1].cross(l[2])),
            horizon: Vec3x16 {
                x: f32x16::simd_from(simd, point(|p| p.horizon.x)),
                y: f32x16::simd_from(simd, point(|p| p.horizon.y)),
                z: f32x16::simd_from(simd, point(|p| p.horizon.z)),
            },
            error: Vec3x16 {
                x: f32x16::simd_from(simd, point(|p| p.error.0.x)),
                y: f32x16::simd_from(simd, point(|p| p.error.0.y)),
                z: f32x16::simd_from(simd, point(|p| p.error.0.z)),
            },
            reach: f32x16::simd_from(simd, point(|p| p.reach)),
            turn: f32x16::simd_from(simd, point(|p| p.turn)),
        }
    }

    /// The corners of the light's square.
    #[inline(always)]
    fn square(&self) -> [[f32x16<S>; 2]; 4] {
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    /// Those of some points from which all of the light's corners are hidden.
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

    /// Which of some points may see the ball of radius `r` around `s` between themselves and the light: from anywhere
    /// within their reach, and from themselves.
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
        let to_plane = self.normal.dot(self.ways[0]);
        let beyond = (self.normal.dot(s) - to_plane)
            * to_plane.simd_lt(zero).select(simd.splat_f32x16(-1.0), simd.splat_f32x16(1.0));
        around &= gap.simd_le(rounding + self.reach).to_bitmask() & !beyond.simd_gt(self.reach + r).to_bitmask();
        [around, around & gap.simd_le(rounding).to_bitmask() & !beyond.simd_gt(r).to_bitmask()]
    }

    /// How far the outline of a shadow moves on the light that something casts which is `near` to the point.
    #[inline(always)]
    fn motion(&self, near: f32x16<S>) -> f32x16<S> {
        let simd = near.token();
        let t = (near / self.far).max(simd.splat_f32x16(1e-6)).min(simd.splat_f32x16(1.0));
        self.reach * 2.0 * (1.0 - t) / (t * self.size)
    }
}

/// The classes of up to sixteen points, whose views `members` are; of those whose bits are in `asked`. To be called
/// within `vectorize`.
#[inline(always)]
pub(crate) fn classify<S: Simd>(
    simd: S,
    obstacles: &Obstacles,
    emitter: &Emitter,
    members: &Members,
    points: &[ShadingPoint],
    asked: u64,
) -> [Class; LANES] {
    let mut classes = [Class::default(); LANES];
    if asked == 0 {
        return classes;
    }
    let sight = Sight::new(simd, members, points);
    let mut asked = asked;
    for (i, (occluder, exact)) in obstacles.occluders.iter().zip(&obstacles.exact).enumerate() {
        if asked == 0 {
            break;
        }
        let mut told = match (occluder, exact) {
            (Occluder::Sphere { center, radius }, ExactShape::Sphere(sphere)) => {
                sphere_between(simd, &sight, center.seen_from(simd, sight.p), *radius, sphere, points, asked)
            }
            (Occluder::Flat { corners }, ExactShape::Flat { flat, side, seen_side }) => {
                let corners = corners_from(simd, corners, sight.p);
                flat_between(simd, &sight, corners, (flat, *side, *seen_side), points, asked)
            }
            (Occluder::Solid(_), ExactShape::Solid(shape)) => {
                solid_between(simd, &sight, shape, occluder, points, asked)
            }
            _ => unreachable!("both lists hold the same things"),
        };
        let touch = obstacles.touches[i];
        if touch == Touch::Cuts {
            // Of the ball more may be seen than of its disk
            (told.outside, told.hidden, told.firm) = (told.outside | told.hidden, 0, 0);
            told.other |= if matches!(emitter, Emitter::Ball { both_sides: true, .. }) {
                // What is behind the disk shines as well
                asked
            } else if obstacles.cuts >> i & 1 == 1 {
                told.within
            } else {
                told.outside | told.within
            };
        }
        if (told.outside | told.within | told.hidden | told.moving | told.other) & asked == 0 {
            continue;
        }
        if touch == Touch::Holds {
            told.hidden |= told.outside;
            (told.outside, told.within) = (0, 0);
        }
        let motion = told.motion.to_array();
        for (k, class) in classes.iter_mut().enumerate().take(points.len()) {
            if asked >> k & 1 == 0 {
                continue;
            }
            if told.moving >> k & 1 == 1 {
                class.motion = class.motion.max(motion[k]);
            }
            if told.hidden >> k & 1 == 1 {
                class.hidden = true;
                if told.firm >> k & 1 == 1 {
                    class.motion = 0.0;
                }
                asked &= !(1 << k);
                continue;
            }
            class.other |= told.other >> k & 1 == 1;
            class.between.outside |= (told.outside >> k & 1) << i;
            class.between.within |= (told.within >> k & 1) << i;
        }
    }
    for class in &mut classes {
        let many = class.between.outside.count_ones() + class.between.within.count_ones();
        let cuts = (class.between.outside & obstacles.cuts).count_ones();
        class.other |= many as usize > MAX_BETWEEN || cuts as usize > MAX_CUTS;
    }
    classes
}

/// How something lies to a light that is a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Touch {
    Apart,
    /// It reaches into it: what of it is behind the light's surface does not show on the disk that stands for the
    /// light.
    Cuts,
    /// The light is inside of it.
    Holds,
}

impl Touch {
    fn of(emitter: &Emitter, exact: &ExactShape) -> Touch {
        let Emitter::Ball { center, radius, .. } = emitter else { return Touch::Apart };
        match exact {
            ExactShape::Sphere(sphere) => {
                let distance = (*center - sphere.c).length();
                if distance >= radius + sphere.r {
                    Touch::Apart
                } else if distance + radius <= sphere.r * (1.0 - 1e-9) {
                    Touch::Holds
                } else {
                    Touch::Cuts
                }
            }
            ExactShape::Flat { flat, .. } if flat.distance(*center) < *radius => Touch::Cuts,
            ExactShape::Solid(solid) if solid.may_touch => Touch::Cuts,
            ExactShape::Flat { .. } | ExactShape::Solid(_) => Touch::Apart,
        }
    }
}

/// What one thing does to sixteen points, in bits.
struct Told<S: Simd> {
    /// It may hide a part of the light, from outside of it or from within.
    outside: u64,
    within: u64,
    hidden: u64,
    /// It does what is not told row by row.
    other: u64,
    /// It hides all from everywhere around the point.
    firm: u64,
    /// The outline of its shadow moves so far.
    moving: u64,
    motion: f32x16<S>,
}

impl<S: Simd> Told<S> {
    #[inline(always)]
    fn nothing(zero: f32x16<S>) -> Self {
        Told { outside: 0, within: 0, hidden: 0, other: 0, firm: 0, moving: 0, motion: zero }
    }
}

#[inline(always)]
fn sphere_between<S: Simd>(
    simd: S,
    sight: &Sight<S>,
    s: Vec3x16<S>,
    r: f32,
    sphere: &Sphere,
    points: &[ShadingPoint],
    asked: u64,
) -> Told<S> {
    let zero = simd.splat_f32x16(0.0);
    let mut told = Told::nothing(zero);
    let distance2 = s.dot(s);
    let distance = distance2.sqrt();
    // On which side of the sphere the points are: where that is close, to the last bit
    let power = distance2 - r * r;
    let margin = s.abs().dot(sight.error) * 2.0;
    let room = margin + (distance2 + r * r) * 1e-6;
    let mut close = power.abs().simd_le(room).to_bitmask() & asked;
    let mut inside = power.simd_lt(zero).to_bitmask() & asked & !close;
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
    let height = sight.horizon.dot(s);
    let slack = distance * SLACK + 4e-4 * r;
    let around = sight.reach + sight.turn * (distance + sight.reach);
    let below = (-height).simd_gt(slack + r).to_bitmask();
    let below_all = (-height).simd_gt(slack + r + around).to_bitmask();
    // From its outside nothing of it is above the horizon, but by rounding
    let outer = on & height.simd_lt(zero).to_bitmask();
    let within = (inside | on & !outer) & asked;
    let outside = asked & !on & !inside;
    if within != 0 {
        let mut all_in = within;
        let mut none_in = within;
        let smaller = Shadow::cone(simd, s, r * (1.0 - 1e-6), &sight.ways);
        let larger = Shadow::cone(simd, s, r * (1.0 + 1e-6), &sight.ways);
        for [x, y] in sight.square() {
            all_in &= smaller.holds(x, y).to_bitmask();
            none_in &= !larger.holds(x, y).to_bitmask();
        }
        // All of the light is outside only if the sphere does not reach through it
        let from_center = sight.ways[0] - s;
        none_in &= sight.normal.dot(from_center).abs().simd_gt(r * (1.0 + 1e-6)).to_bitmask();
        // What is hidden is the same from everywhere inside
        let deep = (r - distance).simd_gt(sight.reach * 2.0).to_bitmask();
        let moving = within & inside & !deep & sight.reach.simd_gt(zero).to_bitmask();
        told.hidden |= none_in;
        told.firm |= none_in & !moving;
        told.within = within & !all_in & !none_in;
        told.moving |= moving & !all_in;
        told.motion = simd.splat_f32x16(f32::INFINITY);
    }
    let [around, mut near] = sight.meets(s, distance, r, outside & !below_all);
    if around == 0 {
        return told;
    }
    let toward = (distance - sight.reach).max(simd.splat_f32x16(r));
    let tangent = (toward * toward - r * r).max(zero).sqrt();
    let motion = sight.motion(tangent);
    told.motion = if told.moving != 0 {
        let moving = fearless_simd::mask32x16::from_bitmask(simd, told.moving);
        moving.select(told.motion, motion)
    } else {
        motion
    };
    told.moving |= around & sight.reach.simd_gt(zero).to_bitmask();
    near &= !below;
    if near == 0 {
        return told;
    }
    // One convex thing hides all of the light if it hides its corners
    let shadow = Shadow::cone(simd, s, r, &sight.ways);
    let hidden = sight.hidden(&shadow, near);
    told.hidden |= hidden;
    told.outside = near & !hidden;
    // From everywhere around: ways to the corners pass its middle nearly as closely
    let patches = hidden & sight.reach.simd_gt(zero).to_bitmask();
    told.firm |= hidden & !patches;
    let mut patches = patches;
    while patches != 0 {
        let k = patches.trailing_zeros() as usize;
        patches &= patches - 1;
        let smaller = r - points[k].reach;
        if smaller > 0.0 {
            let shadow = Shadow::cone(simd, s, smaller, &sight.ways);
            told.firm |= sight.hidden(&shadow, 1 << k);
        }
    }
    told
}

#[inline(always)]
fn flat_between<S: Simd>(
    simd: S,
    sight: &Sight<S>,
    q: [Vec3x16<S>; 4],
    (flat, side, seen_side): (&Parallelogram, PlaneSide, PlaneSide),
    points: &[ShadingPoint],
    asked: u64,
) -> Told<S> {
    let zero = simd.splat_f32x16(0.0);
    let mut told = Told::nothing(zero);
    let mut size2 = zero;
    let mut rises = simd.splat_f32x16(f32::NEG_INFINITY);
    for q in &q {
        size2 = size2.max(q.dot(*q));
        rises = rises.max(sight.horizon.dot(*q));
    }
    let rounding = size2.sqrt() * SLACK;
    // Above whose horizon it rises
    let around = sight.reach + sight.turn * (size2.sqrt() + sight.reach);
    let mut near = asked & rises.simd_ge(-rounding - around).to_bitmask();
    if near == 0 {
        return told;
    }
    // In the pyramid over the light
    let mut gap = simd.splat_f32x16(f32::NEG_INFINITY);
    for n in &sight.sides {
        let mut least = n.dot(q[0]);
        for q in &q[1..] {
            least = least.min(n.dot(*q));
        }
        gap = gap.max(least);
    }
    near &= gap.simd_le(rounding + sight.reach).to_bitmask();
    // On which side of it the points are, to the last bit; and a part of what is around them may be on the other side
    let (mut left, mut through, mut beside) = (near, 0u64, 0u64);
    while left != 0 {
        let k = left.trailing_zeros() as usize;
        left &= left - 1;
        let ShadingPoint { p, error, reach, .. } = points[k];
        if !flat.is_one_sided(p, error, side) {
            through |= 1 << k;
        } else if reach > 0.0 && flat.plane_cuts(p, error, reach) {
            beside |= 1 << k;
        }
    }
    near = through | beside;
    if near == 0 {
        return told;
    }
    // In the light's own plane nothing is before it
    let lines = edges(q, &sight.ways);
    let n = (q[1] - q[0]).cross(q[3] - q[0]);
    let length = n.dot(n).sqrt();
    let mut in_plane = near;
    for [x, y] in sight.square() {
        in_plane &= lines[0].at(x, y).abs().simd_le(length * sight.far * SLACK).to_bitmask();
    }
    near &= !in_plane;
    // How far away it is decides how far its shadow moves
    let mut motion = [0.0f32; LANES];
    let mut left = near & sight.reach.simd_gt(zero).to_bitmask();
    while left != 0 {
        let k = left.trailing_zeros() as usize;
        left &= left - 1;
        let point = &points[k];
        let distance = flat.distance(point.p.as_dvec3()) as f32;
        let is_screen =
            beside >> k & 1 == 1 && distance <= point.reach && flat.screens(point.p, point.wo, point.reach, seen_side);
        if !is_screen {
            motion[k] = (distance - point.reach).max(0.0);
            told.moving |= 1 << k;
        }
    }
    told.motion = sight.motion(f32x16::simd_from(simd, motion));
    near &= through & gap.simd_le(rounding).to_bitmask() & rises.simd_ge(-rounding).to_bitmask();
    if near == 0 {
        return told;
    }
    // What is wholly outside of one of its edges is not hidden; what is inside of all, wholly
    let mut hidden = near;
    for line in &lines {
        let Linear16 { c, x, y } = *line;
        let ([left, right], [low, high]) = (sight.x, sight.y);
        let most = c + (left * x).max(right * x) + (low * y).max(high * y);
        let least = c + (left * x).min(right * x) + (low * y).min(high * y);
        near &= most.simd_ge(zero).to_bitmask();
        hidden &= least.simd_ge(zero).to_bitmask();
    }
    hidden &= near;
    told.hidden = hidden;
    told.outside = near & !hidden;
    // From everywhere around: all ways to the corners pass far inside of the edges
    let mut patches = hidden;
    while patches != 0 {
        let k = patches.trailing_zeros() as usize;
        patches &= patches - 1;
        let point = &points[k];
        if point.reach == 0.0 {
            told.firm |= 1 << k;
            continue;
        }
        let share = (motion[k] + point.reach) / sight.far.to_array()[k];
        let corners = flat.deep_corners().map(|q| (q - point.p.as_dvec3()).as_vec3());
        let edge = |i: usize| corners[i].cross(corners[(i + 1) % 4]).length();
        let lengths = [length.to_array()[k], edge(0), edge(1), edge(2), edge(3)];
        let mut depth = f32::INFINITY;
        for (line, length) in lines.iter().zip(lengths) {
            for [x, y] in sight.square() {
                depth = depth.min(line.at(x, y).to_array()[k] / length);
            }
        }
        if depth * share.min(1.0) > point.reach {
            told.firm |= 1 << k;
        }
    }
    told
}

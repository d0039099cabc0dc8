//! The integral of a light behind anything: a mask over fixed points, their number doubled until the answer stands still.
//!
//! The points say what share of the light arrives; how much the whole would be is known exactly. So where nothing is in
//! the way, or everything, the points' own error is nothing.

use std::sync::OnceLock;

use super::Sums;
use super::between::Between;
use super::emitter::Emitter;
use super::view::{Outline, View};
use crate::accel::RayPacket16;
use crate::ids::LightId;
use crate::light::{Light, LightKind, LightSample, MIN_DISTANCE2, SampleSet};
use crate::material::Lobe;
use crate::math::{LANES, ShadowRay, Vec3};
use crate::scene::{Scene, ShadowRays};
use crate::shape::SurfaceInteraction;

/// The fewest and the most points.
const FEWEST: usize = 256;
const MOST: usize = 1 << 14;

/// Points of the square [-1, 1]^2, and what they are on a disk.
struct Points {
    square: Vec<[f32; 2]>,
    disk: Vec<[f32; 2]>,
}

fn points() -> &'static Points {
    static POINTS: OnceLock<Points> = OnceLock::new();
    POINTS.get_or_init(|| {
        let square =
            (0..MOST as u32).map(|k| SampleSet::Sobol.point(k, MOST as u32, 0).map(|w| (2.0 * w - 1.0) as f32));
        let square: Vec<[f32; 2]> = square.collect();
        let disk = square.iter().map(|p| crate::light::concentric(p.map(f64::from)).map(|w| w as f32)).collect();
        Points { square, disk }
    })
}

/// A light behind things, seen from a surface.
pub(crate) struct Masked<'a> {
    pub scene: &'a Scene,
    pub light: usize,
    pub emitter: &'a Emitter,
    pub si: &'a SurfaceInteraction,
    pub lobe: &'a Lobe,
    pub between: &'a Between,
}

/// Sums of the points so far: what they would send, and what of it arrives.
#[derive(Clone, Copy, Default)]
struct Shares {
    all: [f64; 2],
    lit: [f64; 2],
    hidden: usize,
}

impl Shares {
    /// `whole` is what arrives where nothing is in the way.
    fn sums(&self, whole: &Sums) -> Sums {
        let share =
            |i: usize, whole: f32| if self.all[i] > 0.0 { whole * (self.lit[i] / self.all[i]) as f32 } else { 0.0 };
        Sums { diffuse: share(0, whole.diffuse), specular: share(1, whole.specular) }
    }
}

impl Masked<'_> {
    /// What arrives, and how far it may be wrong. `whole` is what would arrive if nothing were in the way.
    pub fn integrate(&self, view: &View, whole: &Sums, enough: &dyn Fn(&Sums, &Sums) -> bool) -> (Sums, Sums) {
        let table = match view.outline {
            Outline::Parallelogram => &points().square,
            Outline::Disk => &points().disk,
        };
        let ball = match self.emitter {
            Emitter::Ball { center, radius } => {
                let to = (*center - self.si.lit_from.as_dvec3()).as_vec3();
                Some((to, (to.length_squared() - (radius * radius) as f32).max(0.0)))
            }
            _ => None,
        };
        let mut shares = Shares::default();
        let mut before: [Option<Sums>; 2] = [None; 2];
        let (mut from, mut to) = (0, FEWEST);
        loop {
            for block in table[from..to].chunks_exact(LANES) {
                let mut ways = [Vec3::ZERO; LANES];
                let mut sent = [[0.0f32; 2]; LANES];
                let mut active = 0u16;
                for (lane, [x, y]) in block.iter().enumerate() {
                    let l = view.l(*x, *y);
                    let (height, cos) = (view.horizon.at(*x, *y), view.cos.at(*x, *y));
                    if !(height > 0.0 && cos > 0.0) {
                        continue;
                    }
                    let inverse = 1.0 / l.length();
                    let weight = if view.physical { view.height * inverse * (inverse * inverse) } else { 1.0 };
                    let cos_i = cos * inverse;
                    let lobe = self.lobe.eval(cos_i, view.cos_o, view.wo.dot(l) * inverse);
                    sent[lane] = [weight * cos_i, weight * lobe];
                    ways[lane] = match ball {
                        None => l,
                        // On to the ball's surface
                        Some((center, cc)) => {
                            let (a, b) = (l.length_squared(), l.dot(center));
                            l * ((b - (b * b - a * cc).max(0.0).sqrt()) / a)
                        }
                    };
                    active |= 1 << lane;
                }
                let hidden = self.hidden(block, &ways, active);
                shares.hidden += hidden.count_ones() as usize;
                for (lane, [diffuse, specular]) in sent.iter().enumerate() {
                    shares.all[0] += f64::from(*diffuse);
                    shares.all[1] += f64::from(*specular);
                    if hidden >> lane & 1 == 0 {
                        shares.lit[0] += f64::from(*diffuse);
                        shares.lit[1] += f64::from(*specular);
                    }
                }
            }
            let now = shares.sums(whole);
            if let [Some(before), earlier] = before {
                let off = |of: fn(&Sums) -> f32| {
                    let earlier = earlier.map_or(0.0, |sums| (of(&sums) - of(&before)).abs() * 0.5);
                    (of(&now) - of(&before)).abs().max(earlier)
                };
                // What one more point could change is the least that can be wrong
                let one = 1.0 / to as f32;
                let error = Sums {
                    diffuse: off(|sums| sums.diffuse).max(whole.diffuse * one),
                    specular: off(|sums| sums.specular).max(whole.specular * one),
                };
                if to == MOST || shares.hidden == 0 && to >= 2 * FEWEST || enough(&now, &error) {
                    return (now, error);
                }
            }
            before = [Some(now), before[0]];
            (from, to) = (to, to * 2);
        }
    }

    /// Which of sixteen ways something stands in.
    fn hidden(&self, places: &[[f32; 2]], ways: &[Vec3; LANES], active: u16) -> u16 {
        let lanes = |mask: u16| (0..LANES).filter(move |lane| mask >> lane & 1 == 1);
        let mut hidden = 0;
        if self.between.ask {
            for lane in lanes(active) {
                let ray = self.si.shadow_ray(LightId(self.light as u32), ways[lane], 1.0);
                hidden |= u16::from(self.scene.occluded_by_lists(&ray)) << lane;
            }
        } else {
            for lane in lanes(active) {
                let [x, y] = places[lane];
                hidden |= u16::from(self.between.hiders.iter().any(|hider| hider.hides(x, y))) << lane;
            }
        }
        let geometry = &self.scene.geometry;
        let asking = active & !hidden;
        if asking == 0 || !self.between.ask_trees {
            return hidden;
        }
        let from = self.si.shadow_ray(LightId(self.light as u32), Vec3::ZERO, 1.0);
        let mut shadows = ShadowRays { from, rays: RayPacket16::ZERO, t_end: [0.0; LANES] };
        for (lane, way) in ways.iter().enumerate() {
            shadows.rays.set(lane, from.start, *way);
            shadows.t_end[lane] = ShadowRay { l: *way, ..from }.end();
        }
        hidden | geometry.are_blocked(self.scene.level, &shadows, asking)
    }

    /// The same for a light that is only points.
    pub fn by_points(&self, light: &Light) -> Sums {
        let LightKind::Area(area) = &light.kind else { return Sums::default() };
        let si = self.si;
        let cos_o = si.ns.dot(si.wo);
        let (mut diffuse, mut specular) = (0.0f64, 0.0f64);
        let count = area.samples();
        for k in 0..count {
            // Thousands of spheres do not have a table each
            let (q, n) = area.shared_point(k).unwrap_or_else(|| (area.point(k), Vec3::ZERO));
            let l = q - si.lit_from;
            let height = si.ns.dot(l);
            if !(si.horizon.dot(l) > 0.0 && height > 0.0) {
                continue;
            }
            let sample = if n == Vec3::ZERO {
                let Some(sample) = light.sample(k, l) else { continue };
                sample
            } else {
                let distance2 = l.dot(l);
                if !(distance2 >= MIN_DISTANCE2) {
                    continue;
                }
                let inverse_distance = 1.0 / distance2.sqrt();
                LightSample { inverse_distance, weight: area.weight_facing(n, l, inverse_distance) }
            };
            if sample.weight == 0.0
                || light.shadows
                    && si.receives_shadow
                    && self.scene.occluded(&si.shadow_ray(LightId(self.light as u32), l, 1.0))
            {
                continue;
            }
            let cos_i = height * sample.inverse_distance;
            let cos_io = si.wo.dot(l) * sample.inverse_distance;
            diffuse += f64::from(cos_i * sample.weight);
            specular += f64::from(self.lobe.eval(cos_i, cos_o, cos_io) * sample.weight);
        }
        // As a share of the area, and the area itself
        let share = if area.physical { area.measure() } else { 1.0 } / count as f64;
        Sums { diffuse: (diffuse * share) as f32, specular: (specular * share) as f32 }
    }
}

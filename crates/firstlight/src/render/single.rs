//! Lights of one point.

use super::Counts;
use super::arrival::{ArrivalPlace, Arrivals, Trees};
use super::change::{Arrival, Change};
use super::pixel::Lighting;
use super::plain::Plain;
use crate::ids::LightId;
use crate::integrate::TOLERANCE;
use crate::light::{Light, LightKind};
use crate::material::{Lobe, Moments};
use crate::math::{Vec3, square};
use crate::scene::Listed;
use crate::shape::{PlaneSide, SurfaceInteraction};

impl Arrivals<'_> {
    /// What arrives of a light of one point.
    pub(super) fn single(&mut self, index: usize, light: &Light, place: &ArrivalPlace, counts: &mut Counts) -> Arrival {
        let si = place.si;
        let sums = self.of_single(index, place);
        counts.points += u64::from(!place.lit);
        if place.reach == 0.0 {
            return Arrival::even(sums);
        }
        let to = light.towards(0, si.lit_from);
        let distance = if to.finite { to.l.length() } else { f32::INFINITY };
        // The most that can arrive on the patch, the cosine being 1
        let near = (distance - place.reach).max(0.0);
        let (height, behind) = (si.ns.dot(to.l).min(si.horizon.dot(to.l)), place.reach + place.turn * to.l.length());
        if height < -behind {
            return Arrival::even(sums);
        }
        let Some(sample) = light.sample(0, to.l) else {
            return Change::UNKNOWN.with(sums);
        };
        let weight = sample.weight.max(sums.cosine()) * 1.25;
        // A spot's rim, a terminator, a shadow's edge
        let rim = match &light.kind {
            LightKind::Spot(spot) => {
                let toward = (-to.l).normalize_or_zero();
                let cos = 1.0 - toward.dot(spot.axis);
                let swing = 2.0 * place.reach / near.max(f32::MIN_POSITIVE);
                if (cos - spot.outer).abs() < swing * 2.0 { 1.0 } else { swing * spot.inverse_fade.min(1e6) * swing }
            }
            _ => 0.0,
        };
        let weight = if rim >= 1.0 { weight.max(1.0 / (near * near).max(f32::MIN_POSITIVE)) } else { weight };
        let edge = if light.shadows && si.receives_shadow { self.edge(index, to.l, to.finite, place) } else { 0.0 };
        let swing = place.turn + place.reach / distance;
        let terminator = if height < behind { swing * 0.5 } else { 0.0 };
        let smooth = swing * swing;
        let share = (edge + rim + terminator + smooth).min(1.0);
        let moved = 2.0 * place.turn + place.reach / distance + self.scene.camera.sway(si.lit_from, place.reach);
        let lobe = (place.lobe.sharpness(si.ns.dot(si.wo)) * square(moved)).min(1.0);
        let specular =
            if matches!(place.lobe, Lobe::None) { 0.0 } else { weight * (edge + rim + terminator + lobe).min(1.0) };
        let resolved = edge == 0.0 && rim == 0.0 && swing < TOLERANCE.resolved && lobe < TOLERANCE.resolved;
        let drift = if edge == 0.0 { 0.0 } else { f32::INFINITY };
        let smooth = resolved && terminator == 0.0;
        Change { bend: Moments::bounds(weight * share, specular), drift, resolved, smooth }.with(sums)
    }

    /// What arrives at one point of a light of one point.
    pub(super) fn of_single(&self, index: usize, place: &ArrivalPlace) -> Moments {
        let unshadowed = SurfaceInteraction { receives_shadow: false, ..*place.si };
        let si = if place.lit { &unshadowed } else { place.si };
        let sums = Plain.gather(self.scene, index, si, place.lobe, &mut Counts::default());
        sums.total()
    }

    /// Whether the edge of a shadow, of a light of one point, may run through the patch: 1, or 0 if that is excluded.
    fn edge(&mut self, light: usize, l: Vec3, finite: bool, place: &ArrivalPlace) -> f32 {
        let (scene, si) = (self.scene, place.si);
        let listed = &scene.occluders;
        if !listed.disks.is_empty()
            || !place.clear && !matches!(self.gather_places(light, std::slice::from_ref(place)), Trees::Nothing)
        {
            return 1.0;
        }
        let length = l.length();
        let d = l / length;
        let end = if finite { length } else { f32::INFINITY };
        let id = LightId(light as u32);
        for (_, Listed { shape: sphere, .. }) in scene.that_stop(&listed.spheres, id) {
            let s = (sphere.c - si.lit_from.as_dvec3()).as_vec3();
            let (r, distance) = (sphere.r as f32, s.length());
            // The surface's own sphere, from outside; not one that another surface runs into
            let is_along = s.dot(si.horizon) < -0.9375 * distance;
            if is_along && sphere.shadow(si.lit_from, si.error).is_on() {
                continue;
            }
            let t = s.dot(d).clamp(0.0, end);
            let miss = (s - d * t).length();
            let through = distance > r + place.reach && end - s.dot(d) > r + place.reach && s.dot(d) > 0.0;
            let slack = place.reach + (distance + length.min(1e30)) * 1e-5;
            if miss > r + slack {
                continue;
            }
            if through && miss < r - slack {
                return 0.0;
            }
            return 1.0;
        }
        let mut edge = 0.0;
        for (_, Listed { shape: flat, .. }) in scene.that_stop(&listed.flats, id) {
            let n = flat.n.as_vec3();
            let height = flat.n.dot(si.lit_from.as_dvec3() - flat.p) as f32;
            let tip = if finite {
                height + n.dot(l)
            } else if n.dot(l) * height < 0.0 {
                -height
            } else {
                height
            };
            let slack = place.reach + (height.abs() + length.min(1e30)) * 1e-5;
            if height.abs() <= slack && flat.shadow(si.lit_from, si.error).is_one_sided(PlaneSide::Both) {
                // The surface's own
                continue;
            }
            if height > slack && tip > slack || height < -slack && tip < -slack {
                continue;
            }
            let t = -f64::from(height) / f64::from(n.dot(l));
            let hit = si.lit_from.as_dvec3() + l.as_dvec3() * t;
            let aside = flat.outside(hit) as f32;
            // Where the way meets the plane at a small angle, it moves there by more than the point
            let wide = slack * (length / n.dot(l).abs()).max(1.0) * 1.25;
            if aside > wide {
                continue;
            }
            if aside < -wide && height.abs() > slack && (!finite || tip.abs() > slack) {
                return 0.0;
            }
            edge = 1.0;
        }
        edge
    }
}

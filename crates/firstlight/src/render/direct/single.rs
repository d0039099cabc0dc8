//! Lights of one point.

use super::{DirectLighting, Group, LightEstimate};
use crate::ids::LightId;
use crate::material::{Moments, ShadingPoint};
use crate::math::Vec3;
use crate::render::Counts;
use crate::render::pixel::Lighting;
use crate::render::plain::Plain;
use crate::scene::Listed;
use crate::shape::PlaneSide;
use crate::visibility::Visibility;

impl DirectLighting<'_> {
    /// Estimates a light of one point.
    pub(super) fn single(&mut self, of: &Group, k: u32, counts: &mut Counts) -> LightEstimate {
        let (light, point, visibility) = (&self.scene.lights[of.light], of.point(k), of.query(k).visibility);
        let moments = self.of_single(of.light, point, visibility);
        counts.points += u64::from(visibility != Visibility::Full);
        let alone = LightEstimate { moments, visibility, ..LightEstimate::NOTHING };
        if point.reach == 0.0 {
            return alone;
        }
        let to = light.towards(0, point.p);
        let height = point.ns.dot(to.l).min(point.horizon.dot(to.l));
        // The motion of the light against the horizon over the footprint
        let room = point.reach + point.turn * to.l.length();
        if height < -room {
            return alone;
        }
        let Some(sample) = light.sample(0, to.l) else {
            return LightEstimate { moments, visibility, ..LightEstimate::UNKNOWN };
        };
        let distance = if to.finite { to.l.length() } else { f32::INFINITY };
        let casts = light.shadows && point.receives_shadow && visibility != Visibility::Full;
        let is_crossed = casts && self.may_cross_shadow(of.light, to.l, to.finite, point, visibility);
        // Irradiance has a corner at the horizon, and at the rim of a spot's cone
        let rim = if height < room { f32::INFINITY } else { light.rim_turn(to.l, point.reach) };
        let turn = self.turn(point, distance).max(rim);
        LightEstimate {
            moments,
            is_uniform: !is_crossed && turn < f32::INFINITY,
            motion: if is_crossed { f32::INFINITY } else { 0.0 },
            turn,
            most: sample.weight.max(moments.cosine()),
            visibility,
        }
    }

    /// The moments of a light of one point.
    pub(super) fn of_single(&self, index: usize, point: &ShadingPoint, visibility: Visibility) -> Moments {
        let receives_shadow = point.receives_shadow && visibility != Visibility::Full;
        let point = ShadingPoint { receives_shadow, ..*point };
        Plain.gather(self.scene, index, &point, &mut Counts::default()).total()
    }

    /// Whether the edge of a shadow, of a light of one point, may cross the footprint.
    fn may_cross_shadow(
        &mut self,
        light: usize,
        l: Vec3,
        finite: bool,
        point: &ShadingPoint,
        visibility: Visibility,
    ) -> bool {
        let scene = self.scene;
        let listed = &scene.occluders;
        if !listed.disks.is_empty() || visibility != Visibility::Listed && !self.is_clear_of_trees(light, point) {
            return true;
        }
        let length = l.length();
        let d = l / length;
        let end = if finite { length } else { f32::INFINITY };
        let id = LightId(light as u32);
        for (_, Listed { shape: sphere, .. }) in scene.that_stop(&listed.spheres, id) {
            let s = (sphere.c - point.p.as_dvec3()).as_vec3();
            let (r, distance) = (sphere.r as f32, s.length());
            // The surface's own sphere, from outside; not one that intersects another surface
            let is_along = s.dot(point.horizon) < -0.9375 * distance;
            if is_along && sphere.shadow(point.p, point.error).is_on() {
                continue;
            }
            let t = s.dot(d).clamp(0.0, end);
            let miss = (s - d * t).length();
            let through = distance > r + point.reach && end - s.dot(d) > r + point.reach && s.dot(d) > 0.0;
            let slack = point.reach + (distance + length.min(1e30)) * 1e-5;
            if miss > r + slack {
                continue;
            }
            if through && miss < r - slack {
                return false;
            }
            return true;
        }
        let mut may_cross = false;
        for (_, Listed { shape: flat, .. }) in scene.that_stop(&listed.flats, id) {
            let n = flat.n.as_vec3();
            let height = flat.n.dot(point.p.as_dvec3() - flat.p) as f32;
            let tip = if finite {
                height + n.dot(l)
            } else if n.dot(l) * height < 0.0 {
                -height
            } else {
                height
            };
            let slack = point.reach + (height.abs() + length.min(1e30)) * 1e-5;
            if height.abs() <= slack && flat.shadow(point.p, point.error).is_one_sided(PlaneSide::Both) {
                // The plane of the surface itself
                continue;
            }
            if height > slack && tip > slack || height < -slack && tip < -slack {
                continue;
            }
            let t = -f64::from(height) / f64::from(n.dot(l));
            let hit = point.p.as_dvec3() + l.as_dvec3() * t;
            let aside = flat.outside(hit) as f32;
            // At a small angle the intersection with the plane moves farther than the point
            let wide = slack * (length / n.dot(l).abs()).max(1.0) * 1.25;
            if aside > wide {
                continue;
            }
            if aside < -wide && height.abs() > slack && (!finite || tip.abs() > slack) {
                return false;
            }
            may_cross = true;
        }
        may_cross
    }
}

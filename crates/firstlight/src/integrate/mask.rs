//! A light behind anything, as cells ask for it: which of its points are hidden, ray by ray, and what they would send.

use std::cell::Cell;

use super::cells::{self, PointSent, PointSource};
use super::emitter::Emitter;
use super::near::Near;
use super::view::{FlatView, Outline};
use crate::accel::RayPacket16;
use crate::ids::LightId;
use crate::material::{Lobe, Moments};
use crate::math::{LANES, ShadowRay, Vec3};
use crate::scene::{Scene, ShadowRays};
use crate::shape::SurfaceInteraction;

/// A light behind things, seen from a surface.
pub(crate) struct Masked<'a> {
    pub scene: &'a Scene,
    pub light: usize,
    pub emitter: &'a Emitter,
    pub si: &'a SurfaceInteraction,
    pub lobe: &'a Lobe,
    /// Whether anything can be in the way.
    pub shadows: bool,
    /// How many points were asked.
    pub asked: &'a Cell<u64>,
}

impl Masked<'_> {
    /// What arrives, by cells from the beginning.
    pub fn by_cells(&self, view: &FlatView, whole: &Moments, enough: &dyn Fn(&Moments, &Moments) -> bool) -> Moments {
        cells::integrate(&self.seen(view), Some(whole), enough).0
    }

    fn seen<'b>(&'b self, view: &'b FlatView) -> MaskedView<'b> {
        let ball = match self.emitter {
            Emitter::Ball { center, radius, .. } => {
                let to = *center - self.si.lit_from.as_dvec3();
                Some((to.as_vec3(), (to.length_squared() - radius * radius).max(0.0) as f32))
            }
            _ => None,
        };
        MaskedView { masked: self, view, ball, near: Near::new(view) }
    }

    /// Which of sixteen ways something stands in.
    pub(super) fn hidden(&self, ways: &[Vec3; LANES], active: u16) -> u16 {
        let lanes = |mask: u16| (0..LANES).filter(move |lane| mask >> lane & 1 == 1);
        self.asked.set(self.asked.get() + u64::from(active.count_ones()));
        if !self.shadows {
            return 0;
        }
        let mut hidden = 0;
        for lane in lanes(active) {
            let ray = self.si.shadow_ray(LightId(self.light as u32), ways[lane], 1.0);
            hidden |= u16::from(self.scene.occluded_by_lists(&ray)) << lane;
        }
        let geometry = &self.scene.geometry;
        let asking = active & !hidden;
        if asking == 0 || !geometry.has_trees() {
            return hidden;
        }
        let from = self.si.shadow_ray(LightId(self.light as u32), Vec3::ZERO, 1.0);
        let mut shadows = ShadowRays { from: &[from], rays: RayPacket16::ZERO, t_end: [0.0; LANES] };
        for (lane, way) in ways.iter().enumerate() {
            shadows.rays.set(lane, from.start, *way);
            shadows.t_end[lane] = ShadowRay { l: *way, ..from }.end();
        }
        hidden | geometry.are_blocked(self.scene.level, &shadows, asking)
    }
}

/// A flat light behind things, as one point sees it.
struct MaskedView<'a> {
    masked: &'a Masked<'a>,
    view: &'a FlatView,
    /// Of a ball: the way to its middle, and the square of the way to where it is touched.
    ball: Option<(Vec3, f32)>,
    /// How points are spread over a light that is very near.
    near: Option<Near>,
}

impl MaskedView<'_> {
    /// What a place of the light would send, if it stands for so much of it.
    fn point(&self, [x, y]: [f32; 2], part: f32) -> Option<PointSent> {
        let view = self.view;
        let (height, cos) = (view.horizon.at(x, y), view.cos.at(x, y));
        if !(height > 0.0 && cos > 0.0) {
            return None;
        }
        let l = view.l(x, y);
        let inverse = 1.0 / l.length();
        let weight = part * if view.physical { view.height * inverse * (inverse * inverse) } else { 1.0 };
        let cos_i = cos * inverse;
        let moments = self.masked.lobe.moments(cos_i, view.cos_o, view.wo.dot(l) * inverse, weight);
        let way = match self.ball {
            None => l,
            // On to the ball's surface
            Some((center, cc)) => {
                let (a, b) = (l.length_squared(), l.dot(center));
                l * ((b - (b * b - a * cc).max(0.0).sqrt()) / a)
            }
        };
        Some(PointSent { way, sums: moments.0 })
    }

    /// From the unit square, and for how much of the light a place stands.
    fn place(&self, at: [f32; 2]) -> ([f32; 2], f32) {
        if let Some(near) = &self.near {
            return near.place(at);
        }
        let square = at.map(|w| 2.0 * w - 1.0);
        let place = match self.view.outline {
            Outline::Parallelogram => square,
            Outline::Disk | Outline::Sphere => crate::light::concentric(square.map(f64::from)).map(|w| w as f32),
        };
        (self.counted(place), 1.0)
    }

    /// A place that is counted from the middle, as the view counts them.
    fn counted(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [x - self.view.origin[0], y - self.view.origin[1]]
    }
}

impl PointSource for MaskedView<'_> {
    fn sent(&self, at: [f32; 2]) -> Option<PointSent> {
        let (place, part) = self.place(at);
        self.point(place, part)
    }

    fn hidden(&self, _: &[[f32; 2]; LANES], ways: &[Vec3; LANES], active: u16) -> u16 {
        self.masked.hidden(ways, active)
    }
}

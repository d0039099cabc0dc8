//! Shadow rays of many places to the same small part of a light, sixteen at a time.
//!
//! The camera rays of a pixel ask different points of a light, of which each small cell of the light holds one for each
//! ray. The shadow rays to one cell are all but the same, so a packet of them meets the same nodes and triangles of the
//! trees, which sixteen rays of one place to sixteen cells do not.
//!
//! Source of packets of shadow rays: Wald, Benthin, Slusallek, Wagner, "Interactive rendering with coherent ray
//! tracing", 2001.

use super::ladder::{Rung, cells_in};
use crate::accel::RayPacket16;
use crate::math::{LANES, LightEnd, ShadowRay, Vec3};
use crate::scene::{Scene, ShadowRays};
use crate::visibility::Viewpoint;

/// A place that asks for its points of a light.
pub(super) struct RungRays<'a> {
    pub point: Viewpoint,
    pub rung: &'a Rung,
    /// What is found: a bit for each point that is hidden, in the light's order.
    pub hidden: &'a mut Vec<u16>,
}

/// Up to sixteen shadow rays towards one light, each with what the caller knows it by.
pub(super) struct Packet {
    to: LightEnd,
    from: [ShadowRay; LANES],
    /// The numbers of the places that `from` holds: those of the last packet are often those of the next.
    places: [u32; LANES],
    rays: RayPacket16,
    points: [u32; LANES],
    count: usize,
}

impl Packet {
    /// `point` is any place, for want of a ray.
    pub fn new(to: LightEnd, point: &Viewpoint) -> Packet {
        let from = [point.ray(to, Vec3::ZERO, true); LANES];
        let (places, points) = ([u32::MAX; LANES], [0; LANES]);
        Packet { to, from, places, rays: RayPacket16::ZERO, points, count: 0 }
    }

    /// Adds a ray from place `number` along `l` to a point, by its number; whether the packet is full now.
    #[inline(always)]
    pub fn add(&mut self, number: u32, place: &Viewpoint, l: Vec3, point: u32) -> bool {
        let lane = self.count % LANES;
        if self.places[lane] != number {
            self.places[lane] = number;
            self.from[lane] = place.ray(self.to, l, true);
            for axis in 0..3 {
                self.rays.o[axis][lane] = place.start[axis];
            }
        }
        for axis in 0..3 {
            self.rays.d[axis][lane] = l[axis];
        }
        self.points[lane] = point;
        self.count += 1;
        self.count == LANES
    }

    /// Traces the rays through the trees and begins anew; their number. `each` hears of those that are hidden: which
    /// place, which point.
    pub fn trace(&mut self, scene: &Scene, mut each: impl FnMut(u32, u32)) -> u64 {
        let count = std::mem::take(&mut self.count);
        if count == 0 {
            return 0;
        }
        let mut t_end = [0.0; LANES];
        for (lane, t_end) in t_end.iter_mut().enumerate().take(count) {
            *t_end = ShadowRay { l: self.rays.d(lane), ..self.from[lane] }.end();
        }
        let shadows = ShadowRays { from: &self.from, rays: self.rays.clone(), t_end };
        let all = ((1u32 << count) - 1) as u16;
        let mut hidden = scene.geometry.are_blocked(scene.level, &shadows, all);
        while hidden != 0 {
            let lane = hidden.trailing_zeros() as usize % LANES;
            hidden &= hidden - 1;
            each(self.places[lane], self.points[lane]);
        }
        count as u64
    }
}

/// Finds which of the points that are `asked` things in trees hide from some places. What is below a place's horizon is
/// not asked. Says how many rays were traced.
pub(super) fn trace(scene: &Scene, to: LightEnd, asked: &[u16], beams: &mut [RungRays]) -> u64 {
    let mut traced = 0;
    let Some(first) = beams.first() else { return traced };
    let mut packet = Packet::new(to, &first.point);
    for beam in beams.iter_mut() {
        beam.hidden.clear();
        beam.hidden.resize(asked.len(), 0);
    }
    let note = |beams: &mut [RungRays], place: u32, k: u32| {
        beams[place as usize].hidden[k as usize / LANES] |= 1 << (k as usize % LANES);
    };
    for cell in cells_in(asked) {
        for place in 0..beams.len() {
            let RungRays { point, rung, .. } = &beams[place];
            let l = rung.points.get(cell) - point.p;
            if point.horizon.dot(l) > 0.0 && packet.add(place as u32, point, l, cell as u32) {
                traced += packet.trace(scene, |place, k| note(beams, place, k));
            }
        }
    }
    traced + packet.trace(scene, |place, k| note(beams, place, k))
}

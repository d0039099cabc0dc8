//! The plain renderer with other points: the same light, point by point, but where on the lights they lie is somebody
//! else's choice. Verification asks for it where equal shares of a light's area would take too many of them.

use super::Counts;
use super::pixel::{Lighting, LobeSums};
use super::plain::{Facing, Plain};
use crate::light::{LightSample, Towards};
use crate::material::{MOMENTS, ShadingPoint};
use crate::math::LaneSum;
use crate::scene::Scene;

/// A point of an area light: of the unit square that stands for it, equal areas for equal areas; and its share of the
/// light, all of which is 1.
pub type LightPoint = ([f64; 2], f64);

/// Writes points of an area light, given as its index, for a surface point; the function says where in the world, in
/// metres, a point of the unit square lies.
pub type ChoosePoints<'a> = dyn FnMut(usize, [f64; 3], &dyn Fn([f64; 2]) -> [f64; 3], &mut Vec<LightPoint>) + 'a;

/// Light, by points that are given.
pub(crate) struct Given<'a, 'b> {
    choose: &'a mut ChoosePoints<'b>,
    points: Vec<LightPoint>,
}

impl<'a, 'b> Given<'a, 'b> {
    pub fn new(choose: &'a mut ChoosePoints<'b>) -> Self {
        Given { choose, points: Vec::new() }
    }
}

impl Lighting for Given<'_, '_> {
    fn look_around(&mut self, _: &Scene, _: &ShadingPoint) {}

    fn gather(&mut self, scene: &Scene, index: usize, point: &ShadingPoint, counts: &mut Counts) -> LobeSums {
        let facing = Facing::new(scene, index, point);
        let Some(area) = facing.light.area() else { return Plain.gather(scene, index, point, counts) };
        self.points.clear();
        let from = point.p.as_dvec3().to_array();
        (self.choose)(index, from, &|uv| area.position(uv), &mut self.points);
        // A light's scale has its number of samples in it
        let count = facing.light.samples() as f64;
        let mut sums = [0.0f64; MOMENTS];
        for (uv, share) in &self.points {
            let (l, inverse_distance, weight) = area.at(*uv, point.p);
            let sample = || inverse_distance.is_finite().then_some(LightSample { inverse_distance, weight });
            if let Some(arriving) = facing.arriving(Towards { l, finite: true }, sample, counts) {
                sums = std::array::from_fn(|k| sums[k] + f64::from(arriving.0[k]) * share);
            }
        }
        LobeSums(sums.map(|sum| {
            let mut total = LaneSum::new();
            total.add(0, (sum * count) as f32);
            total
        }))
    }
}

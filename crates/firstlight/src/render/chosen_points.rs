//! The plain renderer with light points that the caller chooses, for verification: adaptive points need far fewer than
//! equal parts of a light's area.

use super::Counts;
use super::pixel::{Lighting, LobeSums};
use super::plain::{Facing, Plain};
use crate::light::{LightSample, Towards};
use crate::material::{MOMENTS, ShadingPoint};
use crate::math::LaneSum;
use crate::scene::Scene;

/// A point of an area light, in area-preserving coordinates of the unit square, and its share of the light; the shares
/// add up to 1.
pub type LightPoint = ([f64; 2], f64);

/// Appends points of the area light of an index for a surface point. The function maps a point of the unit square to
/// the world, in metres.
pub type ChoosePoints<'a> = dyn FnMut(usize, [f64; 3], &dyn Fn([f64; 2]) -> [f64; 3], &mut Vec<LightPoint>) + 'a;

/// Lighting by chosen points.
pub(crate) struct ChosenPoints<'a, 'b> {
    choose: &'a mut ChoosePoints<'b>,
    points: Vec<LightPoint>,
}

impl<'a, 'b> ChosenPoints<'a, 'b> {
    pub fn new(choose: &'a mut ChoosePoints<'b>) -> Self {
        ChosenPoints { choose, points: Vec::new() }
    }
}

impl Lighting for ChosenPoints<'_, '_> {
    fn gather(&mut self, scene: &Scene, index: usize, point: &ShadingPoint, counts: &mut Counts) -> LobeSums {
        let facing = Facing::new(scene, index, point);
        let Some(area) = facing.light.area() else { return Plain.gather(scene, index, point, counts) };
        self.points.clear();
        let from = point.p.as_dvec3().to_array();
        (self.choose)(index, from, &|uv| area.position(uv), &mut self.points);
        // The scale of a light contains its number of samples
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

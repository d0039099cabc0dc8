//! Whether rays behind things are asked closed forms for a light, or points of it at once: told by what rays of the
//! same cell of pixels were asked before, and by the points that others took.

use crate::integrate::{Arrived, COSTS, Illumination, ShadingPoint};

/// So many places are asked before it is looked whether that pays.
const TOGETHER: usize = 64;

/// What rays of a cell were asked for one light.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Worth {
    /// Places behind things that were asked closed forms, those of them that have one, and the cells and panels asked.
    forms: [f32; 3],
    /// Rays that asked points, and how many.
    points: [f32; 2],
}

impl Worth {
    /// Has closed forms asked at some places, as far as that pays where points of the light would tell as well.
    pub fn ask(
        &mut self,
        points: &mut [ShadingPoint],
        arrived: &mut Vec<Arrived>,
        mut ask: impl FnMut(&[ShadingPoint], &mut Vec<Arrived>),
    ) {
        if !points.iter().all(ShadingPoint::is_bounded) {
            return ask(points, arrived);
        }
        for points in points.chunks_mut(TOGETHER) {
            let (part, first) = (self.part(), arrived.len());
            points.iter_mut().for_each(|point| point.part_of_points *= part);
            ask(points, arrived);
            self.hear_forms(part > 0.0, &arrived[first..]);
        }
    }

    /// The part of what is usual that closed forms may ask.
    fn part(&self) -> f32 {
        let ([places, answered, asked], [rays, points]) = (self.forms, self.points);
        if places >= COSTS.heard && answered < COSTS.answered * places {
            return 0.0;
        }
        if places < COSTS.heard || rays < COSTS.heard {
            return 1.0;
        }
        if asked * COSTS.cell * rays <= answered * points { COSTS.more } else { 0.0 }
    }

    /// Hears what arrived at some places that were asked, or were not to be.
    fn hear_forms(&mut self, is_asked: bool, arrived: &[Arrived]) {
        let asked = || arrived.iter().filter(|one| is_asked && one.asked > 0.0);
        let places = asked().count();
        if is_asked && places == 0 {
            return;
        }
        let answered = asked().filter(|one| one.illumination != Illumination::Unknown).count();
        let cells = asked().map(|one| one.asked).sum();
        let kept = if is_asked { COSTS.remembered } else { COSTS.passed };
        for (sum, more) in self.forms.iter_mut().zip([places as f32, answered as f32, cells]) {
            *sum = *sum * kept + more;
        }
    }

    /// Hears how many points some rays took.
    pub fn hear_points(&mut self, rays: usize, points: usize) {
        for (sum, more) in self.points.iter_mut().zip([rays, points]) {
            *sum = *sum * COSTS.remembered + more as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Moments;
    use crate::math::{ErrorBound, Vec3};

    fn arrived(illumination: Illumination, asked: f32) -> Arrived {
        let sums = Moments::default();
        Arrived { sums, illumination, proved: false, motion: 0.0, distance: 1.0, height: 1.0, asked }
    }

    #[test]
    fn closed_forms_are_asked_where_points_take_longer() {
        let mut worth = Worth::default();
        assert_eq!(worth.part(), 1.0);
        worth.hear_forms(true, &[arrived(Illumination::Partial, 10.0); 16]);
        assert_eq!(worth.part(), 1.0);
        worth.hear_points(16, 16 * 200);
        assert_eq!(worth.part(), COSTS.more);
        worth.hear_points(1000, 0);
        assert_eq!(worth.part(), 0.0);
        // Nobody hears of them as long as they are not asked, and then they are asked again
        (0..200).for_each(|_| worth.hear_forms(false, &[arrived(Illumination::Unknown, 1.0)]));
        assert_eq!(worth.part(), 1.0);
    }

    #[test]
    fn what_points_cannot_tell_is_asked_without_bound() {
        let mut worth = Worth::default();
        worth.hear_points(16, 16 * 200);
        worth.hear_forms(true, &[arrived(Illumination::Unknown, 10.0); 16]);
        let up = Vec3::new(0.0, 1.0, 0.0);
        let known = ShadingPoint::new(Vec3::ZERO, ErrorBound(Vec3::ZERO), up, up);
        let mut points = [known, ShadingPoint { part_of_points: 0.5, ..known }];
        let mut bounds = |points: &mut [ShadingPoint]| {
            let mut bounds = Vec::new();
            worth.ask(points, &mut Vec::new(), |asked, _| {
                bounds.extend(asked.iter().map(|point| point.part_of_points));
            });
            bounds
        };
        assert_eq!(bounds(&mut points[..1]), [f32::INFINITY]);
        assert_eq!(bounds(&mut points[1..]), [0.0]);
    }

    #[test]
    fn closed_forms_that_come_to_nothing_do_not_pay() {
        let mut worth = Worth::default();
        worth.hear_points(16, 16 * 200);
        worth.hear_forms(true, &[arrived(Illumination::Unknown, 10.0); 16]);
        assert_eq!(worth.part(), 0.0);
    }
}

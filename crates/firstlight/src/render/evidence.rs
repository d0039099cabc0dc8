//! What points of a light met that nobody knew of: how much of it is still overlooked.
//!
//! Each time that all leaves of a light are halved, points are asked away from the edges that were found. What those
//! find against expectation is about as much as was overlooked in leaves of that size (Good, "The population
//! frequencies of species and the estimation of population parameters", 1953). A pixel whose points found nothing of
//! the kind knows little, as they are few; but its neighbours look at the light through the same space, so what theirs
//! found counts as well, as far as they are near.

use arrayvec::ArrayVec;

use crate::material::MOMENTS;
use crate::math::Vec3;

/// Neighbours count in full where they are nearer than this part of the width of a leaf. Small things that are in the
/// way of one and not of the other are then so near to the surface that they hide many leaves.
const NEAR: f32 = 1.0 / 20.0;
/// Sizes of leaves, each half of another.
const LEVELS: usize = 16;

/// What points met in leaves of one size, of each kind of light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    /// Effective points.
    pub points: [f32; MOMENTS],
    /// The part of what all send that points sent which found what nobody expected.
    pub surprises: [f32; MOMENTS],
}

/// What points of a patch met, from the largest leaves to the smallest.
#[derive(Clone, Debug, Default)]
pub(super) struct Evidence {
    /// Where the patch is.
    at: Vec3,
    /// How often the light was halved to make the largest leaves.
    first: u32,
    levels: ArrayVec<Met, LEVELS>,
}

impl Evidence {
    pub fn new(at: Vec3) -> Evidence {
        Evidence { at, ..Evidence::default() }
    }

    pub fn is_any(&self) -> bool {
        !self.levels.is_empty()
    }

    /// Hears what was met by now in leaves of a level, the smallest yet.
    pub fn note(&mut self, level: u32, met: Met) {
        if self.levels.is_empty() {
            self.first = level;
        }
        self.levels.truncate((level - self.first) as usize);
        // There is room for all that points are asked in
        let _ = self.levels.try_push(met);
    }

    /// What was met in leaves of half the size of those of a level, or in the smallest there were.
    fn beyond(&self, level: u32) -> &Met {
        let last = self.levels.len() - 1;
        &self.levels[last.min((level + 1).saturating_sub(self.first) as usize)]
    }

    /// The part of what the light sends, of one kind, that may be lit or hidden without anybody knowing: by its own
    /// points and those `around` it, where leaves have this area.
    pub fn overlooked(&self, kind: usize, around: &[&Evidence], leaf: f32) -> f32 {
        let Some(own) = self.levels.last() else { return 1.0 };
        let level = self.first + self.levels.len() as u32 - 1;
        let (mut points, mut surprises) = (own.points[kind].max(1.0), own.points[kind] * own.surprises[kind]);
        for other in around {
            let away = (other.at - self.at).length_squared();
            let weight = (NEAR * NEAR * leaf / away.max(f32::MIN_POSITIVE)).min(1.0);
            let met = other.beyond(level);
            points += weight * met.points[kind];
            surprises += weight * met.points[kind] * met.surprises[kind];
        }
        own.surprises[kind].max(surprises / points) + 1.0 / points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evidence(x: f32, met: &[(f32, f32)]) -> Evidence {
        let mut evidence = Evidence::new(Vec3::new(x, 0.0, 0.0));
        for (k, (points, surprises)) in met.iter().enumerate() {
            evidence.note(4 + k as u32, Met { points: [*points; MOMENTS], surprises: [*surprises; MOMENTS] });
        }
        evidence
    }

    #[test]
    fn neighbours_tell_as_much_as_they_are_near() {
        let own = evidence(0.0, &[(100.0, 0.0)]);
        let other = evidence(0.01, &[(100.0, 0.0), (300.0, 0.0), (900.0, 0.5)]);
        assert_eq!(own.overlooked(0, &[], 1.0), 0.01);
        assert_eq!(own.overlooked(0, &[&other], 1.0), 1.0 / 400.0);
        let far = evidence(1.0, &[(100.0, 0.0), (300.0, 0.0)]);
        assert!((own.overlooked(0, &[&far], 1.0) - 1.0 / 100.75).abs() < 1e-6);
    }

    #[test]
    fn what_neighbours_found_in_smaller_leaves_is_overlooked_here() {
        let own = evidence(0.0, &[(100.0, 0.0)]);
        let other = evidence(0.0, &[(100.0, 0.0), (300.0, 0.2)]);
        assert_eq!(own.overlooked(0, &[&other], 1.0), 0.15 + 1.0 / 400.0);
        // What its own points found is not made less by others
        let own = evidence(0.0, &[(100.0, 0.0), (200.0, 0.3)]);
        assert_eq!(own.overlooked(0, &[&other], 1.0), 0.3 + 1.0 / 500.0);
    }
}

//! What the neighbours of a pixel tell of what light does within it.

use super::ACROSS;
use crate::material::Moments;
use crate::render::patch::{Patch, PixelPatches};
use crate::scene::Scene;

/// In display steps: how much may bend over a patch that is shaded once.
pub(in crate::render) const BEND: f32 = 0.25;
/// By how much the normals of three pixels in a row may differ from turning evenly, in radians.
const EVEN: f32 = 0.02;
/// What light does within a pixel, at most, as a part of its second difference over three: a corner in the middle of
/// the pixel makes an eighth, the onset of a root nearly a fourth.
const WITHIN: f32 = 0.2;

/// Whether a patch fills its pixel and is of the same surface as another, so that one tells something of the other.
fn is_same(scene: &Scene, beside: &Patch, patch: &Patch) -> bool {
    beside.is_whole(scene) && beside.bsdf.lobe == patch.bsdf.lobe && patch.holds(&beside.si)
}

/// How far neighbours along each axis differ from what they foretell of a pixel in their middle, by what arrives `here`
/// and at them, as `arrived` says; `None` where they tell nothing.
pub(in crate::render) fn second_difference(
    scene: &Scene,
    pixels: &[PixelPatches],
    index: usize,
    patch: &Patch,
    here: &Moments,
    arrived: impl Fn(usize) -> Option<Moments>,
) -> Option<[Moments; 2]> {
    let mut differences = [Moments::default(); 2];
    for (difference, step) in differences.iter_mut().zip([1, ACROSS]) {
        let neighbours = [index - step, index + step];
        let same = |i: &usize| matches!(&pixels[*i].patches[..], [beside] if is_same(scene, beside, patch));
        if !neighbours.iter().all(same) {
            return None;
        }
        // Nor do they where an edge of the surface runs between
        let [before, after] = neighbours.map(|i| pixels[i].patches[0].si.ns);
        if !((before + after - patch.si.ns * 2.0).length() <= EVEN) {
            return None;
        }
        let (before, after) = (arrived(neighbours[0])?, arrived(neighbours[1])?);
        let less = |a: Moments, b: Moments| a.zip(b, |a, b| a - b);
        *difference = less(before, *here) + less(after, *here);
    }
    Some(differences)
}

/// How far what light does within a pixel can make its mean another, by its second differences.
pub(in crate::render) fn within(differences: &[Moments; 2]) -> Moments {
    let [x, y] = differences;
    x.zip(*y, |x, y| (x.abs() + y.abs()) * WITHIN)
}

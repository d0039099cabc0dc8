//! Render passes: the scene as it is, and the same scene without shadows; and the buffers that are computed from both,
//! pixel by pixel.

use super::Film;
use crate::ids::{LightGroupId, LightId};
use crate::image::{Buffer, LightPart, Plane, PlaneNumbers};
use crate::light::FEW_LIGHTS;
use crate::math::Vec3;
use crate::scene::Scene;

/// The buffers that are rendered, each once.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Passes {
    /// Of the scene as it is.
    pub picture: Vec<Buffer>,
    /// Of the scene when nothing casts shadows.
    pub unshadowed: Vec<Buffer>,
}

/// What all lights send.
const ALL_LIGHT: [Buffer; 2] = [Buffer::Plane(Plane::Diffuse), Buffer::Plane(Plane::Specular)];

impl Passes {
    /// Those that some buffers of a scene need; where they need nothing else, they themselves in their order.
    pub fn of(scene: &Scene, asked: &[Buffer]) -> Passes {
        let mut passes = Passes::default();
        for buffer in asked {
            if is_rendered(*buffer) {
                add(&mut passes.picture, [*buffer]);
            }
            if *buffer == Plane::Rest.into() {
                add(&mut passes.picture, [Plane::Color.into()]);
                add(&mut passes.picture, beside_rest(scene, asked));
            }
            if buffer.part() == Some(LightPart::Unshadowed) {
                add(&mut passes.unshadowed, [buffer.with_part(None)]);
            }
            if let Some(of) = arriving(*buffer) {
                add(&mut passes.picture, of.iter().copied());
                add(&mut passes.unshadowed, of);
                if may_be_left_out(scene, *buffer).is_some() {
                    add(&mut passes.picture, PLACE);
                }
            }
        }
        passes
    }

    /// The film of the buffers `asked`, from the films of the passes. `cover` lays what hides parts of the picture over
    /// it: not over the visibility of lights.
    pub fn develop(
        scene: &Scene,
        asked: &[Buffer],
        mut picture: Film,
        unshadowed: Option<&Film>,
        cover: impl FnOnce(&mut Film),
    ) -> Film {
        let without = |of: &[Buffer]| of.iter().filter_map(|of| unshadowed?.floats(*of)).collect::<Vec<_>>();
        let made = || asked.iter().copied().filter(|buffer| !is_rendered(*buffer));
        for (buffer, of) in made().filter_map(|buffer| Some((buffer, arriving(buffer)?))) {
            let with: Vec<&[f32]> = of.iter().filter_map(|of| picture.floats(*of)).collect();
            let mut shares = shares(&with, &without(&of));
            if let Some(light) = may_be_left_out(scene, buffer) {
                trace_left_out_light(scene, light, &picture, &with, &mut shares);
            }
            picture.put(scene, buffer, shares);
        }
        cover(&mut picture);
        for buffer in made().filter(|buffer| arriving(*buffer).is_none()) {
            let numbers = if buffer == Plane::Rest.into() {
                let terms = beside_rest(scene, asked).into_iter();
                let (terms, mut numbers): (Vec<Buffer>, Vec<Vec<f32>>) =
                    terms.filter_map(|term| Some((term, picture.floats(term)?.to_vec()))).unzip();
                let rest = rest(picture.floats(Plane::Color.into()).unwrap_or_default(), &mut numbers);
                terms.into_iter().zip(numbers).for_each(|(term, numbers)| picture.put(scene, term, numbers));
                rest
            } else {
                without(&[buffer.with_part(None)]).concat()
            };
            picture.put(scene, buffer, numbers);
        }
        picture.keep(asked);
        picture
    }
}

fn add(to: &mut Vec<Buffer>, buffers: impl IntoIterator<Item = Buffer>) {
    for buffer in buffers {
        if !to.contains(&buffer) {
            to.push(buffer);
        }
    }
}

/// Whether a pass with shadows renders it as it is.
fn is_rendered(buffer: Buffer) -> bool {
    match buffer {
        Buffer::Plane(plane) => !matches!(plane, Plane::Rest | Plane::Shadow),
        Buffer::Light(_, part) | Buffer::Group(_, part) => part.is_none_or(|part| part.moment().is_some()),
        Buffer::Coverage(_) => true,
    }
}

/// Of a buffer that is a share of what would arrive without shadows: of the sum of which.
fn arriving(buffer: Buffer) -> Option<Vec<Buffer>> {
    match (buffer, buffer.part()) {
        (Buffer::Plane(Plane::Shadow), _) => Some(ALL_LIGHT.to_vec()),
        (_, Some(LightPart::Visibility)) => Some(vec![buffer.with_part(None)]),
        _ => None,
    }
}

/// Where a centre ray ends, the normal there, and whether that is on a surface, not on a light.
const PLACE: [Buffer; 3] =
    [Buffer::Plane(Plane::Position), Buffer::Plane(Plane::NormalGeometric), Buffer::Plane(Plane::MaterialId)];

/// The light of a buffer of visibility, if a light cut may leave that light out of pixels where it contributes little.
fn may_be_left_out(scene: &Scene, buffer: Buffer) -> Option<LightId> {
    match buffer {
        Buffer::Light(light, Some(LightPart::Visibility)) if scene.lights.len() > FEW_LIGHTS => Some(light),
        _ => None,
    }
}

/// Computes by shadow rays the visible fraction of a light in the middles of those pixels where its contribution,
/// `with`, is 0: the light may have been left out there, and its share would be 0 as in an umbra.
fn trace_left_out_light(scene: &Scene, light: LightId, picture: &Film, with: &[&[f32]], shares: &mut [f32]) {
    let [places, normals] = [PLACE[0], PLACE[1]].map(|plane| picture.floats(plane).unwrap_or_default());
    let Some(PlaneNumbers::Wholes(materials)) = picture.numbers(PLACE[2]) else { return };
    let at = |of: &[f32], pixel: usize| Vec3::from_slice(&of[3 * pixel..][..3]);
    let is_asked = |pixel: &usize| materials[*pixel] != 0 && with.iter().all(|of| at(of, *pixel) == Vec3::ZERO);
    let pixels: Vec<usize> = (0..shares.len()).filter(is_asked).collect();
    let point = |i: usize| (at(places, pixels[i]).as_dvec3(), Some(at(normals, pixels[i])));
    for (pixel, seen) in pixels.iter().zip(scene.visible_fractions(light, pixels.len(), point)) {
        shares[*pixel] = seen;
    }
}

/// The terms that `rest` complements, in their order: for each light that has a buffer, and for each group with one
/// that holds none of those lights, the buffers of its two parts, or else the one of both.
fn beside_rest(scene: &Scene, asked: &[Buffer]) -> Vec<Buffer> {
    let parts = |of: Buffer| {
        let both = [LightPart::Diffuse, LightPart::Specular].map(|part| of.with_part(Some(part)));
        let asked_of: Vec<Buffer> = both.into_iter().filter(|part| asked.contains(part)).collect();
        if asked_of.len() < 2 && asked.contains(&of) { vec![of] } else { asked_of }
    };
    let mut terms: Vec<Buffer> = [Plane::Background, Plane::Emission, Plane::Ambient].map(Buffer::from).to_vec();
    let mut is_apart = vec![false; scene.lights.len()];
    for (light, is_apart) in (0..).zip(&mut is_apart) {
        let parts = parts(Buffer::Light(LightId(light), None));
        *is_apart = !parts.is_empty();
        terms.extend(parts);
    }
    for (group, (_, lights)) in (0..).zip(&scene.light_groups) {
        if !lights.iter().any(|light| is_apart[*light as usize]) {
            terms.extend(parts(Buffer::Group(LightGroupId(group), None)));
        }
    }
    terms
}

/// Of each pixel: what colours add up to, as a share of what others do.
fn shares(with: &[&[f32]], without: &[&[f32]]) -> Vec<f32> {
    let sum = |of: &[&[f32]], pixel: usize| {
        let channels = of.iter().flat_map(|plane| &plane[3 * pixel..3 * pixel + 3]);
        channels.fold(0.0, |sum, channel| sum + f64::from(*channel))
    };
    let share = |pixel: usize| {
        let all = sum(without, pixel);
        if all > 0.0 { (sum(with, pixel) / all).clamp(0.0, 1.0) as f32 } else { 0.0 }
    };
    (0..without.first().map_or(0, |plane| plane.len() / 3)).map(share).collect()
}

/// What of the colour is left without some terms: added to their sum, it is the colour.
fn rest(color: &[f32], terms: &mut [Vec<f32>]) -> Vec<f32> {
    let mut of = |at: usize, color: f32| {
        let mut here: Vec<f32> = terms.iter().map(|term| term[at]).collect();
        let rest = closing(color, &mut here);
        terms.iter_mut().zip(here).for_each(|(term, here)| term[at] = here);
        rest
    };
    let pixels = color.chunks_exact(4).enumerate();
    pixels.flat_map(|(pixel, color)| [0, 1, 2].map(|channel| of(3 * pixel + channel, color[channel]))).collect()
}

/// The number that closes a sum: terms, added up one after the other, and it are the whole, in 32-bit floats. For some
/// sums no float does, such as 1/2 of the whole's last place: then a term, the largest that helps, is taken down by its
/// last place, which is within what it was rounded by.
fn closing(whole: f32, terms: &mut [f32]) -> f32 {
    let rest = |terms: &[f32]| {
        let sum = terms.iter().fold(0.0, |sum, term| sum + term);
        let rest = whole - sum;
        (rest, sum + rest == whole)
    };
    let (nearest, closes) = rest(terms);
    if closes || !nearest.is_finite() {
        return nearest;
    }
    let mut by_size: Vec<usize> = (0..terms.len()).filter(|term| terms[*term] > 0.0).collect();
    by_size.sort_by(|a, b| terms[*b].total_cmp(&terms[*a]));
    for term in by_size {
        let given = terms[term];
        // The last place of the sum may be several of the term's
        for _ in 0..64 {
            terms[term] = terms[term].next_down();
            if let (rest, true) = rest(terms) {
                return rest;
            }
        }
        terms[term] = given;
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_closes_every_sum() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((state >> 11) as f64 / (1u64 << 53) as f64) as f32
        };
        let mut moved = 0;
        for _ in 0..100_000 {
            let scale = 1.0 / (1u32 << (random() * 19.0) as u32) as f32;
            let given = [random() * scale, 0.25 * random() * scale, if random() < 0.3 { 0.0 } else { random() * 0.1 }];
            let whole = given.iter().sum::<f32>() * (1.0 + 8.0 * random());
            let mut terms = given;
            let rest = closing(whole, &mut terms);
            assert_eq!(terms.iter().fold(0.0, |sum, term| sum + term) + rest, whole, "{given:?} {whole}");
            for (term, given) in terms.into_iter().zip(given) {
                assert!(term <= given && given - term <= 2.0 * f32::EPSILON * whole, "{term:e} {given:e} {whole:e}");
            }
            moved += usize::from(terms != given);
        }
        assert!((100..10_000).contains(&moved), "{moved}");
        assert_eq!(closing(0.25, &mut []), 0.25);
        assert!(closing(f32::NAN, &mut [1.0]).is_nan() && closing(f32::INFINITY, &mut [1.0]) == f32::INFINITY);
    }
}

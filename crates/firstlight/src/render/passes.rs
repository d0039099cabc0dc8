//! What a film is rendered for: the picture with what is told of its pixels, and the same scene without shadows. What
//! is made of both, pixel by pixel, when they are there.

use super::film::Film;
use crate::ids::{LightGroupId, LightId};
use crate::image::{Buffer, LightPart, Plane, PlaneNumbers};
use crate::scene::Scene;

/// The buffers that are rendered, each once.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Passes {
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
            }
        }
        passes
    }

    /// The film of what was asked for, from the films of the passes.
    pub fn develop(scene: &Scene, asked: &[Buffer], mut picture: Film, unshadowed: Option<&Film>) -> Film {
        let without = |of: &[Buffer]| of.iter().filter_map(|of| unshadowed?.floats(*of)).collect::<Vec<_>>();
        for buffer in asked.iter().copied().filter(|buffer| !is_rendered(*buffer)) {
            let numbers = match arriving(buffer) {
                Some(of) => {
                    let with: Vec<&[f32]> = of.iter().filter_map(|of| picture.floats(*of)).collect();
                    shares(&with, &without(&of))
                }
                None if buffer == Plane::Rest.into() => {
                    let terms: Vec<Buffer> = beside_rest(scene, asked);
                    let terms: Vec<&[f32]> = terms.iter().filter_map(|term| picture.floats(*term)).collect();
                    rest(picture.floats(Plane::Color.into()).unwrap_or_default(), &terms)
                }
                None => without(&[buffer.with_part(None)]).concat(),
            };
            picture.add(scene, buffer, &numbers);
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

/// The terms that `rest` is added to, in their order: of each light, or group of none of those, that is asked for, its
/// two parts or else what is asked of it.
fn beside_rest(scene: &Scene, asked: &[Buffer]) -> Vec<Buffer> {
    let parts = |of: Buffer| {
        let both = [LightPart::Diffuse, LightPart::Specular].map(|part| of.with_part(Some(part)));
        let asked_of: Vec<Buffer> = both.into_iter().filter(|part| asked.contains(part)).collect();
        if asked_of.len() < 2 && asked.contains(&of) { vec![of] } else { asked_of }
    };
    let mut terms: Vec<Buffer> = [Plane::Background, Plane::Emission, Plane::Ambient].map(Buffer::from).to_vec();
    let mut is_apart = vec![false; scene.lights.len()];
    for buffer in asked {
        if let Buffer::Light(LightId(light), _) = buffer {
            is_apart[*light as usize] = true;
        }
    }
    let lights = (0..scene.lights.len()).filter(|light| is_apart[*light]);
    terms.extend(lights.flat_map(|light| parts(Buffer::Light(LightId(light as u32), None))));
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

/// What of the colour is left without some terms: the difference from their sum, rounded once.
fn rest(color: &[f32], terms: &[&[f32]]) -> Vec<f32> {
    let of = |at: usize, color: f32| color - terms.iter().fold(0.0, |sum, term| sum + term[at]);
    let pixels = color.chunks_exact(4).enumerate();
    pixels.flat_map(|(pixel, color)| [0, 1, 2].map(|channel| of(3 * pixel + channel, color[channel]))).collect()
}

impl Film {
    /// The numbers of a plane of floats.
    fn floats(&self, of: Buffer) -> Option<&[f32]> {
        match self.numbers(of)? {
            PlaneNumbers::Floats(numbers) => Some(numbers),
            PlaneNumbers::Wholes(_) => None,
        }
    }
}

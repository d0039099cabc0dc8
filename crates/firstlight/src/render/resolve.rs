//! From what the camera rays of a pixel see to its colour: a picture is the sum of these terms in one fixed order.

use std::ops::Range;

use crate::color::Rgb;
use crate::ids::LightId;
use crate::image::{Buffer, LightPart, Plane};
use crate::material::Colors;
use crate::scene::Scene;

/// A term of a pixel's colour: a mean over its rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Term {
    Background,
    Emission,
    Ambient,
    /// A moment of what a light sends; of no light, of what is taken together where there are many.
    Light(Option<u32>, usize),
}

/// Pixels as the sums of their terms; of those that are to be kept, with all that were added to them.
pub(crate) struct TermSums {
    /// Red, green, blue premultiplied, alpha.
    pub colors: Vec<[f32; 4]>,
    /// What each took.
    pub work: Vec<f32>,
    /// The sums of some terms alone.
    kept: Vec<(Buffer, Vec<[f32; 3]>)>,
}

/// What the rays of a pixel see beside the light of lights, added up.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelTerms {
    /// How many of them meet nothing.
    pub background: u32,
    /// Of lights that are seen.
    pub emission: Rgb,
    pub ambient: Rgb,
}

/// What one light sends to the surfaces that they see, added up, with the surfaces' colours and without the light's
/// scale: diffuse and specular.
pub(crate) type LightTerm = Colors;

/// The same with the light it is of and its scale; of no light, what is taken together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScaledTerm {
    pub light: Option<u32>,
    pub scale: Rgb,
    pub term: LightTerm,
}

impl ScaledTerm {
    /// Of all lights, in scene order.
    pub fn of_all(scales: impl Iterator<Item = Rgb>, terms: &[LightTerm]) -> impl Iterator<Item = ScaledTerm> {
        (0..).zip(scales).zip(terms).map(|((light, scale), term)| ScaledTerm { light: Some(light), scale, term: *term })
    }
}

impl PixelTerms {
    /// Makes pixel `at` of `sums` the mean over the rays. `lights` come in scene order, each with its scale, which is
    /// applied to its means.
    pub fn resolve(&self, scene: &Scene, lights: impl Iterator<Item = ScaledTerm>, at: usize, sums: &mut TermSums) {
        let rays = (scene.antialiasing * scene.antialiasing) as f32;
        let uncovered = self.background as f32 / rays;
        let mean = |sum: Rgb| Rgb::new(sum.r / rays, sum.g / rays, sum.b / rays);
        let (background, alpha) =
            if scene.transparent { (Rgb::BLACK, 1.0 - uncovered) } else { (scene.background * uncovered, 1.0) };
        sums.begin(at..at + 1, background, alpha);
        let mut add = |term: Term, value: Rgb| sums.add(at, term, std::iter::once(value));
        add(Term::Emission, mean(self.emission));
        add(Term::Ambient, mean(self.ambient));
        for ScaledTerm { light, scale, term } in lights {
            for (moment, part) in term.0.into_iter().enumerate() {
                add(Term::Light(light, moment), scale * mean(part));
            }
        }
    }
}

impl Term {
    /// Whether a buffer is a sum that this belongs to.
    fn is_of(self, buffer: Buffer) -> bool {
        match (self, buffer) {
            (Term::Background, Buffer::Plane(plane)) => plane == Plane::Background,
            (Term::Emission, Buffer::Plane(plane)) => plane == Plane::Emission,
            (Term::Ambient, Buffer::Plane(plane)) => plane == Plane::Ambient,
            (Term::Light(_, moment), Buffer::Plane(plane)) => plane == [Plane::Diffuse, Plane::Specular][moment],
            (Term::Light(light, moment), Buffer::Light(LightId(of), part)) => {
                light == Some(of) && part.is_none_or(|part| part == [LightPart::Diffuse, LightPart::Specular][moment])
            }
            (_, Buffer::Light(..)) => false,
        }
    }
}

impl TermSums {
    /// So many, with those buffers that are sums of some terms.
    pub fn new(pixels: usize, buffers: &[Buffer]) -> TermSums {
        let kept = buffers.iter().filter(|buffer| buffer.plane().is_of_terms());
        TermSums {
            colors: vec![[0.0; 4]; pixels],
            work: vec![0.0; pixels],
            kept: kept.map(|buffer| (*buffer, vec![[0.0; 3]; pixels])).collect(),
        }
    }

    /// Begins the sums of some pixels.
    #[inline(always)]
    pub fn begin(&mut self, pixels: Range<usize>, background: Rgb, alpha: f32) {
        let Rgb { r, g, b } = background;
        self.colors[pixels.clone()].fill([r, g, b, alpha]);
        for (buffer, sums) in &mut self.kept {
            sums[pixels.clone()].fill(if Term::Background.is_of(*buffer) { [r, g, b] } else { [0.0; 3] });
        }
    }

    /// Adds a term to pixels side by side, from number `first` on.
    #[inline(always)]
    pub fn add(&mut self, first: usize, term: Term, values: impl Iterator<Item = Rgb> + Clone) {
        for ([r, g, b, _], value) in self.colors[first..].iter_mut().zip(values.clone()) {
            (*r, *g, *b) = (*r + value.r, *g + value.g, *b + value.b);
        }
        for (_, sums) in self.kept.iter_mut().filter(|(buffer, _)| term.is_of(*buffer)) {
            for ([r, g, b], value) in sums[first..].iter_mut().zip(values.clone()) {
                (*r, *g, *b) = (*r + value.r, *g + value.g, *b + value.b);
            }
        }
    }

    /// The colour of a pixel by now.
    pub fn color(&self, at: usize) -> Rgb {
        let [r, g, b, _] = self.colors[at];
        Rgb::new(r, g, b)
    }

    /// The sums of some terms; `None` if they are not kept.
    pub fn kept(&self, of: Buffer) -> Option<&[[f32; 3]]> {
        self.kept.iter().find(|(buffer, _)| *buffer == of).map(|(_, sums)| &sums[..])
    }
}

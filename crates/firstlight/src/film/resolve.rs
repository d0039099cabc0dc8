//! The colour of a pixel: the sum of its terms (background, emission, ambient light, moments of each light) in one
//! fixed order.

use std::ops::Range;

use crate::color::Rgb;
use crate::image::{Buffer, LightPart, Plane};
use crate::material::{LightTerm, PARTS};
use crate::scene::Scene;

/// A term of a pixel's colour: a mean over its rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Term {
    Background,
    Emission,
    Ambient,
    /// A moment of the light of one light; `None` is all lights that a cut takes together.
    Light(Option<u32>, usize),
    /// The same of one light among those that are taken together: a part of that term, not one of the colour.
    Apart(u32, usize),
}

/// The sums of the terms of some pixels, and of subsets of the terms for the buffers that need them.
pub(crate) struct TermSums {
    /// Red, green, blue premultiplied, alpha.
    pub colors: Vec<[f32; 4]>,
    /// The work for each, in the unit of [`Heat`](super::Heat).
    pub work: Vec<f32>,
    /// The sums of some terms alone, in the order of their buffers.
    kept: Vec<KeptSum>,
    /// For each term, the indices of the sums in `kept` that contain it.
    of_term: Vec<Vec<u32>>,
    /// The number of lights of the scene.
    lights: usize,
}

/// The sum of some terms, for a buffer.
struct KeptSum {
    /// Whether the scales of lights are left out.
    unscaled: bool,
    pixels: Vec<[f32; 3]>,
}

/// Sums over the rays of a pixel of all terms but the light of lights. Of a ray with layers each counts as the part of
/// the ray that ends there.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelTerms {
    /// The parts of rays that nothing stops: 1 of each without a hit.
    pub background: f64,
    /// The emission of visible lights and of surfaces.
    pub emission: Emission,
    pub ambient: Rgb,
}

/// The sum of emission over rays. In 64 bits, so that it does not depend on the order.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Emission([f64; 3]);

impl Emission {
    /// Adds the radiance of what `rays` rays meet, parts of rays included.
    pub fn add(&mut self, radiance: Rgb, rays: f64) {
        for (sum, radiance) in self.0.iter_mut().zip(radiance.to_array()) {
            *sum += f64::from(radiance) * rays;
        }
    }

    /// The mean over `rays` rays.
    pub fn mean(&self, rays: u32) -> Rgb {
        Rgb::from_array(self.0.map(|sum| (sum / f64::from(rays)) as f32))
    }
}

/// The reflected light of one light, summed over the rays of a pixel, and the light's scale, which is not in it; `None`
/// is all lights that a cut takes together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScaledTerm {
    pub light: Option<u32>,
    pub scale: Rgb,
    pub term: LightTerm,
}

impl ScaledTerm {
    /// The terms of all lights, in scene order.
    pub fn of_all(scales: impl Iterator<Item = Rgb>, terms: &[LightTerm]) -> impl Iterator<Item = ScaledTerm> {
        (0..).zip(scales).zip(terms).map(|((light, scale), term)| ScaledTerm { light: Some(light), scale, term: *term })
    }
}

impl PixelTerms {
    /// Adds the terms of single lights, which are no terms of the colour, to the sums of pixel `at` for buffers.
    pub fn keep_apart(scene: &Scene, lights: &[ScaledTerm], at: usize, sums: &mut TermSums) {
        let rays = (scene.antialiasing * scene.antialiasing) as f32;
        for ScaledTerm { light, scale, term } in lights {
            let Some(light) = *light else { continue };
            for (part, value) in term.0.into_iter().enumerate() {
                sums.keep(at, Term::Apart(light, part), *scale, std::iter::once(value * (1.0 / rays)));
            }
        }
    }

    /// Makes pixel `at` of `sums` the mean over the rays. `lights` come in scene order, each with its scale, which is
    /// applied to its means.
    pub fn resolve(&self, scene: &Scene, lights: impl Iterator<Item = ScaledTerm>, at: usize, sums: &mut TermSums) {
        let rays = (scene.antialiasing * scene.antialiasing) as f32;
        let uncovered = self.background as f32 / rays;
        let mean = |sum: Rgb| Rgb::new(sum.r / rays, sum.g / rays, sum.b / rays);
        let (background, alpha) =
            if scene.transparent { (Rgb::BLACK, 1.0 - uncovered) } else { (scene.background * uncovered, 1.0) };
        sums.begin(at..at + 1, background, alpha);
        let mut add = |term: Term, scale: Rgb, value: Rgb| sums.add(at, term, scale, std::iter::once(value));
        add(Term::Emission, Rgb::WHITE, self.emission.mean(scene.antialiasing * scene.antialiasing));
        add(Term::Ambient, Rgb::WHITE, mean(self.ambient));
        for ScaledTerm { light, scale, term } in lights {
            for (part, value) in term.0.into_iter().enumerate() {
                add(Term::Light(light, part), scale, mean(value));
            }
        }
    }
}

impl Term {
    /// Its index among the terms of a picture.
    #[inline(always)]
    fn index(self, lights: usize) -> usize {
        match self {
            Term::Background => 0,
            Term::Emission => 1,
            Term::Ambient => 2,
            Term::Light(light, part) => 3 + light.map_or(0, |light| light as usize + 1) * PARTS + part,
            Term::Apart(light, part) => 3 + (1 + lights + light as usize) * PARTS + part,
        }
    }

    /// The terms that a buffer is the sum of.
    fn of(scene: &Scene, buffer: Buffer) -> Vec<Term> {
        let all = || std::iter::once(None).chain((0..scene.lights.len() as u32).map(Some));
        match buffer {
            Buffer::Plane(Plane::Background) => vec![Term::Background],
            Buffer::Plane(Plane::Emission) => vec![Term::Emission],
            Buffer::Plane(Plane::Ambient) => vec![Term::Ambient],
            Buffer::Plane(Plane::Diffuse) => all().map(|light| Term::Light(light, 0)).collect(),
            Buffer::Plane(Plane::Specular) => all().map(|light| Term::Light(light, 1)).collect(),
            Buffer::Plane(_) | Buffer::Coverage(_) => Vec::new(),
            Buffer::Light(_, part) | Buffer::Group(_, part) => {
                let moments = match part.and_then(LightPart::moment) {
                    Some(moment) => moment..moment + 1,
                    None => 0..PARTS,
                };
                let lights = scene.lights_of(buffer);
                let terms = |light| {
                    let of = move |moment| [Term::Light(Some(light), moment), Term::Apart(light, moment)];
                    moments.clone().flat_map(of)
                };
                lights.into_iter().flat_map(terms).collect()
            }
        }
    }
}

impl TermSums {
    /// Sums for `pixels` pixels of a scene, and for those of `buffers` that are sums of terms.
    pub fn new(scene: &Scene, pixels: usize, buffers: &[Buffer]) -> TermSums {
        let kept: Vec<Buffer> = buffers.iter().copied().filter(|buffer| buffer.is_of_terms()).collect();
        let unscaled = |buffer: &Buffer| buffer.part().is_some_and(LightPart::is_unscaled);
        let sum = |buffer: &Buffer| KeptSum { unscaled: unscaled(buffer), pixels: vec![[0.0; 3]; pixels] };
        let lights = scene.lights.len();
        let terms = if kept.is_empty() { 0 } else { Term::Apart(lights as u32, 0).index(lights) };
        let mut of_term = vec![Vec::new(); terms];
        for (k, buffer) in (0..).zip(&kept) {
            Term::of(scene, *buffer).into_iter().for_each(|term| of_term[term.index(lights)].push(k));
        }
        TermSums {
            colors: vec![[0.0; 4]; pixels],
            work: vec![0.0; pixels],
            kept: kept.iter().map(sum).collect(),
            of_term,
            lights,
        }
    }

    /// Resets the sums of some pixels to the background.
    #[inline(always)]
    pub fn begin(&mut self, pixels: Range<usize>, background: Rgb, alpha: f32) {
        let Rgb { r, g, b } = background;
        self.colors[pixels.clone()].fill([r, g, b, alpha]);
        for sum in &mut self.kept {
            sum.pixels[pixels.clone()].fill([0.0; 3]);
        }
        if !self.kept.is_empty() {
            let all = std::iter::repeat_n(background, pixels.len());
            self.keep(pixels.start, Term::Background, Rgb::WHITE, all);
        }
    }

    /// Adds a term, `scale` times the values, to successive pixels from `first` on.
    #[inline(always)]
    pub fn add(&mut self, first: usize, term: Term, scale: Rgb, values: impl Iterator<Item = Rgb> + Clone) {
        for ([r, g, b, _], value) in self.colors[first..].iter_mut().zip(values.clone()) {
            let value = scale * value;
            (*r, *g, *b) = (*r + value.r, *g + value.g, *b + value.b);
        }
        if !self.kept.is_empty() {
            self.keep(first, term, scale, values);
        }
    }

    /// Adds a term to the sums for buffers, not to the colours.
    pub fn keep(&mut self, first: usize, term: Term, scale: Rgb, values: impl Iterator<Item = Rgb> + Clone) {
        for k in &self.of_term[term.index(self.lights)] {
            let KeptSum { unscaled, pixels } = &mut self.kept[*k as usize];
            for ([r, g, b], value) in pixels[first..].iter_mut().zip(values.clone()) {
                let value = if *unscaled { value } else { scale * value };
                (*r, *g, *b) = (*r + value.r, *g + value.g, *b + value.b);
            }
        }
    }

    /// The sum of a pixel's terms so far.
    pub fn color(&self, at: usize) -> Rgb {
        let [r, g, b, _] = self.colors[at];
        Rgb::new(r, g, b)
    }

    /// The sums for buffers, in their order.
    pub fn kept(&self) -> impl Iterator<Item = &[[f32; 3]]> {
        self.kept.iter().map(|sum| &sum.pixels[..])
    }
}

//! Light, integrated: what arrives from an area light at a point, to a stated error, without a fixed set of samples.
//!
//! Before it stands visibility, which says what may be in the way; after it the film. A point takes one of these roads:
//! - the light is seen whole and is well above the horizon: one Gauss rule, its order by distance and sharpness
//!   ([`tensor`]);
//! - a few convex things are in the way, or the horizon cuts the light, or the light is near: row by row, with
//!   intervals in closed form, the error measured and brought under its bound ([`rows`]);
//! - anything else: the share of the light that points of it see, which the renderer asks for all rays of a pixel
//!   together; where points do not tell, cells that are cut where shadows have their edges ([`cells`], [`mask`]).
//!
//! A highlight that is narrow beside the light is integrated by itself, over the part of the light that it covers.

mod batch;
mod between;
mod cells;
mod classify;
mod cut;
mod emitter;
mod evaluate;
mod fit;
mod hider;
mod hull;
mod lobe;
mod mask;
mod near;
mod occluder;
mod panels;
mod points;
mod rows;
mod rules;
mod solids;
mod tensor;
mod tolerance;
mod view;

use std::ops::{Add, Mul};

use arrayvec::ArrayVec;
use fearless_simd::prelude::*;

pub(crate) use batch::ShadingPoint;
pub(crate) use between::{Asker, Between};
pub(crate) use classify::Obstacles;
pub(crate) use emitter::Emitter;
pub(crate) use evaluate::{Arrived, Asked, Evaluator, Illumination};
use hider::Hider;
pub(crate) use mask::Masked;
use rows::{MAX_HIDERS, Region};
pub(crate) use tensor::sharpness;
pub(crate) use tolerance::Tolerance;
pub(crate) use view::{Outline, Receiver, View};

use crate::material::Lobe;

/// What arrives from one light, before all colours: the weight times the cosine, and the weight times the highlight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    pub diffuse: f32,
    pub specular: f32,
}

impl Add for Sums {
    type Output = Sums;

    #[inline(always)]
    fn add(self, other: Sums) -> Sums {
        Sums { diffuse: self.diffuse + other.diffuse, specular: self.specular + other.specular }
    }
}

impl Mul<f32> for Sums {
    type Output = Sums;

    #[inline(always)]
    fn mul(self, times: f32) -> Sums {
        Sums { diffuse: self.diffuse * times, specular: self.specular * times }
    }
}

/// Which of the two are asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    pub diffuse: bool,
    pub specular: bool,
}

/// What arrives from a flat light that only `hiders` stand in front of, and how far it can be wrong.
///
/// `enough(sums, error)` says whether an error will do, given what is known so far.
pub(crate) fn integrate<S: Simd>(
    simd: S,
    view: &View,
    hiders: &[Hider],
    enough: &dyn Fn(&Sums, &Sums) -> bool,
) -> (Sums, Sums) {
    let whole = Region::whole(view);
    let is_clear = hiders.is_empty() && view.is_above_horizon();
    let both = Wanted { diffuse: true, specular: !matches!(view.lobe, Lobe::None) };
    let diffuse_only = Wanted { diffuse: true, specular: false };
    let specular_only = Wanted { diffuse: false, specular: true };
    // A highlight that ends within the light
    if let Some(end) = lobe::end(view)
        && hiders.len() < MAX_HIDERS
    {
        let blunt = View { lobe: Lobe::None, ..*view };
        let (diffuse, diffuse_error) = integrate(simd, &blunt, hiders, enough);
        let Some(end) = end else { return (diffuse, diffuse_error) };
        let enough = |sums: &Sums, error: &Sums| enough(&(*sums + diffuse), &(*error + diffuse_error));
        let mut hiders: ArrayVec<Hider, MAX_HIDERS> = hiders.iter().copied().collect();
        hiders.push(end);
        let (specular, specular_error) = rows::integrate(simd, view, &hiders, &whole, specular_only, &enough);
        return (diffuse + specular, diffuse_error + specular_error);
    }
    if is_clear && let Some(order) = tensor::order(view, &whole) {
        return (tensor::integrate(simd, view, &whole, both, order), Sums::default());
    }
    // A highlight that is narrow beside the light
    let Some(narrow) = lobe::region(view) else {
        return rows::integrate(simd, view, hiders, &whole, both, enough);
    };
    let blunt = View { lobe: Lobe::None, ..*view };
    let (diffuse, diffuse_error) = match is_clear.then(|| tensor::order(&blunt, &whole)).flatten() {
        Some(order) => (tensor::integrate(simd, &blunt, &whole, diffuse_only, order), Sums::default()),
        None => rows::integrate(simd, &blunt, hiders, &whole, diffuse_only, enough),
    };
    let Some(region) = narrow else { return (diffuse, diffuse_error) };
    let enough = |sums: &Sums, error: &Sums| enough(&(*sums + diffuse), &(*error + diffuse_error));
    let order = if is_clear && view.outline == Outline::Parallelogram { tensor::order(view, &region) } else { None };
    let (specular, specular_error) = match order {
        Some(order) => (tensor::integrate(simd, view, &region, specular_only, order), Sums::default()),
        None => rows::integrate(simd, view, hiders, &region, specular_only, &enough),
    };
    (diffuse + specular, diffuse_error + specular_error)
}

/// What arrives from a flat light that nothing stands in front of; `None` where the horizon cuts it and some points of
/// it tell as much: where much of it is above, it is not near, and no highlight on it is narrow.
pub(crate) fn unshadowed<S: Simd>(simd: S, view: &View, enough: &dyn Fn(&Sums, &Sums) -> bool) -> Option<Sums> {
    let is_even = !view.is_above_horizon()
        && view.is_half_above_horizon()
        && tensor::order(view, &Region::whole(view)).is_some()
        && lobe::end(view).is_none();
    (!is_even).then(|| integrate(simd, view, &[], enough).0)
}

#[cfg(test)]
mod tests;

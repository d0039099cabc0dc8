//! Integration of area lights: irradiance moments from one light at many points, to an error estimate, without a
//! fixed set of samples.
//!
//! [`visibility`](crate::visibility) gathers the occluders in trees before it; [`render`](crate::render) adds the
//! result to pixels. Occluders here are spheres, parallelograms, solids and triangles. Lights behind anything else
//! have the result [`Visibility::Partial`], and the renderer samples them.

mod batch;
mod breaks;
mod cell;
mod classify;
mod emitter;
mod hull;
mod integrator;
mod light_frame;
mod occluder;
mod panels;
mod row;
mod subdivide;
mod tolerance;

pub(crate) use classify::LightOccluders;
pub(crate) use emitter::Emitter;
pub(crate) use integrator::{AreaLightIntegrator, LightIntegral, LightTask};
pub(crate) use tolerance::{COSTS, TOLERANCE};

#[cfg(test)]
mod tests;

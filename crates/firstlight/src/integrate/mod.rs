//! Light, integrated: what arrives from an area light at a point, to a stated error, without a fixed set of samples.
//!
//! Before it stands visibility, which says what may be in the way; after it the film. Points are asked in batches of
//! sixteen ([`evaluate`]), whatever spheres, flat things, solids and tori stand between. For anything else the renderer
//! asks points of the light for all rays of a pixel together; where those do not tell, cells that are cut where shadows
//! have their edges ([`cells`], [`mask`]).

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
pub(crate) use integrator::{AreaLightIntegrator, Illumination, LightIntegral, LightTask};
pub(crate) use tolerance::{COSTS, TOLERANCE};

#[cfg(test)]
mod tests;

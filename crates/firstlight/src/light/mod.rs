//! Lights: where light comes from, and how much. A light never traces rays.

mod directional;
mod point;
mod rectangle;
mod samples;
mod spot;

use crate::describe::words;

pub use directional::DirectionalDesc;
pub use point::PointDesc;
pub use rectangle::RectangleDesc;
pub use samples::SampleSet;
pub use spot::SpotDesc;

words! {
    /// How light weakens on its way.
    pub enum Falloff {
        /// As light does: inverse square, and the cosine at an area's surface. `strength` is candela for point and spot,
        /// lux for directional, radiance for areas.
        Physical = "physical",
        /// The classic model: `color` x `strength` from every point of the light, whatever the distance and the light's
        /// own angle; an area light is the mean over its area.
        Constant = "constant",
    }
}

words! {
    /// The sides of an area light that emit. A side that does not emit is not seen.
    pub enum EmitSides {
        /// The side e0 x e1 points to.
        Front = "front",
        /// Both sides.
        Both = "both",
    }
}

/// A light as a scene may say it.
#[derive(Clone, Debug, PartialEq)]
pub enum LightDesc {
    /// `[[light.point]]`
    Point(PointDesc),
    /// `[[light.directional]]`
    Directional(DirectionalDesc),
    /// `[[light.spot]]`
    Spot(SpotDesc),
    /// `[[light.rectangle]]`
    Rectangle(RectangleDesc),
}

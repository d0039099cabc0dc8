//! Lights: where light comes from, and how much. A light never traces rays.

mod area;
mod bounds;
mod directional;
mod disk;
mod point;
mod points;
mod rectangle;
mod samples;
mod sphere;
mod spot;
mod tree;

use std::borrow::Borrow;

use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::{ColorDesc, Family, SamplesDesc, family, words};
use crate::math::{ErrorBound, UNIT_ROUNDOFF, Vec3};
use crate::transform::TransformDesc;

pub use area::{Area, AreaShape};
pub use directional::{Directional, DirectionalDesc};
pub use disk::{DiskLight, DiskLightDesc};
pub use point::{Point, PointDesc};
pub use rectangle::{Rectangle, RectangleDesc};
pub use samples::SampleSet;
pub(crate) use samples::{FineCell, SERIES, SeriesPart, mix, with_gaps};
pub use sphere::{SphereLight, SphereLightDesc};
pub use spot::{Spot, SpotDesc};

pub(crate) use area::check_samples;
pub(crate) use bounds::{ContributionBounds, EmissionProfile, ReceiverBounds};
pub(crate) use points::{PointBlock, Points};
pub(crate) use tree::{FEW_LIGHTS, LightNode, LightTree, NodeContents};

words! {
    /// How light weakens on its way.
    pub enum Falloff {
        /// As light does: inverse square, and the cosine at an area's surface. `strength` is candela for point and
        /// spot, lux for directional, radiance for areas.
        Physical = "physical",
        /// The classic model: `color` x `strength` from every point of the light, whatever the distance and the light's
        /// own angle; an area light is the mean over its area.
        Constant = "constant",
    }
}

words! {
    /// The sides of an area light that emit. A side that does not emit is not seen.
    pub enum EmitSides {
        /// The side that e0 x e1, or `normal`, points to; the outside of a sphere.
        Front = "front",
        /// Both sides.
        Both = "both",
    }
}

family! {
    /// A light as a scene may say it.
    pub enum LightDesc: "light" {
        /// `[[light.point]]`
        Point(PointDesc) = "point",
        /// `[[light.directional]]`
        Directional(DirectionalDesc) = "directional",
        /// `[[light.spot]]`
        Spot(SpotDesc) = "spot",
        /// `[[light.rectangle]]`
        Rectangle(RectangleDesc) = "rectangle",
        /// `[[light.disk]]`
        Disk(DiskLightDesc) = "disk",
        /// `[[light.sphere]]`
        Sphere(SphereLightDesc) = "sphere",
    }
}

/// Declares the table of a light: its own fields between those that all lights have, the unit of its strength, and
/// what only area lights say.
macro_rules! light_table {
    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident { $($own:tt)* }
        $(#[doc = $unit:literal])*
        strength $({ $($emission:tt)* } { $($sampling:tt)* })?
    ) => {
        $crate::describe::table! {
            $(#[doc = $doc])*
            pub struct $name {
                /// What reports call it.
                pub name: Option<String> = None,
                /// The group of lights that it belongs to, for buffers: `group:NAME`.
                pub group: Option<String> = None,
                $($own)*
                /// Linear colour; channels of 0 or more.
                pub color: $crate::describe::ColorDesc = $crate::describe::ColorDesc::WHITE,
                $(#[doc = $unit])*
                pub strength: f64 = 1.0,
                /// How light weakens on its way.
                pub falloff: $crate::light::Falloff = $crate::light::Falloff::Physical,
                $($($emission)*)?
                /// Whether its light can be blocked.
                pub shadows: bool = true,
                $($($sampling)*)?
            }
        }
    };
}

use light_table;

/// An expression of the table of a light, whatever its kind.
macro_rules! of_table {
    ($light:expr, $table:ident => $value:expr) => {
        match $light {
            LightDesc::Point($table) => $value,
            LightDesc::Directional($table) => $value,
            LightDesc::Spot($table) => $value,
            LightDesc::Rectangle($table) => $value,
            LightDesc::Disk($table) => $value,
            LightDesc::Sphere($table) => $value,
        }
    };
}

impl LightDesc {
    /// Lights in scene order: kind by kind, in each the order of the text.
    pub(crate) fn in_scene_order<L: Borrow<LightDesc>>(lights: impl IntoIterator<Item = L>) -> impl Iterator<Item = L> {
        let mut lights: Vec<L> = lights.into_iter().collect();
        lights.sort_by_cached_key(|light| light.borrow().kind_index());
        lights.into_iter()
    }

    /// The light; `samples` is the scene's default for area lights.
    pub(crate) fn compile(&self, cx: &mut CompileContext, samples: SamplesDesc) -> Light {
        match self {
            LightDesc::Point(point) => point.compile(cx),
            LightDesc::Directional(directional) => directional.compile(cx),
            LightDesc::Spot(spot) => spot.compile(cx),
            LightDesc::Rectangle(rectangle) => rectangle.compile(cx, samples),
            LightDesc::Disk(disk) => disk.compile(cx, samples),
            LightDesc::Sphere(sphere) => sphere.compile(cx, samples),
        }
    }

    /// Moves it.
    pub(crate) fn set_transform(&mut self, moved: Option<Box<TransformDesc>>) {
        of_table!(self, light => light.transform = moved);
    }

    /// Names it.
    pub(crate) fn set_name(&mut self, said: Option<String>) {
        of_table!(self, light => light.name = said);
    }

    /// Its name, if it has one.
    pub fn name(&self) -> Option<String> {
        of_table!(self, light => light.name.clone())
    }

    /// The group of lights that it belongs to, if any.
    pub fn group(&self) -> Option<&str> {
        of_table!(self, light => light.group.as_deref())
    }

    /// Its strength, and how it weakens on its way.
    pub fn strength(&self) -> (f64, Falloff) {
        of_table!(self, light => (light.strength, light.falloff))
    }

    /// Where it is moved, if it says so.
    pub fn transform(&self) -> Option<&TransformDesc> {
        of_table!(self, light => light.transform.as_deref())
    }

    /// How an area light is sampled: its own `samples`, if it says any, and how the points are laid out. `None` for a
    /// light without an area.
    pub fn samples(&self) -> Option<(Option<SamplesDesc>, SampleSet)> {
        match self {
            LightDesc::Point(_) | LightDesc::Directional(_) | LightDesc::Spot(_) => None,
            LightDesc::Rectangle(light) => Some((light.samples, light.set)),
            LightDesc::Disk(light) => Some((light.samples, light.set)),
            LightDesc::Sphere(light) => Some((light.samples, light.set)),
        }
    }

    /// Has an area light say its own `samples`; other lights stay as they are.
    pub fn set_samples(&mut self, samples: SamplesDesc) {
        match self {
            LightDesc::Point(_) | LightDesc::Directional(_) | LightDesc::Spot(_) => {}
            LightDesc::Rectangle(light) => light.samples = Some(samples),
            LightDesc::Disk(light) => light.samples = Some(samples),
            LightDesc::Sphere(light) => light.samples = Some(samples),
        }
    }
}

/// A compiled light.
#[derive(Clone, Debug)]
pub struct Light {
    /// Its place and shape.
    pub kind: LightKind,
    /// The factor of each sample's weight: `color` x `strength`, over the number of samples, and over pi
    /// where the light is physical, so that it meets materials that give pi x BRDF x cosine.
    pub scale: Rgb,
    /// The factor of the integral over the whole light: `color` x `strength`, over pi where the light is physical. The
    /// integral over its area takes this in place of `scale`, which has the area and the number of samples in it.
    pub intensity: Rgb,
    /// What the camera sees of it: `color` x `strength`.
    pub radiance: Rgb,
    /// What `scale` and `intensity` come of.
    pub said: [LightScale; 2],
    /// Whether its light can be blocked.
    pub shadows: bool,
    /// Whether it is integrated, not sampled. It has samples all the same, for renderers that sample every light.
    pub exact: bool,
}

/// How much light it is, before rounding: `color` x `strength` x `factor`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightScale {
    /// Linear, as the scene says it.
    pub color: [f64; 3],
    /// As the scene says it.
    pub strength: f64,
    /// What the kind of light, and the number of its samples, make of it.
    pub factor: f64,
}

impl LightScale {
    pub(crate) fn exact(&self) -> [f64; 3] {
        self.color.map(|c| c * self.strength * self.factor)
    }

    /// As renderers multiply with it.
    pub(crate) fn rgb(&self) -> Rgb {
        Rgb::from_array(self.exact().map(|c| c as f32))
    }

    /// What a camera sees of the light.
    pub(crate) fn radiance(&self) -> Rgb {
        Rgb::from(ColorDesc::from(self.color)) * self.strength as f32
    }
}

/// The place and shape of a light.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "lights are few, and asked for often")]
pub enum LightKind {
    /// `[[light.point]]`
    Point(Point),
    /// `[[light.directional]]`
    Directional(Directional),
    /// `[[light.spot]]`
    Spot(Spot),
    /// `[[light.rectangle]]`, `[[light.disk]]`, `[[light.sphere]]`
    Area(Area),
}

/// The way from a surface to one point of a light.
#[derive(Clone, Copy, Debug)]
pub struct Towards {
    /// From the surface to the light's point, in metres; or unit, towards a light infinitely far away.
    pub l: Vec3,
    /// Whether `l` ends at the light.
    pub finite: bool,
}

/// One point of a light, seen from a surface.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// 1 / |l|.
    pub inverse_distance: f32,
    /// How much arrives, before [`Light::scale`]; 0 or more.
    pub weight: f32,
}

/// Light points nearer than the root of this, in metres, are at the surface's own point and send nothing.
pub(crate) const MIN_DISTANCE2: f32 = 1e-30;

impl Light {
    /// Makes it as gray as it is bright.
    pub(crate) fn make_gray(&mut self) {
        for light in [&mut self.scale, &mut self.intensity, &mut self.radiance] {
            *light = Rgb::gray(light.luminance());
        }
    }

    /// Its area, if it has one, which is sampled or integrated: what the camera can see of it, and what can stand in
    /// the way of others. Without one it comes from one point, or from one direction: one sample is all of it.
    /// A light of that place and shape, of which `said` is how much light one sample is, and all of it.
    fn new(kind: LightKind, said: [LightScale; 2], shadows: bool, exact: bool) -> Light {
        let [scale, intensity] = said.map(|scale| scale.rgb());
        Light { kind, scale, intensity, radiance: said[1].radiance(), said, shadows, exact }
    }

    /// The emitting surface of an area light: the camera sees it, and it occludes other lights. It is sampled or
    /// integrated. Point, spot and directional lights have none: one sample is their whole contribution.
    #[inline(always)]
    pub fn area(&self) -> Option<&Area> {
        match &self.kind {
            LightKind::Area(area) => Some(area),
            LightKind::Point(_) | LightKind::Directional(_) | LightKind::Spot(_) => None,
        }
    }

    /// Unit normal of the plane that all of it lies in; 0 of one that is not flat.
    pub(crate) fn plane(&self) -> Vec3 {
        self.area().and_then(|area| area.shape.flat_normal()).unwrap_or(Vec3::ZERO)
    }

    /// Whether it is an area light that is integrated, not sampled.
    pub(crate) fn is_integrated(&self) -> bool {
        self.exact && self.area().is_some()
    }

    /// How many points of it are sampled, 1 or more; of a light that is `exact`, where it is sampled all the same.
    #[inline(always)]
    pub fn samples(&self) -> usize {
        self.area().map_or(1, Area::samples)
    }

    /// Its number of samples, or that it is integrated; one sample of a light without an area.
    pub fn said_samples(&self) -> SamplesDesc {
        if self.exact { SamplesDesc::Exact } else { SamplesDesc::Count(self.samples() as u32) }
    }

    /// The way from `p` to sample `k`.
    #[inline(always)]
    pub fn towards(&self, k: usize, p: Vec3) -> Towards {
        let to = |q: Vec3| Towards { l: q - p, finite: true };
        match &self.kind {
            LightKind::Point(Point { position, .. }) | LightKind::Spot(Spot { position, .. }) => to(*position),
            LightKind::Area(area) => to(area.point(k)),
            LightKind::Directional(directional) => Towards { l: directional.to_light, finite: false },
        }
    }

    /// How high above the plane through `p` with normal `n` (unit) a point of the light has to be to count as above it:
    /// as far as rounding can lift one that lies in the plane. `error` is that of `p`. In metres; of a light infinitely
    /// far away, in parts of its unit direction.
    ///
    /// A light that lies in the plane of a surface would else send to it, from those of its points that rounding lifts,
    /// what no cosine weakens: highlights.
    #[inline(always)]
    pub fn floor(&self, p: Vec3, error: ErrorBound, n: Vec3) -> f32 {
        match &self.kind {
            LightKind::Directional(directional) => n.abs().dot(directional.to_light.abs()) * (4.0 * UNIT_ROUNDOFF),
            LightKind::Point(Point { position, .. }) | LightKind::Spot(Spot { position, .. }) => {
                n.abs().dot(way_error(*position, Vec3::ZERO, p, error))
            }
            LightKind::Area(area) => area.floor(p, error, n),
        }
    }

    /// The turn of the light over a footprint of radius `reach` that makes as much as the fading of a spot's cone;
    /// infinite where its rim may cross. `l` leads from the footprint's middle to the light.
    pub(crate) fn rim_turn(&self, l: Vec3, reach: f32) -> f32 {
        if let LightKind::Spot(spot) = &self.kind { spot.rim_turn(l, reach) } else { 0.0 }
    }

    /// How much arrives from sample `k`, to which `l` leads from a surface. `None` where the two are the same point.
    #[inline(always)]
    pub fn sample(&self, k: usize, l: Vec3) -> Option<LightSample> {
        let distance2 = l.dot(l);
        if !(distance2 >= MIN_DISTANCE2) {
            return None;
        }
        let inverse_distance = 1.0 / distance2.sqrt();
        let weight = match &self.kind {
            LightKind::Point(point) => point.weight(inverse_distance),
            LightKind::Directional(_) => 1.0,
            LightKind::Spot(spot) => spot.weight(l, inverse_distance),
            LightKind::Area(area) => area.weight(k, l, inverse_distance),
        };
        Some(LightSample { inverse_distance, weight })
    }
}

/// How far, along each axis, a way from `p` to a point within `half` of `middle` can be wrong by rounding, together
/// with what its product with a unit vector adds: the errors of both ends, and four roundings of the way itself.
pub(crate) fn way_error(middle: Vec3, half: Vec3, p: Vec3, error: ErrorBound) -> Vec3 {
    let (far, way) = (middle.abs() + half, (middle - p).abs() + half);
    error.0 + (far + way * 4.0) * UNIT_ROUNDOFF
}

/// `color` x `strength`, checked; `factor` is what the kind of light makes of it.
fn scaled(cx: &mut CompileContext, color: ColorDesc, strength: f64, factor: f64) -> LightScale {
    let fine = cx.fault_count();
    cx.color("color", color);
    cx.strength(strength);
    let scaled = LightScale { color: color.linear, strength, factor };
    // What a material makes of it has to be a number still
    if cx.fault_count() == fine && !scaled.exact().iter().all(|c| *c <= MAX_LIGHT) {
        let message = format!("{strength} is too much for a light of this colour and size: together they pass 1e30");
        cx.error("strength", message, Some("use a weaker light and raise the exposure"));
    }
    scaled
}

/// The most light that one channel of one light sends, in the unit it is computed with.
pub(crate) const MAX_LIGHT: f64 = 1e30;

impl Falloff {
    /// Irradiance over pi where it is physical, the plain number where not.
    fn factor(self) -> f64 {
        match self {
            Falloff::Physical => std::f64::consts::FRAC_1_PI,
            Falloff::Constant => 1.0,
        }
    }
}

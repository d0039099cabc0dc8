//! Shadow catchers, as their shadows are found: the scenes in which camera rays end at them.
//!
//! In the scene itself camera rays pass them as if they were not there. Three more scenes have them, all with the same
//! occluders: two in which they are white and all else is black, with and without shadows, and one in which they are
//! black themselves. `film/catchers.rs` makes the picture of all of them.

use std::sync::Arc;

use super::geometry::Geometry;
use super::occluders::ListedOccluders;
use super::place::compile_shapes;
use super::{Scene, SceneDesc};
use crate::color::{Display, Encoding, Rgb, ToneMapping};
use crate::context::{Assets, CompileContext};
use crate::light::{FEW_LIGHTS, Light};
use crate::material::{Ambient, Material};
use crate::shape::MeshFiles;

/// What rays can meet where camera rays end at shadow catchers.
#[derive(Clone, Debug)]
pub(crate) struct Catchers {
    geometry: Arc<Geometry>,
    occluders: ListedOccluders,
}

/// By so many stops light is raised where nothing is known of how much there is: into the part of the curve of
/// [`DisplaySteps`](crate::color::DisplaySteps) beyond white, where errors count as parts of the value.
const RAISED: f64 = 40.0;
/// The part of the tolerance that light with shadows may be off where a background is shown: it is off by less than a
/// third of what it may.
const PART_OF_OPAQUE: f64 = 1.5;
/// Shadows over a dark background are as exact as over one so many stops below white: other things may be behind them.
const MOST_STOPS: i32 = 4;
/// The part of the tolerance that the light without shadows may be off: it takes little time, and what is divided by it
/// is to be as exact as the picture is. So may that of many lights with shadows: light cuts are off where nothing is
/// hidden as well, and what they are off is no shadow.
const PART_OF_TOLERANCE: f64 = 0.25;

impl SceneDesc {
    /// The shapes of the compiled scene `here` with its shadow catchers, if it has any.
    pub(super) fn compile_catchers(
        &self,
        cx: &CompileContext,
        assets: &dyn Assets,
        files: &MeshFiles<'_>,
        here: &Scene,
    ) -> Option<Arc<Catchers>> {
        if !here.materials.iter().any(Material::is_shadow_catcher) {
            return None;
        }
        // All that there is to say was said of the scene itself
        let silent = &mut CompileContext::at_time(here.moment);
        silent.progress = cx.progress.clone();
        let files = &mut files.again();
        let geometry = compile_shapes(self, &here.materials, true, silent, assets, files)?;
        let occluders = ListedOccluders::new(&geometry, &here.lights);
        Some(Arc::new(Catchers { geometry: Arc::new(geometry), occluders }))
    }
}

impl Scene {
    /// The scene in which shadow catchers are black surfaces.
    pub(crate) fn with_black_catchers(&self, catchers: &Catchers) -> Scene {
        let Catchers { geometry, occluders } = catchers.clone();
        Scene { geometry, occluders, leaves_out_black: true, ..self.clone() }
    }

    /// The scene in which shadow catchers are white, all else is black and lights are gray. Of ambient light it has 1;
    /// see [`ShadowCatcher`](crate::material::ShadowCatcher). What is white is shown as the background is, or as alpha.
    pub(crate) fn with_lit_catchers(&self, catchers: &Catchers) -> Scene {
        let mut scene = self.with_black_catchers(catchers);
        scene.materials.iter_mut().for_each(|material| *material = material.as_caught());
        scene.lights.iter_mut().for_each(Light::make_gray);
        scene.ambient = Ambient::new(Rgb::WHITE, Rgb::WHITE);
        scene.tolerance *= match scene.lights.len() {
            ..=FEW_LIGHTS if self.transparent => 1.0,
            ..=FEW_LIGHTS => PART_OF_OPAQUE,
            _ => PART_OF_TOLERANCE,
        };
        if self.transparent {
            scene.display = Display { encoding: Encoding::Linear, exposure: 0.0, tone_mapping: ToneMapping::None };
        }
        scene
    }

    /// How bright what is seen past catchers is shown, in stops: that of the background, rounded up; 0 of a transparent
    /// or a black one, or of one that is brighter than white.
    pub(crate) fn stops_behind_catchers(&self) -> i32 {
        let Rgb { r, g, b } = self.background;
        let shown = r.max(g).max(b) * self.display.factor() as f32;
        if self.transparent || !(shown > 0.0 && shown < 1.0) {
            return 0;
        }
        // One more than the exponent
        ((shown.to_bits() >> 23) as i32 - 126).max(-MOST_STOPS)
    }

    /// By how much less than alpha what is shown of a bright background changes: the slope of the display curve at
    /// white.
    pub(crate) fn slope_behind_catchers(&self) -> f32 {
        match self.display.encoding {
            _ if self.transparent => 1.0,
            Encoding::Srgb => 0.44,
            Encoding::Gamma(gamma) => (1.0 / gamma).min(1.0) as f32,
            Encoding::Linear => 1.0,
        }
    }

    /// The same, in which nothing casts shadows. Errors count as parts of the light that arrives.
    pub(crate) fn with_unshadowed_catchers(&self, catchers: &Catchers) -> Scene {
        let mut scene = self.with_lit_catchers(catchers);
        scene.lights.iter_mut().for_each(|light| light.shadows = false);
        scene.display = Display { encoding: Encoding::Linear, exposure: RAISED, tone_mapping: ToneMapping::None };
        scene.tolerance = self.tolerance * PART_OF_TOLERANCE;
        scene
    }
}

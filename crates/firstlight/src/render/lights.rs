//! The lights of a scene as they are asked: what all threads share.

use super::pooled::LightPointSets;
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{Emitter, LightOccluders, LightTask, TOLERANCE};
use crate::light::{FEW_LIGHTS, Light, LightTree};
use crate::material::LobeKind;
use crate::scene::Scene;
use crate::visibility::Target;

/// What all tiles share: the lights as they are integrated, and how errors show.
pub(crate) struct Lights<'a> {
    /// Those whose unoccluded light is integrated without samples; and how many of them are integrated.
    pub emitters: Vec<Option<Emitter>>,
    pub integrated: usize,
    /// What the sums of each are multiplied with, before the colours of the surface.
    pub scales: Vec<Rgb>,
    pub steps: DisplaySteps,
    /// Where there are many.
    pub tree: Option<LightTree>,
    /// The lights as shafts lead to them.
    pub targets: Vec<Target>,
    /// The points of those that are integrated.
    pub point_sets: Vec<LightPointSets>,
    /// What may stand in the way of those that have an area.
    pub obstacles: Vec<LightOccluders<'a>>,
    /// In display steps: how far one light may be wrong at a point that stands for a pixel; and the value that many
    /// steps above black.
    pub allowed: f32,
    pub least: f32,
}

impl<'a> Lights<'a> {
    pub fn new(scene: &'a Scene) -> Lights<'a> {
        let emitters: Vec<_> = scene.lights.iter().map(Emitter::of).collect();
        let scale = |light: &Light| if light.is_integrated() { light.intensity } else { light.scale };
        let scales = scene.lights.iter().map(scale).collect();
        let targets = Target::of_all(scene);
        let point_sets = emitters.iter().map(|_| LightPointSets::default()).collect();
        let tree = (scene.lights.len() > FEW_LIGHTS)
            .then(|| LightTree::new(&scene.lights, &scene.geometry.links.classes(scene.lights.len())));
        let obstacles = emitters.iter().enumerate().map(|(index, emitter)| {
            emitter.as_ref().map_or_else(LightOccluders::default, |emitter| LightOccluders::new(scene, index, emitter))
        });
        let obstacles = obstacles.collect();
        let steps = DisplaySteps::new(&scene.display, scene.tolerance);
        // Errors of lights that are not integrated are none, or asked for
        let integrated = scene.lights.iter().filter(|light| light.is_integrated()).count();
        let allowed = TOLERANCE.point / (integrated.max(1) as f32).sqrt();
        let least = steps.value_of(allowed);
        Lights { emitters, integrated, scales, steps, tree, targets, point_sets, obstacles, allowed, least }
    }

    /// Whether anything in trees may be in the way of light `index`, but for planes that are told row by row.
    pub fn has_trees(&self, scene: &Scene, index: usize) -> bool {
        let geometry = &scene.geometry;
        let stops = |thing: &u32| geometry.stops(geometry.placed[*thing as usize].shadow, LightId(index as u32));
        geometry.has_boxes() || !self.know(index, geometry.unbounded.iter().copied().filter(stops))
    }

    /// Whether all of these placed things are told row by row where they are in the way of light `index`.
    pub fn know(&self, index: usize, placed: impl IntoIterator<Item = u32>) -> bool {
        placed.into_iter().all(|thing| self.obstacles[index].has_placed(thing))
    }

    /// Light `index` as points of one lobe are evaluated for it, with or without what occludes it; `None` if it has no
    /// area.
    pub fn task<'b>(&'b self, index: usize, lobe: Option<LobeKind>, shadows: bool) -> Option<LightTask<'b>> {
        self.emitters[index].as_ref().map(|emitter| LightTask {
            emitter,
            listed: &self.obstacles[index],
            lobe,
            scale: self.scales[index],
            steps: &self.steps,
            allowed: self.allowed,
            least: self.least,
            shadows,
            sums: true,
        })
    }
}

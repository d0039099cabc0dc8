//! The lights of a scene, prepared for integration and sampling; shared by all threads.

use super::pooled::LightPointSets;
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{Emitter, LightOccluders, LightTask, TOLERANCE};
use crate::light::{FEW_LIGHTS, Light, LightTree};
use crate::material::LobeKind;
use crate::scene::Scene;
use crate::visibility::Target;

/// The lights of a scene, and the weight of their errors.
pub(crate) struct Lights<'a> {
    /// Those whose unoccluded light is integrated without samples; and how many of them are integrated.
    pub emitters: Vec<Option<Emitter>>,
    pub integrated: usize,
    /// The factor of the moments of each, before the colours of the surface.
    pub scales: Vec<Rgb>,
    pub steps: DisplaySteps,
    /// Where there are more than [`FEW_LIGHTS`].
    pub tree: Option<LightTree>,
    /// The lights as ends of shafts.
    pub targets: Vec<Target>,
    /// The points of those that are integrated.
    pub point_sets: Vec<LightPointSets>,
    /// The listed occluders of those that have an area.
    pub obstacles: Vec<LightOccluders<'a>>,
    /// In display steps: the allowed error of one light at a point that represents a pixel; and the value that many
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
        // Nodes are lit or not: what veils leave of a light is known light by light
        let tree = (scene.lights.len() > FEW_LIGHTS && !scene.has_blends())
            .then(|| LightTree::new(&scene.lights, &scene.geometry.links.classes(scene.lights.len())));
        let obstacles = emitters.iter().enumerate().map(|(index, emitter)| {
            emitter.as_ref().map_or_else(LightOccluders::default, |emitter| LightOccluders::new(scene, index, emitter))
        });
        let obstacles = obstacles.collect();
        let steps = DisplaySteps::new(&scene.display, scene.tolerance);
        // Lights that are not integrated have no errors, or their sample count was chosen
        let integrated = scene.lights.iter().filter(|light| light.is_integrated()).count();
        let allowed = TOLERANCE.point / (integrated.max(1) as f32).sqrt();
        let least = steps.value_of(allowed);
        Lights { emitters, integrated, scales, steps, tree, targets, point_sets, obstacles, allowed, least }
    }

    /// Whether anything in trees, or not opaque, may stop some of light `index`, but for planes that have a closed
    /// form.
    pub fn has_trees(&self, scene: &Scene, index: usize) -> bool {
        let geometry = &scene.geometry;
        let stops = |thing: &u32| geometry.stops(geometry.placed[*thing as usize].shadow, LightId(index as u32));
        geometry.is_sampled_past() || !self.know(index, geometry.unbounded.iter().copied().filter(stops))
    }

    /// Whether all of these placed shapes have a closed form as occluders of light `index`.
    pub fn know(&self, index: usize, placed: impl IntoIterator<Item = u32>) -> bool {
        placed.into_iter().all(|thing| self.obstacles[index].has_placed(thing))
    }

    /// The integration of light `index` at points whose lobes are of one kind, with or without occluders; `None` if it
    /// has no area.
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

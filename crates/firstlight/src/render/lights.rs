//! The lights of a scene as they are asked: what all threads share.

use super::many::FEW;
use super::pooled::LightPointSets;
use crate::color::{DisplaySteps, Rgb};
use crate::ids::LightId;
use crate::integrate::{Asked, Emitter, Obstacles, TOLERANCE};
use crate::light::{Light, LightTree};
use crate::material::Lobe;
use crate::scene::Scene;
use crate::visibility::Target;

/// What all tiles share: the lights as they are integrated, and how errors show.
pub(crate) struct Lights<'a> {
    /// For each light, if it is integrated; and how many are.
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
    pub obstacles: Vec<Obstacles<'a>>,
    /// In display steps: how far one light may be wrong at a point that stands for a pixel; and the value that many
    /// steps above black.
    pub allowed: f32,
    pub least: f32,
}

impl<'a> Lights<'a> {
    pub fn new(scene: &'a Scene) -> Lights<'a> {
        let emitter = |light: &Light| light.area().filter(|_| light.exact).map(Emitter::new);
        let emitters: Vec<_> = scene.lights.iter().map(emitter).collect();
        let scale = |(light, emitter): (&Light, &Option<Emitter>)| match emitter {
            Some(_) => light.intensity,
            None => light.scale,
        };
        let scales = scene.lights.iter().zip(&emitters).map(scale).collect();
        let targets = Target::of_all(scene);
        let point_sets = emitters.iter().map(|_| LightPointSets::default()).collect();
        let tree = (scene.lights.len() > FEW)
            .then(|| LightTree::new(&scene.lights, &scene.geometry.links.classes(scene.lights.len())));
        let obstacles = scene.lights.iter().enumerate().map(|(index, light)| {
            light.area().map_or_else(Obstacles::default, |area| Obstacles::new(scene, index, &Emitter::new(area)))
        });
        let obstacles = obstacles.collect();
        let steps = DisplaySteps::new(&scene.display, scene.tolerance);
        // Errors of lights that are not integrated are none, or asked for
        let integrated = emitters.iter().flatten().count();
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

    /// Light `index` as batches ask for it, with one highlight, with or without what stands in its way; `None` if it is
    /// not integrated.
    pub fn asked<'b>(&'b self, index: usize, lobe: &'b Lobe, shadows: bool) -> Option<Asked<'b>> {
        self.emitters[index].as_ref().map(|emitter| self.asked_of(index, emitter, lobe, shadows))
    }

    pub fn asked_of<'b>(&'b self, index: usize, emitter: &'b Emitter, lobe: &'b Lobe, shadows: bool) -> Asked<'b> {
        Asked {
            emitter,
            obstacles: &self.obstacles[index],
            near: None,
            lobe,
            steps: &self.steps,
            allowed: self.allowed,
            least: self.least,
            shadows,
            sums: true,
        }
    }
}

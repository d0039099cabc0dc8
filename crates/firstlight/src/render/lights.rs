//! The lights of a scene, prepared for integration and sampling; shared by all threads.

use std::sync::OnceLock;

use super::pooled::LightPointSets;
use crate::color::{Display, DisplaySteps, Rgb};
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
    pub steps: JudgedSteps,
    /// The same at so many stops more or less, from [`DARKEST`] on: of light that is judged as it is raised by them.
    raised: Vec<OnceLock<JudgedSteps>>,
    display: Display,
    tolerance: f64,
    /// Where there are more than [`FEW_LIGHTS`].
    pub tree: Option<LightTree>,
    /// The lights as ends of shafts.
    pub targets: Vec<Target>,
    /// The points of those that are integrated.
    pub point_sets: Vec<LightPointSets>,
    /// The listed occluders of those that have an area.
    pub obstacles: Vec<LightOccluders<'a>>,
    /// In display steps: the allowed error of one light at a point that represents a pixel.
    pub allowed: f32,
}

/// The display curve by which errors are weighed, and the value that is as many steps above black as one light may be
/// off.
pub(crate) struct JudgedSteps {
    pub curve: DisplaySteps,
    pub least: f32,
}

/// The range of stops.
const DARKEST: i32 = -64;
const BRIGHTEST: i32 = 64;

impl JudgedSteps {
    fn new(display: &Display, tolerance: f64, allowed: f32) -> JudgedSteps {
        let curve = DisplaySteps::new(display, tolerance);
        let least = curve.value_of(allowed);
        JudgedSteps { curve, least }
    }
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
        // Lights that are not integrated have no errors, or their sample count was chosen
        let integrated = scene.lights.iter().filter(|light| light.is_integrated()).count();
        let allowed = TOLERANCE.point / (integrated.max(1) as f32).sqrt();
        let (display, tolerance) = (scene.display, scene.tolerance);
        let steps = JudgedSteps::new(&display, tolerance, allowed);
        let raised = (DARKEST..=BRIGHTEST).map(|_| OnceLock::new()).collect();
        Lights {
            emitters,
            integrated,
            scales,
            steps,
            raised,
            display,
            tolerance,
            tree,
            targets,
            point_sets,
            obstacles,
            allowed,
        }
    }

    /// The display curve for light that is raised by so many stops, in place of the exposure of the scene.
    pub fn steps_at(&self, stop: i32) -> &JudgedSteps {
        let stop = stop.clamp(DARKEST, BRIGHTEST);
        self.raised[(stop - DARKEST) as usize].get_or_init(|| {
            let display = Display { exposure: f64::from(stop), ..self.display };
            JudgedSteps::new(&display, self.tolerance, self.allowed)
        })
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

    /// The integration of light `index` at points whose lobes are of one kind, with or without occluders, its errors
    /// weighed by `steps`; `None` if it has no area.
    pub fn task<'b>(
        &'b self,
        index: usize,
        lobe: Option<LobeKind>,
        shadows: bool,
        steps: &'b JudgedSteps,
    ) -> Option<LightTask<'b>> {
        self.emitters[index].as_ref().map(|emitter| LightTask {
            emitter,
            listed: &self.obstacles[index],
            lobe,
            scale: self.scales[index],
            steps: &steps.curve,
            allowed: self.allowed,
            least: steps.least,
            shadows,
            sums: true,
        })
    }
}

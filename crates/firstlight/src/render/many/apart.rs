//! Lights that are kept apart of what is taken together: what each sends by itself, beside the sum.

use super::BY_REPRESENTATIVE;
use super::block::sent;
use crate::color::Rgb;
use crate::film::resolve::ScaledTerm;
use crate::image::Buffer;
use crate::light::{LightTree, NodeContents};
use crate::material::{Bsdf, Colors};
use crate::render::arrival::Arrivals;
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;

/// Which lights are kept apart.
pub(super) struct Apart<'a> {
    scene: &'a Scene,
    tree: &'a LightTree,
    /// Light by light; empty if none is.
    lights: Vec<bool>,
    /// Node by node of the tree: whether it holds one.
    nodes: Vec<bool>,
}

/// What some lights send to one pixel, each by its number, as often as it was added.
pub(super) type SentApart = Vec<(u32, Colors)>;

impl<'a> Apart<'a> {
    pub fn new(scene: &'a Scene, tree: &'a LightTree, buffers: &[Buffer]) -> Self {
        let mut apart = Apart { scene, tree, lights: Vec::new(), nodes: Vec::new() };
        for light in buffers.iter().flat_map(|buffer| scene.lights_of(*buffer)) {
            apart.lights.resize(scene.lights.len(), false);
            apart.lights[light as usize] = true;
        }
        if !apart.lights.is_empty() {
            apart.nodes.resize(tree.nodes.len(), false);
            tree.roots.iter().for_each(|root| _ = apart.mark(*root));
        }
        apart
    }

    /// Whether a node holds one of them; it and its nodes are marked.
    fn mark(&mut self, node: u32) -> bool {
        let holds = match self.tree.nodes[node as usize].contents {
            NodeContents::Light(light) => self.lights[light as usize],
            NodeContents::Children(children) => children.map(|node| self.mark(node)).contains(&true),
        };
        self.nodes[node as usize] = holds;
        holds
    }

    /// Adds to `to` what those of an entry of a list of nodes send to a place, so many times.
    pub fn add(&self, to: &mut SentApart, entry: u32, si: &SurfaceInteraction, bsdf: &Bsdf, times: f32) {
        let (node, one) = (entry & !BY_REPRESENTATIVE, entry & BY_REPRESENTATIVE);
        if !self.nodes.get(node as usize).is_some_and(|holds| *holds) {
            return;
        }
        match self.tree.nodes[node as usize].contents {
            NodeContents::Light(light) => {
                to.push((light, bsdf.colors * sent(self.scene, self.tree, entry, si, &bsdf.lobe) * times));
            }
            NodeContents::Children(children) => {
                children.into_iter().for_each(|node| self.add(to, node | one, si, bsdf, times))
            }
        }
    }

    /// What each of them sends, added up, with its scale, in scene order.
    pub fn finish(sent: &mut SentApart, arrivals: &Arrivals, scaled: &mut Vec<ScaledTerm>) {
        sent.sort_by_key(|(light, _)| *light);
        scaled.clear();
        for same in sent.chunk_by(|a, b| a.0 == b.0) {
            let scale = arrivals.scale(same[0].0 as usize);
            let of = |sent: f32, scale: f32| if scale > 0.0 { sent / scale } else { 0.0 };
            let unscaled = |sent: Rgb| Rgb::new(of(sent.r, scale.r), of(sent.g, scale.g), of(sent.b, scale.b));
            let term = same.iter().fold(Colors::BLACK, |sum, (_, sent)| sum + *sent).map(unscaled);
            scaled.push(ScaledTerm { light: Some(same[0].0), scale, term });
        }
    }
}

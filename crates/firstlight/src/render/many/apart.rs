//! Contributions of single lights within the nodes of a cut, for lights that have buffers of their own.

use super::BY_REPRESENTATIVE;
use super::block::sent;
use crate::color::Rgb;
use crate::film::resolve::ScaledTerm;
use crate::image::Buffer;
use crate::light::{LightTree, NodeContents};
use crate::material::{Colors, ShadingPoint};
use crate::render::direct::DirectLighting;
use crate::scene::Scene;

/// The lights that have buffers of their own.
pub(super) struct Apart<'a> {
    scene: &'a Scene,
    tree: &'a LightTree,
    /// For each light of the scene whether it is one; empty if there is none.
    lights: Vec<bool>,
    /// For each node of the tree whether it holds one.
    nodes: Vec<bool>,
}

/// Contributions to one pixel, each with the index of its light; a light may occur several times.
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

    /// Sets `nodes` for a node and those below it. Returns whether it holds one of the lights.
    fn mark(&mut self, node: u32) -> bool {
        let holds = match self.tree.nodes[node as usize].contents {
            NodeContents::Light(light) => self.lights[light as usize],
            NodeContents::Children(children) => children.map(|node| self.mark(node)).contains(&true),
        };
        self.nodes[node as usize] = holds;
        holds
    }

    /// Adds to `to` the contributions of the lights within the node of an entry, with the factor `times`.
    pub fn add(&self, to: &mut SentApart, entry: u32, point: &ShadingPoint, times: f32) {
        let (node, one) = (entry & !BY_REPRESENTATIVE, entry & BY_REPRESENTATIVE);
        if !self.nodes.get(node as usize).is_some_and(|holds| *holds) {
            return;
        }
        match self.tree.nodes[node as usize].contents {
            NodeContents::Light(light) => {
                to.push((light, point.bsdf.colors * sent(self.scene, self.tree, entry, point) * times));
            }
            NodeContents::Children(children) => {
                children.into_iter().for_each(|node| self.add(to, node | one, point, times))
            }
        }
    }

    /// Sums the contributions of each light, divided by its scale, in scene order.
    pub fn finish(sent: &mut SentApart, lights: &DirectLighting, scaled: &mut Vec<ScaledTerm>) {
        sent.sort_by_key(|(light, _)| *light);
        scaled.clear();
        for same in sent.chunk_by(|a, b| a.0 == b.0) {
            let scale = lights.scale(same[0].0 as usize);
            let of = |sent: f32, scale: f32| if scale > 0.0 { sent / scale } else { 0.0 };
            let unscaled = |sent: Rgb| Rgb::new(of(sent.r, scale.r), of(sent.g, scale.g), of(sent.b, scale.b));
            let sum = same.iter().fold(Colors::BLACK, |sum, (_, sent)| sum + *sent).map(unscaled);
            scaled.push(ScaledTerm { light: Some(same[0].0), scale, term: sum.term() });
        }
    }
}

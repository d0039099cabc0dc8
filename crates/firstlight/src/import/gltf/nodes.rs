//! The tree of nodes, and where each of them stands at a moment.
//!
//! Source: "glTF 2.0 specification", section 3.5.

use super::animation::AnimatedNode;
use super::json::JsonPlace;
use super::{Gltf, GltfFault};
use crate::math::{DAffine3, DMat3, DMat4, DQuat, DVec3};

/// A moment of an animation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// Its number in the file.
    pub animation: usize,
    /// In seconds.
    pub time: f64,
}

/// A node as it stands.
#[derive(Clone, Debug)]
pub(crate) struct GltfNode {
    /// Its number in the file.
    pub index: usize,
    /// From its own space to that of the scene.
    pub world: DAffine3,
    /// The weights of the morph targets of its mesh, where the node or an animation says them.
    pub weights: Option<Vec<f32>>,
}

/// Most nodes of a file.
const MAX_NODES: usize = 1 << 20;

impl Gltf {
    /// All nodes at a moment, by their numbers; without a pose as they stand at rest.
    pub(crate) fn nodes(&self, pose: Option<&Pose>) -> Result<Vec<GltfNode>, GltfFault> {
        let list = self.root().list("nodes")?;
        if list.len() > MAX_NODES {
            return Err(self.root().fault(format!("{} nodes, the limit is {MAX_NODES}", list.len())));
        }
        let mut animated: Vec<AnimatedNode> = vec![AnimatedNode::default(); list.len()];
        if let Some(pose) = pose {
            self.animate(pose, &mut animated)?;
        }
        // Who is below whom: nobody twice
        let mut children: Vec<Vec<usize>> = Vec::with_capacity(list.len());
        let mut has_parent = vec![false; list.len()];
        for node in &list {
            let mut below = Vec::new();
            for child in node.list("children")? {
                let index = child.index()?;
                match has_parent.get_mut(index) {
                    None => return Err(child.fault(format!("there is no node {index}; there are {}", list.len()))),
                    Some(taken) if *taken => {
                        return Err(child.fault(format!("node {index} is below two nodes")));
                    }
                    Some(taken) => *taken = true,
                }
                below.push(index);
            }
            children.push(below);
        }
        // From the roots downwards, without recursion; what is not met is in a circle
        let mut nodes: Vec<Option<GltfNode>> = vec![None; list.len()];
        let mut open: Vec<(usize, DAffine3)> =
            (0..list.len()).filter(|i| !has_parent[*i]).map(|root| (root, DAffine3::IDENTITY)).collect();
        while let Some((index, above)) = open.pop() {
            let (at, animated) = (&list[index], &animated[index]);
            let world = above * local(at, animated)?;
            let said = at.get("weights").map(|weights| weights.items()?.map(|w| Ok(w.number()? as f32)).collect());
            let weights = animated.weights.clone().map(Ok).or(said).transpose()?;
            nodes[index] = Some(GltfNode { index, world, weights });
            open.extend(children[index].iter().map(|child| (*child, world)));
        }
        let met: Option<Vec<GltfNode>> = nodes.iter().cloned().collect();
        met.ok_or_else(|| {
            let index = nodes.iter().position(Option::is_none).unwrap_or(0);
            list[index].fault("the node is below itself")
        })
    }

    /// The numbers of the nodes of a scene, each before those below it; those of the scene that the file shows, unless
    /// another one is asked for.
    pub(crate) fn scene_nodes(&self, scene: Option<usize>) -> Result<Vec<usize>, GltfFault> {
        let root = self.root();
        let list = root.list("nodes")?;
        let (shown, count) = (scene.map_or_else(|| root.index_or("scene", 0), Ok)?, root.count("scenes"));
        if let Some(wanted) = scene.filter(|wanted| *wanted >= count.max(1)) {
            let hint = format!("the file has {count}, counted from 0");
            return Err(GltfFault { hint, ..root.fault(format!("there is no scene {wanted}")) });
        }
        let mut open: Vec<usize> = match count {
            // Without any scene all nodes are shown
            0 => {
                let mut has_parent = vec![false; list.len()];
                for child in list.iter().map(|node| node.list("children")).collect::<Result<Vec<_>, _>>()?.concat() {
                    if let Some(has) = has_parent.get_mut(child.index()?) {
                        *has = true;
                    }
                }
                (0..list.len()).filter(|i| !has_parent[*i]).collect()
            }
            _ => {
                let roots = root.nth("scenes", shown)?.list("nodes")?;
                roots.iter().map(|node| root.of_index("nodes", node).and(node.index())).collect::<Result<_, _>>()?
            }
        };
        open.reverse();
        let (mut order, mut met) = (Vec::new(), vec![false; list.len()]);
        while let Some(index) = open.pop() {
            if std::mem::replace(&mut met[index], true) {
                continue;
            }
            order.push(index);
            let below = list[index].list("children")?;
            for child in below.iter().rev() {
                open.push(root.of_index("nodes", child).and(child.index())?);
            }
        }
        Ok(order)
    }
}

impl Gltf {
    /// Where the instances of a node stand in its space; `at` is what EXT_mesh_gpu_instancing says.
    pub(crate) fn instances(&self, at: &JsonPlace<'_>) -> Result<Vec<DAffine3>, GltfFault> {
        let attributes = at.need("attributes")?;
        let of = |key: &str| attributes.get(key);
        let translations = of("TRANSLATION").map(|at| self.vectors::<3>(&at)).transpose()?;
        let rotations = of("ROTATION").map(|at| self.vectors::<4>(&at)).transpose()?;
        let scales = of("SCALE").map(|at| self.vectors::<3>(&at)).transpose()?;
        let lengths =
            [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
        let count = lengths.into_iter().flatten().min().unwrap_or(0);
        let vector = |of: &Option<Vec<[f32; 3]>>, i: usize, or: DVec3| {
            of.as_ref().map_or(or, |list| DVec3::from(list[i].map(f64::from)))
        };
        let instance = |i: usize| {
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |list| DQuat::from_array(list[i].map(f64::from)));
            let (translation, scale) = (vector(&translations, i, DVec3::ZERO), vector(&scales, i, DVec3::ONE));
            DAffine3::from_scale_rotation_translation(scale, unit(rotation), translation)
        };
        Ok((0..count).map(instance).collect())
    }
}

/// Of length 1; one of no length turns nothing.
fn unit(rotation: DQuat) -> DQuat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() { rotation / length } else { DQuat::IDENTITY }
}

/// What a node does to those below it.
fn local(node: &JsonPlace<'_>, animated: &AnimatedNode) -> Result<DAffine3, GltfFault> {
    if let (Some(matrix), false) = (node.get("matrix"), animated.moves()) {
        let matrix = DMat4::from_cols_array(&matrix.numbers()?);
        let axes = DMat3::from_mat4(matrix);
        return Ok(DAffine3 { matrix3: axes, translation: matrix.w_axis.truncate() });
    }
    let translation = match animated.translation {
        Some(moved) => moved,
        None => DVec3::from(node.numbers_or("translation", [0.0; 3])?),
    };
    let rotation = match animated.rotation {
        Some(turned) => turned,
        None => DQuat::from_array(node.numbers_or("rotation", [0.0, 0.0, 0.0, 1.0])?),
    };
    let scale = match animated.scale {
        Some(scaled) => scaled,
        None => DVec3::from(node.numbers_or("scale", [1.0; 3])?),
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, unit(rotation), translation))
}

//! The primitives of a mesh, as one [`MeshData`].
//!
//! Entry i of [`MeshData::materials`] is the material name of primitive i, so a name may occur several times.
//! Primitives share no entry, because a variant may give each another material.
//!
//! Source: "glTF 2.0 specification", section 3.7.

use super::json::JsonPlace;
use super::nodes::{GltfNode, Pose};
use super::{Gltf, GltfFault};
use crate::import::{MAX_COUNT, MeshData};
use crate::math::{DAffine3, DMat3, DMat4, DVec3};

/// Bytes that a primitive counts for, whatever it holds: its material, a note about it.
const PRIMITIVE_BYTES: u64 = 256;
/// Bytes of a triangle, with its material.
const TRIANGLE_BYTES: u64 = 16;
/// Bytes of a vertex that is made of another one.
const VERTEX_BYTES: u64 = 96;
/// Texture coordinates of vertices without: 0, 0 in glTF, v turned.
const NO_UV: [f32; 2] = [0.0, 1.0];
/// Sets of texture coordinates that are read; textures can name no more.
const UV_SETS: usize = 4;

/// Which mesh to read, and in which pose.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum MeshAddress {
    /// The mesh with this index, with its default morph weights.
    Mesh(usize),
    /// The mesh of the node with this index, as it is posed at rest or at a moment: by the weights of the node and,
    /// where it has a skin, by its bones, which give it its place in the scene of the file.
    Node(usize, Option<Pose>),
}

impl MeshAddress {
    /// What stands behind `#` in the name of a file: `mesh/0`, `node/4`, `node/4/animation/0/time/1.5`.
    pub fn parse(text: &str) -> Option<MeshAddress> {
        let number = |text: &str| text.parse::<usize>().ok();
        let parts: Vec<&str> = text.split('/').collect();
        match parts[..] {
            ["mesh", mesh] => Some(MeshAddress::Mesh(number(mesh)?)),
            ["node", node] => Some(MeshAddress::Node(number(node)?, None)),
            ["node", node, "animation", animation, "time", time] => {
                let time = time.parse::<f64>().ok().filter(|time| time.is_finite())?;
                Some(MeshAddress::Node(number(node)?, Some(Pose { animation: number(animation)?, time })))
            }
            _ => None,
        }
    }
}

impl std::fmt::Display for MeshAddress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            MeshAddress::Mesh(mesh) => write!(f, "mesh/{mesh}"),
            MeshAddress::Node(node, None) => write!(f, "node/{node}"),
            MeshAddress::Node(node, Some(pose)) => {
                write!(f, "node/{node}/animation/{}/time/{}", pose.animation, pose.time)
            }
        }
    }
}

/// What moves the vertices of a primitive.
struct Posing<'a> {
    weights: &'a [f32],
    /// What the bones of its skin do to the vertices: from the mesh to the scene.
    bones: Option<&'a [DAffine3]>,
}

/// The shape of what an index list says.
#[derive(Clone, Copy)]
enum Topology {
    Triangles,
    Strip,
    Fan,
}

impl Gltf {
    /// The mesh at an address.
    pub(crate) fn mesh(&self, address: &MeshAddress) -> Result<MeshData, GltfFault> {
        let root = self.root();
        let (index, weights, bones) = match address {
            MeshAddress::Mesh(mesh) => (*mesh, None, None),
            MeshAddress::Node(node, pose) => {
                let at = root.nth("nodes", *node)?;
                let nodes = self.posed_nodes(pose.as_ref())?;
                let bones = at.get("skin").map(|skin| self.bones(&skin, &nodes)).transpose()?;
                (at.need("mesh")?.index()?, nodes[*node].weights.clone(), bones)
            }
        };
        let mesh = root.nth("meshes", index)?;
        let weights = match weights {
            Some(weights) => weights,
            None => mesh.list("weights")?.iter().map(|weight| Ok(weight.number()? as f32)).collect::<Result<_, _>>()?,
        };
        let posing = Posing { weights: &weights, bones: bones.as_deref() };
        // Each node with a pose of its own reads them again, also those that hold nothing
        self.take(&mesh, (mesh.count("primitives") as u64).saturating_mul(PRIMITIVE_BYTES))?;
        let mut data = MeshData::default();
        for (i, primitive) in mesh.list("primitives")?.iter().enumerate() {
            let name = match primitive.get("material") {
                Some(material) => {
                    let material = root.of_index("materials", &material)?;
                    material.text_of("name").unwrap_or_default().to_owned()
                }
                None => String::new(),
            };
            data.materials.push(name);
            self.add_primitive(&mut data, primitive, i as u32, &posing)?;
        }
        let vertices = data.positions.len();
        // No primitive has normals
        if data.normals.iter().all(|normal| *normal == [0.0; 3]) {
            data.normals.clear();
        }
        // Each list is as long as there are vertices
        debug_assert!(data.uvs.iter().all(|set| set.len() == vertices));
        if vertices as u64 > MAX_COUNT {
            return Err(mesh.fault(format!("has {vertices} vertices, the limit is {MAX_COUNT}")));
        }
        Ok(data)
    }

    /// What the bones of a skin do to vertices, as the nodes stand.
    fn bones(&self, skin: &JsonPlace<'_>, nodes: &[GltfNode]) -> Result<Vec<DAffine3>, GltfFault> {
        let skin = self.root().of_index("skins", skin)?;
        // Each node with this skin has its own
        self.take(&skin, (skin.count("joints") as u64).saturating_mul(size_of::<DAffine3>() as u64))?;
        let inverse = skin.get("inverseBindMatrices").map(|at| self.vectors::<16>(&at)).transpose()?;
        let mut bones = Vec::new();
        for (i, joint) in skin.list("joints")?.iter().enumerate() {
            let Some(node) = nodes.get(joint.index()?) else {
                return Err(joint.fault(format!("there is no such node; there are {}", nodes.len())));
            };
            let bind = match &inverse {
                None => DAffine3::IDENTITY,
                Some(matrices) => match matrices.get(i) {
                    Some(matrix) => {
                        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
                        DAffine3 { matrix3: DMat3::from_mat4(matrix), translation: matrix.w_axis.truncate() }
                    }
                    None => {
                        return Err(joint.fault(format!("has no inverse bind matrix; there are {}", matrices.len())));
                    }
                },
            };
            bones.push(node.world * bind);
        }
        Ok(bones)
    }

    fn add_primitive(
        &self,
        data: &mut MeshData,
        primitive: &JsonPlace<'_>,
        number: u32,
        posing: &Posing<'_>,
    ) -> Result<(), GltfFault> {
        let attributes = primitive.need("attributes")?;
        let topology = match primitive.index_or("mode", 4)? {
            4 => Topology::Triangles,
            5 => Topology::Strip,
            6 => Topology::Fan,
            mode @ 0..=3 => {
                let kind = if mode == 0 { "points" } else { "lines" };
                data.notes.push(format!("{}: {kind} are left out; triangles are read", primitive.pointer()));
                return Ok(());
            }
            other => return Err(primitive.fault(format!("{other} is no mode; they are 0 to 6"))),
        };
        let Some(position) = attributes.get("POSITION") else {
            data.notes.push(format!("{}: has no POSITION and is left out", primitive.pointer()));
            return Ok(());
        };
        let (mut positions, count) = (self.vectors::<3>(&position)?, self.count(&position)?);
        let as_many = |at: &JsonPlace<'_>| match self.count(at)? {
            n if n == count => Ok(()),
            n => Err(at.fault(format!("has {n} elements for {count} positions"))),
        };
        let mut normals = match attributes.get("NORMAL") {
            Some(normal) => as_many(&normal).and_then(|()| self.vectors::<3>(&normal))?,
            None => Vec::new(),
        };
        // Without normals they say nothing
        let mut tangents = match attributes.get("TANGENT").filter(|_| !normals.is_empty()) {
            Some(tangent) => as_many(&tangent).and_then(|()| self.vectors::<4>(&tangent))?,
            None => Vec::new(),
        };
        // Morph targets
        for (target, weight) in primitive.list("targets")?.iter().zip(posing.weights) {
            if *weight == 0.0 {
                continue;
            }
            let positions = positions.iter_mut().map(|vector| &mut vector[..]).collect();
            let normals = normals.iter_mut().map(|vector| &mut vector[..]).collect();
            let tangents = tangents.iter_mut().map(|vector| &mut vector[..3]).collect();
            let lists: [(_, Vec<&mut [f32]>); 3] =
                [("POSITION", positions), ("NORMAL", normals), ("TANGENT", tangents)];
            for (key, vectors) in lists {
                let Some(at) = target.get(key).filter(|_| !vectors.is_empty()) else { continue };
                as_many(&at)?;
                for (vector, moved) in vectors.into_iter().zip(self.vectors::<3>(&at)?) {
                    vector.iter_mut().zip(moved).for_each(|(number, moved)| *number += weight * moved);
                }
            }
        }
        let mirrored = match posing.bones {
            Some(bones) => self.pose(&attributes, bones, &mut positions, &mut normals, &mut tangents)?,
            None => Vec::new(),
        };
        // Triangles, except those with an index out of range
        let (first, first_triangle) = (data.positions.len() as u32, data.triangles.len());
        let indices = match primitive.get("indices") {
            Some(at) => self.wholes::<1>(&at)?.into_flattened(),
            None => {
                self.take(&position, 4 * count as u64)?;
                (0..count as u32).collect()
            }
        };
        let triangles = if let Topology::Triangles = topology { indices.len() / 3 } else { indices.len() } as u64;
        self.take(primitive, TRIANGLE_BYTES * triangles)?;
        let mut left_out = 0;
        let mut add = |corners: [u32; 3]| match corners.iter().all(|corner| (*corner as usize) < count) {
            true => {
                let [a, b, c] = corners.map(|corner| first + corner);
                let is_mirrored = mirrored.get(corners[0] as usize).is_some_and(|is| *is);
                data.triangles.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
            }
            false => left_out += 1,
        };
        match topology {
            Topology::Triangles => indices.as_chunks::<3>().0.iter().for_each(|corners| add(*corners)),
            Topology::Strip => indices.windows(3).enumerate().for_each(|(i, w)| {
                add(if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] });
            }),
            Topology::Fan => {
                indices.iter().skip(1).zip(indices.iter().skip(2)).for_each(|(b, c)| add([*b, *c, indices[0]]));
            }
        }
        if left_out > 0 {
            let at = primitive.pointer();
            data.notes.push(format!("{at}: {left_out} triangles of vertices that are not there are left out"));
        }
        data.face_materials.resize(data.triangles.len(), number);
        // What only some primitives have is made up for the others
        let colors = match attributes.get("COLOR_0") {
            Some(color) => as_many(&color).and_then(|()| self.vectors::<4>(&color))?,
            None => Vec::new(),
        };
        let named = self.named_uv_sets(primitive)?;
        for set in 0..UV_SETS {
            let Some(at) = attributes.get(&format!("TEXCOORD_{set}")) else {
                if set < named {
                    let at = primitive.pointer();
                    data.notes
                        .push(format!("{at}: has no TEXCOORD_{set}, which its material names: all vertices get 0, 0"));
                }
                continue;
            };
            as_many(&at)?;
            while data.uvs.len() <= set {
                data.uvs.push(vec![NO_UV; first as usize]);
            }
            // Row 0 of a picture is v = 0 in glTF, and v = 1 here
            data.uvs[set].extend(self.vectors::<2>(&at)?.iter().map(|[u, v]| [*u, 1.0 - v]));
        }
        while data.uvs.len() < named {
            data.uvs.push(vec![NO_UV; first as usize]);
        }
        data.positions.extend(positions);
        let vertices = data.positions.len();
        data.normals.extend(normals);
        data.normals.resize(vertices, [0.0; 3]);
        if !tangents.is_empty() || !data.tangents.is_empty() {
            data.tangents.resize(first as usize, [0.0; 4]);
            data.tangents.extend(tangents);
            data.tangents.resize(vertices, [0.0; 4]);
        }
        data.uvs.iter_mut().for_each(|set| set.resize(vertices, NO_UV));
        if !colors.is_empty() || !data.colors.is_empty() {
            data.colors.resize(first as usize, [1.0; 4]);
            data.colors.extend(colors);
            data.colors.resize(vertices, [1.0; 4]);
        }
        let behind = face_normals_to_front(data, first_triangle);
        if behind > 0 {
            self.take(primitive, VERTEX_BYTES * 3 * behind)?;
            let at = primitive.pointer();
            data.notes.push(format!("{at}: in {behind} triangles, normals that point behind the triangle are turned"));
        }
        Ok(())
    }

    /// How many sets of texture coordinates the textures of a primitive's materials name.
    fn named_uv_sets(&self, primitive: &JsonPlace<'_>) -> Result<usize, GltfFault> {
        let mut materials: Vec<JsonPlace<'_>> = primitive.get("material").into_iter().collect();
        if let Some(variants) = primitive.extension("KHR_materials_variants") {
            for mapping in variants.list("mappings")? {
                materials.extend(mapping.get("material"));
            }
        }
        let mut named = 0;
        for material in materials {
            let sets = self.root().of_index("materials", &material)?.uv_sets();
            named = sets.into_iter().filter(|set| *set < UV_SETS).map(|set| set + 1).fold(named, usize::max);
        }
        Ok(named)
    }

    /// Moves vertices by the bones, each by as much as its weight. Returns which vertices that mirrors.
    fn pose(
        &self,
        attributes: &JsonPlace<'_>,
        bones: &[DAffine3],
        positions: &mut [[f32; 3]],
        normals: &mut [[f32; 3]],
        tangents: &mut [[f32; 4]],
    ) -> Result<Vec<bool>, GltfFault> {
        let mut sums = vec![(DAffine3::ZERO, 0.0f64); positions.len()];
        for set in 0.. {
            let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
            let [Some(joints), Some(weights)] = names.each_ref().map(|name| attributes.get(name)) else { break };
            let (joints, weights_of) = (self.wholes::<4>(&joints)?, self.vectors::<4>(&weights)?);
            if joints.len() != positions.len() || weights_of.len() != positions.len() {
                return Err(weights.fault(format!("joints and weights are not those of {} positions", positions.len())));
            }
            for (sum, (joints, weights_of)) in sums.iter_mut().zip(joints.iter().zip(&weights_of)) {
                for (joint, weight) in joints.iter().zip(weights_of).filter(|(_, weight)| **weight != 0.0) {
                    let Some(bone) = bones.get(*joint as usize) else {
                        return Err(weights.fault(format!("there is no joint {joint}; the skin has {}", bones.len())));
                    };
                    let weight = f64::from(*weight);
                    sum.0.matrix3 += bone.matrix3 * weight;
                    sum.0.translation += bone.translation * weight;
                    sum.1 += weight;
                }
            }
        }
        for (i, (moved, weight)) in sums.iter().enumerate() {
            // Vertices without weights stay
            if !(*weight > 0.0) {
                continue;
            }
            // Weights need not make 1: those in bytes are rounded
            let position = moved.transform_point3(DVec3::from(positions[i].map(f64::from))) / *weight;
            positions[i] = position.as_vec3().to_array();
            if let Some(normal) = normals.get_mut(i) {
                let n = DVec3::from(normal.map(f64::from));
                // The matrix of the cofactors is the inverse transpose times the determinant, of which the sign counts
                let [x, y, z] = [moved.matrix3.x_axis, moved.matrix3.y_axis, moved.matrix3.z_axis];
                let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
                let side = if moved.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
                *normal = (cofactors * n * side).normalize_or_zero().as_vec3().to_array();
                if let Some([x, y, z, sign]) = tangents.get_mut(i) {
                    let t = moved.transform_vector3(DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z)));
                    [*x, *y, *z] = t.normalize_or_zero().as_vec3().to_array();
                    *sign *= side as f32;
                }
            }
        }
        Ok(sums.iter().map(|(moved, weight)| *weight > 0.0 && moved.matrix3.determinant() < 0.0).collect())
    }
}

/// Turns normals that point behind their triangle. The front of a triangle is the side from which its corners run
/// counter-clockwise. For each triangle from `first` on: if the sum of its normals points behind it, each corner whose
/// normal points behind it gets a vertex of its own with the normal turned to the front. Returns the number of such
/// triangles.
///
/// Source: "glTF 2.0 specification", section 3.7.2.1, "Meshes".
fn face_normals_to_front(data: &mut MeshData, first: usize) -> u64 {
    let mut count = 0;
    for triangle in first..data.triangles.len() {
        let corners = data.triangles[triangle].map(|corner| corner as usize);
        let [a, b, c] = corners.map(|corner| DVec3::from(data.positions[corner].map(f64::from)));
        let front = (b - a).cross(c - a).normalize_or_zero();
        let normals = corners.map(|corner| DVec3::from(data.normals[corner].map(f64::from)));
        if !(normals.iter().sum::<DVec3>().dot(front) < 0.0) {
            continue;
        }
        count += 1;
        for (k, normal) in normals.into_iter().enumerate() {
            let height = normal.dot(front);
            if !(height < 0.0) {
                continue;
            }
            // A normal at most 30 degrees behind the plane of the triangle is reflected in it, which keeps the normals
            // of leaves that are those of the tree's crown. One further behind is that of a surface inside out
            let turned = if height < -0.5 * normal.length() { -normal } else { normal - 2.0 * height * front };
            let (from, vertex) = (corners[k], data.positions.len());
            data.positions.push(data.positions[from]);
            data.normals.push(turned.as_vec3().to_array());
            data.uvs.iter_mut().for_each(|set| set.push(set[from]));
            if let Some([x, y, z, sign]) = data.tangents.get(from).copied() {
                data.tangents.push([x, y, z, -sign]);
            }
            if let Some(color) = data.colors.get(from).copied() {
                data.colors.push(color);
            }
            data.triangles[triangle][k] = vertex as u32;
        }
    }
    count
}

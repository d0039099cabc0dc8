//! The sets of texture coordinates that textures name, and those that shapes have.

use std::collections::HashSet;

use super::{Compiler, Form, GroupSpace, PlacedShape};
use crate::context::CompileContext;
use crate::describe::Family;
use crate::ids::MaterialId;
use crate::material::UvSetUse;
use crate::shape::{MeshDesc, MeshSource, NamedSets, ShapeDesc};

/// The shape of a group that has the fewest sets of texture coordinates.
#[derive(Clone, Copy)]
struct FewestUvSets {
    sets: usize,
    /// The group, and the number of the shape in it.
    group: usize,
    leaf: usize,
}

/// How many sets a shape has, in words.
fn in_words(is_mesh: bool, sets: usize) -> String {
    match sets {
        _ if !is_mesh => "has set 0 alone".to_owned(),
        0 => "has no texture coordinates".to_owned(),
        1 => "has one set of texture coordinates".to_owned(),
        sets => format!("has {sets} sets of texture coordinates"),
    }
}

impl Compiler<'_, '_> {
    /// Reports the first texture of a material that names a set which a shape lacks; `what` says of the shape how many
    /// it has.
    fn check_uv_sets(
        &self,
        cx: &mut CompileContext,
        field: &str,
        material: MaterialId,
        sets: usize,
        what: &str,
        hint: &str,
    ) {
        // A mesh without texture coordinates has (0, 0), (1, 0), (0, 1) at the corners of each triangle as set 0
        let Some((set, texture)) = self.rules.uv_sets(material).beyond(sets.max(1)) else { return };
        let (material, texture) = (self.materials.name(material), &self.desc.textures[texture as usize].0);
        let message = format!("the texture {texture:?} of the material {material:?} has uv_set {set}: {what}");
        cx.error(field, message, Some(hint));
    }

    /// The same of a shape that is no mesh.
    pub(super) fn check_uv_sets_of_shape(&self, cx: &mut CompileContext, shape: &ShapeDesc, material: MaterialId) {
        let what = format!("a {} {}", shape.kind().replace('_', " "), in_words(false, 1));
        let hint = "only meshes have more: leave uv_set out of the texture, or give the shape another material";
        self.check_uv_sets(cx, "material", material, 1, &what, hint);
    }

    /// The same of the materials that the faces of a mesh choose from.
    pub(super) fn check_uv_sets_of_mesh(
        &self,
        cx: &mut CompileContext,
        desc: &MeshDesc,
        source: &MeshSource,
        faces: &[MaterialId],
    ) {
        let sets = source.data.uvs.len();
        let named = desc.material.as_ref().and_then(|name| self.materials.find(name));
        let mut known = HashSet::new();
        let lacks = |material: MaterialId| self.rules.uv_sets(material).beyond(sets.max(1)).is_some();
        for (i, material) in faces.iter().enumerate().filter(|(_, material)| lacks(**material)) {
            if !known.insert(material) {
                continue;
            }
            let (field, hint) = match &desc.file {
                Some(_) => ("file".to_owned(), "sets are counted from 0: name one that the file has"),
                None => (
                    format!("materials[{i}]"),
                    "`uvs` is set 0, `more_uvs` holds the further ones: add it, or name another",
                ),
            };
            let field = if named == Some(*material) { "material" } else { &field };
            self.check_uv_sets(cx, field, *material, sets, &format!("the mesh {}", in_words(true, sets)), hint);
        }
    }

    /// The same of the materials that instances put on all that is in a group. Groups are without circles and not deep.
    pub(super) fn check_uv_sets_of_instances(&self, cx: &mut CompileContext, root: &GroupSpace, groups: &[GroupSpace]) {
        let mut known = vec![None; groups.len()];
        let of_groups = groups.iter().zip(&self.desc.groups);
        let of_groups = of_groups.map(|(group, (name, _))| (group, format!("group.{name}.")));
        for (group, prefix) in [(root, String::new())].into_iter().chain(of_groups) {
            let instances = group.leaves.iter().filter(|leaf| matches!(leaf.form, Form::Instance(_)));
            for (i, leaf) in instances.enumerate().filter(|(_, leaf)| leaf.has_material) {
                let &PlacedShape { form: Form::Instance(of), ref surface, .. } = leaf else { continue };
                let Some(material) = surface.material.filter(|one| self.rules.uv_sets(*one).beyond(1).is_some()) else {
                    continue;
                };
                let Some(fewest) = fewest_uv_sets(groups, of, &mut known) else { continue };
                let (what, hint) = (
                    self.describe_fewest(fewest),
                    "an instance puts its material on all of its group: name it at shapes that have the set",
                );
                self.check_uv_sets(cx, &format!("{prefix}instance[{i}].material"), material, fewest.sets, &what, hint);
            }
        }
    }

    /// Where a shape of a group is described, and how many sets it has.
    fn describe_fewest(&self, fewest: FewestUvSets) -> String {
        let (name, group) = &self.desc.groups[fewest.group];
        let mut in_order = ShapeDesc::KINDS.iter().enumerate().flat_map(|(kind, word)| {
            let of_kind = group.shapes.iter().filter(move |shape| shape.kind_index() == kind);
            of_kind.enumerate().map(move |(i, shape)| (format!("{word}[{i}]"), matches!(shape, ShapeDesc::Mesh(_))))
        });
        let (place, is_mesh) = in_order.nth(fewest.leaf).unwrap_or_default();
        format!("group.{name}.{place} {}", in_words(is_mesh, fewest.sets))
    }

    /// The sets of a mesh that textures on it name; in a group also those of the materials of all instances of the
    /// scene.
    pub(super) fn named_uv_sets(&self, source: &MeshSource, faces: &[MaterialId], is_in_group: bool) -> NamedSets {
        let of_instances = is_in_group.then_some(self.uv_sets_of_instances);
        let named = faces.iter().map(|material| self.rules.uv_sets(*material)).chain(of_instances);
        let UvSetUse { all, maps, .. } = named.fold(UvSetUse::default(), |all, one| all.joined(&one));
        let bits = |is: &dyn Fn(usize) -> bool| (0..8).filter(|set| is(*set)).fold(0u8, |bits, set| bits | 1 << set);
        let own = bits(&|set| set == source.uv_set);
        let others = bits(&|set| set < source.data.uvs.len()) & !own;
        let own_maps = maps & own != 0 || faces.iter().any(|material| self.rules.has_own_map(*material));
        NamedSets { all: all & others, maps: maps & others, own_maps }
    }
}

/// The first shape of a group, and of the groups in it, that has the fewest sets; `None` without shapes. `known`
/// caches the result of each group.
fn fewest_uv_sets(
    groups: &[GroupSpace],
    group: usize,
    known: &mut [Option<Option<FewestUvSets>>],
) -> Option<FewestUvSets> {
    if let Some(found) = known[group] {
        return found;
    }
    let mut fewest: Option<FewestUvSets> = None;
    for (leaf, shape) in groups[group].leaves.iter().enumerate() {
        let found = match shape.form {
            Form::Nothing => None,
            Form::Instance(of) => fewest_uv_sets(groups, of, known),
            _ => Some(FewestUvSets { sets: shape.uv_sets, group, leaf }),
        };
        fewest = match (fewest, found) {
            (Some(one), Some(other)) if one.sets <= other.sets => Some(one),
            (one, other) => other.or(one),
        };
    }
    known[group] = Some(fewest);
    fewest
}

#[cfg(test)]
mod tests {
    use crate::context::NoAssets;
    use crate::scene::{CompileOptions, SceneDesc};

    /// Of each part of each mesh: the number of each set that it has beside its own, and whether that and its own have
    /// tangents.
    fn kept(text: &str) -> Vec<(Vec<(u8, bool)>, bool)> {
        let head = "[camera]\nposition = [0, 0, 9]\n[texture.image.n0]\nfile = \"n.png\"\nuv_set = 0\n\
                    [texture.image.n1]\nfile = \"n.png\"\nuv_set = 1\n[texture.image.n2]\nfile = \"n.png\"\n\
                    uv_set = 2\n[texture.checkerboard.c2]\nuv_set = 2\n[texture.checkerboard.c]\n\
                    [material.phong.plain]\ndiffuse = { texture = \"c\" }\n\
                    [material.phong.second]\nspecular = { texture = \"c2\" }\n\
                    [material.phong.hidden]\nalpha = { texture = \"c2\" }\n\
                    [material.phong.thin]\nalpha = { texture = \"c2\" }\nalpha_mode = \"blend\"\n\
                    [material.phong.bumps0]\nnormal_map = \"n0\"\n[material.phong.bumps1]\nnormal_map = \"n1\"\n\
                    [material.metallic-roughness.coat]\nclearcoat = 1\nclearcoat_normal_map = \"n2\"\n";
        let parsed = SceneDesc::parse("s.toml", format!("{head}{text}").as_bytes(), &NoAssets);
        assert_eq!(parsed.faults(), []);
        let scene = parsed.compile(&NoAssets, &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
        let parts = scene.geometry.all_meshes().flat_map(|mesh| &mesh.parts);
        let of_part = |part: &crate::shape::JoinedPart| {
            let sets = part.uv_sets.iter().map(|set| {
                assert_eq!(set.uvs.len(), 3);
                (set.number, !set.tangents.is_empty())
            });
            (sets.collect(), !part.tangents.is_empty())
        };
        parts.map(of_part).collect()
    }

    const TRIANGLE: &str = "mesh]]\npositions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nuvs = [[0, 0], [1, 0], [0, 1]]\n\
                            more_uvs = [[[0, 0], [2, 0], [0, 2]], [[0, 0], [3, 0], [0, 3]]]\ntriangles = [[0, 1, 2]]\n";

    #[test]
    fn a_mesh_keeps_the_sets_that_its_textures_name() {
        let of = |more: &str| kept(&format!("[[{TRIANGLE}{more}"));
        assert_eq!(of(""), [(vec![], false)]);
        assert_eq!(of("material = \"plain\""), [(vec![], false)]);
        // Opaque: its alpha is not used
        assert_eq!(of("material = \"hidden\""), [(vec![], false)]);
        assert_eq!(of("material = \"second\""), [(vec![(2, false)], false)]);
        assert_eq!(of("material = \"thin\""), [(vec![(2, false)], false)]);
        // The mesh's own is there already
        assert_eq!(of("material = \"second\"\nuv_set = 2"), [(vec![], false)]);
        assert_eq!(of("material = \"bumps0\""), [(vec![], true)]);
        assert_eq!(of("material = \"bumps0\"\nuv_set = 1"), [(vec![(0, true)], false)]);
        assert_eq!(of("material = \"bumps1\""), [(vec![(1, true)], false)]);
        assert_eq!(of("material = \"coat\"\nuv_set = 2"), [(vec![], true)]);
        assert_eq!(
            of("materials = [\"coat\", \"bumps1\"]\nface_materials = [1]"),
            [(vec![(1, true), (2, true)], false)]
        );
        assert_eq!(of("materials = [\"coat\", \"thin\"]\nface_materials = [1]"), [(vec![(2, true)], false)]);
    }

    #[test]
    fn a_mesh_of_a_group_keeps_those_of_all_instances() {
        let of = |more: &str| kept(&format!("[[group.g.{TRIANGLE}{more}"));
        let plain = "[[instance]]\nof = \"g\"\n";
        assert_eq!(of(plain), [(vec![], false)]);
        assert_eq!(of(&format!("{plain}material = \"second\"\n{plain}")), [(vec![(2, false)], false)]);
        let both = format!("{plain}material = \"second\"\n{plain}material = \"bumps1\"\n");
        assert_eq!(of(&both), [(vec![(1, true), (2, false)], false)]);
        // Those that it has; the material is on another group
        let other = "[[group.h.mesh]]\npositions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nuvs = [[0, 0], [1, 0], [0, 1]]\n\
                     more_uvs = [[[0, 0], [2, 0], [0, 2]]]\ntriangles = [[0, 1, 2]]\n[[instance]]\nof = \"h\"\n\
                     material = \"bumps1\"\n";
        let expected = [(vec![(1, true), (2, false)], false), (vec![(1, true)], false)];
        assert_eq!(of(&format!("{plain}material = \"second\"\n{other}")), expected);
    }
}

//! From described shapes to placed ones: groups are flattened, transforms joined, surfaces numbered.
//!
//! Two steps. First every group, and the scene itself, is compiled once in its own space ([`GroupSpace`]): a list of
//! leaves in scene order, and one mesh joined from all its meshes. Then the scene is walked ([`SceneWalk`]), instances
//! with it, and every leaf that is come across is given a surface and a place in the world.

mod uv_sets;
mod walk;

use std::collections::HashMap;
use std::sync::Arc;

use glam::DAffine3;

use super::SceneDesc;
use super::geometry::{Geometry, Joined, MaterialRules, Parts, PlacedTarget, RayRules, Surface};
use super::links::Links;
use crate::context::{Assets, CompileContext};
use crate::describe::Family;
use crate::describe::node::quoted;
use crate::ids::{MaterialId, SurfaceId};
use crate::material::{Material, UvSetUse};
use crate::math::{DVec3, origin_for, origin_of_view};
use crate::shape::{
    Common, CompileCache, Mesh, MeshBuilder, MeshFiles, MeshSource, Parallelogram, Placement, PointSet, ShapeDesc,
    Solid, Sphere,
};
use crate::transform::TransformDesc;
use walk::{Over, SceneWalk, opacities};

/// The most things that are placed, instances of groups counted by what they hold.
const MAX_PLACED: u64 = 1 << 22;
/// Bytes of the names of all that instances place.
const MAX_NAMES: usize = 1 << 30;
/// The deepest groups within groups.
const MAX_DEPTH: usize = 32;

/// Materials by name.
pub(super) struct MaterialNames<'a> {
    names: Vec<&'a str>,
    ids: HashMap<&'a str, u32>,
}

impl<'a> MaterialNames<'a> {
    pub fn new(desc: &'a SceneDesc) -> Self {
        let names: Vec<&str> = desc.materials.iter().map(|(name, _)| name.as_str()).collect();
        let ids = names.iter().enumerate().rev().map(|(id, name)| (*name, id as u32)).collect();
        MaterialNames { names, ids }
    }

    /// The one of shapes that name none.
    pub fn default(&self) -> MaterialId {
        MaterialId(self.names.len() as u32)
    }

    /// What the scene calls one; the one of shapes that name none has no name.
    fn name(&self, material: MaterialId) -> &'a str {
        self.names.get(material.index()).copied().unwrap_or_default()
    }

    /// The one of that name, if there is one.
    pub fn find(&self, name: &str) -> Option<MaterialId> {
        self.ids.get(name).copied().map(MaterialId)
    }

    /// The one called `name`, or a fault at `field`.
    pub fn resolve(&self, cx: &mut CompileContext, field: &str, name: &str) -> MaterialId {
        self.find(name).unwrap_or_else(|| {
            cx.unknown(field, "material", name, &self.names);
            MaterialId(0)
        })
    }
}

/// The first of a list of names, in quotes, and how many more there are.
fn first_names(names: &[&str]) -> String {
    const SHOWN: usize = 6;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| quoted(name)).collect();
    let more = names.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    shown.join(", ") + &more
}

/// A shape in the space of its group.
struct PlacedShape {
    form: Form,
    transform: Option<DAffine3>,
    surface: Surface,
    /// Whether the material was named, and is not the default.
    has_material: bool,
    /// How many sets of texture coordinates it has; of a mesh without any 0.
    uv_sets: usize,
}

enum Form {
    Sphere(Sphere),
    Parallelogram(Parallelogram),
    Solid(u32),
    Points(u32),
    /// Part of the group's mesh.
    MeshPart,
    /// An instance of another group.
    Instance(usize),
    /// Something that was refused.
    Nothing,
}

/// A group, or the scene itself, in its own space.
struct GroupSpace {
    leaves: Vec<PlacedShape>,
    /// The meshes that are to be joined: first their opaque triangles, then the others.
    builders: [MeshBuilder; 2],
    /// All its meshes, joined, once it is known where they count from.
    meshes: [Option<Arc<Mesh>>; 2],
    /// Where `meshes` count from, in the space of the group.
    origin: DVec3,
}

impl GroupSpace {
    /// Joins the meshes; they count from `origin`.
    fn join(&mut self, cx: &CompileContext, cache: Option<&CompileCache>, origin: DVec3) {
        self.meshes = std::mem::take(&mut self.builders).map(|builder| builder.build(cx, cache, origin));
        self.origin = origin;
    }

    /// The box around all meshes.
    fn mesh_bounds(&self) -> Option<[DVec3; 2]> {
        let bounds = self.builders.iter().filter_map(MeshBuilder::bounds);
        bounds.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
    }
}

/// Finds the boxes around groups.
struct Extents<'a> {
    groups: &'a [GroupSpace],
    solids: &'a [Solid],
    point_sets: &'a [Arc<PointSet>],
    /// Those that are known.
    known: Vec<Option<Option<[DVec3; 2]>>>,
}

impl Extents<'_> {
    /// The box around all of a group that has an end, in its own space. Groups are without circles and not deep.
    fn of(&mut self, group: &GroupSpace) -> Option<[DVec3; 2]> {
        let mut all = group.mesh_bounds();
        for leaf in &group.leaves {
            let own = match &leaf.form {
                Form::Nothing | Form::MeshPart => None,
                Form::Sphere(sphere) => Some(sphere.bounds()),
                Form::Parallelogram(flat) => Some(flat.bounds()),
                Form::Solid(solid) => self.solids[*solid as usize].bounds(),
                Form::Points(points) => {
                    let points = &self.point_sets[*points as usize];
                    points.bounds().map(|bounds| bounds.map(|corner| corner + points.origin()))
                }
                Form::Instance(of) => {
                    if self.known[*of].is_none() {
                        let groups = self.groups;
                        self.known[*of] = Some(self.of(&groups[*of]));
                    }
                    self.known[*of].flatten()
                }
            };
            let own = own.map(|own| leaf.transform.map_or(own, |transform| Placement::new(transform).bounds(own)));
            all = match (all, own) {
                (Some([low, high]), Some([a, b])) => Some([low.min(a), high.max(b)]),
                (all, own) => all.or(own),
            };
        }
        all
    }
}

/// Compiles all shapes of a scene; camera rays end at shadow catchers if they are `caught`. `None` after an error.
pub(super) fn compile_shapes(
    desc: &SceneDesc,
    compiled: &[Material],
    caught: bool,
    cx: &mut CompileContext,
    assets: &dyn Assets,
    files: &mut MeshFiles<'_>,
) -> Option<Geometry> {
    let before = cx.error_count();
    let cache = files.cache;
    let materials = MaterialNames::new(desc);
    // The first of a name; a second one is a fault of the text
    let group_ids = desc.groups.iter().enumerate().rev().map(|(id, (name, _))| (name.as_str(), id)).collect();
    let rules = MaterialRules::new(compiled);
    let rules = if caught { rules.with_catchers() } else { rules };
    let shapes = desc.groups.iter().flat_map(|(_, group)| &group.shapes).chain(&desc.shapes);
    let may_matter = rules.has_maps() || rules.has_uv_sets();
    let instances = shapes.filter(|shape| may_matter && matches!(shape, ShapeDesc::Instance(_)));
    let of_instances = instances.filter_map(|instance| materials.find(instance.common().material?));
    let (mut maps_groups, mut uv_sets_of_instances) = (false, UvSetUse::default());
    for material in of_instances {
        maps_groups |= rules.has_own_map(material);
        uv_sets_of_instances = uv_sets_of_instances.joined(&rules.uv_sets(material));
    }
    let mut compiler = Compiler {
        maps_groups,
        uv_sets_of_instances,
        desc,
        rules: &rules,
        materials,
        group_ids,
        links: Links::new(&desc.lights),
        assets,
        files,
        solids: Vec::new(),
        point_sets: Vec::new(),
        classes: HashMap::new(),
    };
    let mut root = compiler.group(cx, "", &desc.shapes);
    let mut groups = Vec::with_capacity(desc.groups.len());
    for (name, group) in &desc.groups {
        groups.push(compiler.group(cx, &format!("group.{name}."), &group.shapes));
    }
    let faults = cx.error_count();
    compiler.refuse_circles(cx, &groups);
    if cx.error_count() == faults && rules.has_uv_sets() {
        compiler.check_uv_sets_of_instances(cx, &root, &groups);
    }
    let Compiler { solids, point_sets, links, .. } = compiler;
    if cx.error_count() > before {
        return None;
    }
    let things = count_things(&root, &groups, &mut vec![None; groups.len()]);
    if things > MAX_PLACED {
        let message = format!("the scene and its instances place {things} things, the limit is {MAX_PLACED}");
        cx.error("instance", message, Some("join the meshes of a group in one, or place fewer"));
        return None;
    }
    // Say where coordinates count from: those of each group's mesh, and those of the scene
    let known = vec![None; groups.len()];
    let bounds = Extents { groups: &groups, solids: &solids, point_sets: &point_sets, known }.of(&root);
    let of_shapes = bounds.map_or(DVec3::ZERO, origin_for);
    cx.origin = desc.line_of_sight().map_or(of_shapes, |[eye, target]| origin_of_view(of_shapes, eye, target));
    for group in &mut groups {
        group.join(cx, cache, group.mesh_bounds().map_or(DVec3::ZERO, origin_for));
    }
    root.join(cx, cache, cx.origin);
    if cx.error_count() > before {
        return None;
    }
    // The layered mesh of the scene itself is placed like those of groups, and comes after them
    let [world, layered] = std::mem::take(&mut root.meshes);
    let mut meshes: Vec<Arc<Mesh>> = Vec::new();
    let mut number = |mesh: &Option<Arc<Mesh>>| {
        let mesh = mesh.as_ref()?;
        meshes.push(mesh.clone());
        Some(meshes.len() as u32 - 1)
    };
    let mesh_of = groups.iter().map(|group| group.meshes.each_ref().map(&mut number)).collect();
    let layered = number(&layered);
    let parts = Parts { solids, point_sets, meshes, rules, ..Parts::default() };
    let mut walk = SceneWalk { groups: &groups, mesh_of, parts, links, name_bytes: 0 };
    let scene_from_world = DAffine3 { translation: -cx.origin, ..DAffine3::IDENTITY };
    let is_shifted = cx.origin != DVec3::ZERO;
    walk.group(&root, None, if is_shifted { scene_from_world } else { DAffine3::IDENTITY }, &Over::NONE);
    if let Some(mesh) = layered {
        walk.place(DAffine3::IDENTITY, PlacedTarget::Mesh(mesh), SurfaceId(0), true);
    }
    let SceneWalk { mut parts, links, name_bytes, .. } = walk;
    if name_bytes > MAX_NAMES {
        let message = format!("the names of what the instances place have more than {MAX_NAMES} bytes");
        cx.error("instance", message, Some("give shorter names, or fewer"));
        return None;
    }
    parts.links = links.finish(cx);
    if cx.error_count() > before {
        return None;
    }
    parts.world = world.map(|mesh| {
        let (camera, shadow) = opacities(&parts.surfaces, &parts.rules, 0, &mesh);
        Joined { mesh, camera, shadow }
    });
    Some(Geometry::new(parts, desc.render.shadow_terminator))
}

struct Compiler<'a, 'c> {
    desc: &'a SceneDesc,
    rules: &'a MaterialRules,
    materials: MaterialNames<'a>,
    /// Groups by name.
    group_ids: HashMap<&'a str, usize>,
    links: Links,
    assets: &'a dyn Assets,
    files: &'a mut MeshFiles<'c>,
    solids: Vec<Solid>,
    point_sets: Vec<Arc<PointSet>>,
    /// Whether an instance may put a normal map on what is in a group.
    maps_groups: bool,
    /// The sets of texture coordinates that materials of instances name.
    uv_sets_of_instances: UvSetUse,
    /// Numbers for what surfaces say of rays.
    classes: HashMap<(RayRules, [bool; 2]), u32>,
}

impl Compiler<'_, '_> {
    /// Compiles the shapes of a group, or of the scene, whose paths begin with `prefix`.
    fn group(&mut self, cx: &mut CompileContext, prefix: &str, shapes: &[ShapeDesc]) -> GroupSpace {
        let mut leaves: Vec<PlacedShape> = Vec::with_capacity(shapes.len());
        let mut meshes = [MeshBuilder::default(), MeshBuilder::with_copies()];
        meshes.iter_mut().for_each(|mesh| mesh.has_tangents = self.maps_groups && !prefix.is_empty());
        // Scene order: kind by kind, in each the order of the text
        for (kind, word) in ShapeDesc::KINDS.iter().enumerate() {
            let of_kind = shapes.iter().filter(|shape| shape.kind_index() == kind);
            for (i, shape) in of_kind.enumerate() {
                let leaf = cx.within(&format!("{prefix}{word}[{i}]"), |cx| {
                    let number = leaves.len() as u32;
                    self.leaf(cx, shape, number, &mut meshes, !prefix.is_empty())
                });
                leaves.push(leaf);
            }
        }
        GroupSpace { leaves, builders: meshes, meshes: [None, None], origin: DVec3::ZERO }
    }

    fn leaf(
        &mut self,
        cx: &mut CompileContext,
        shape: &ShapeDesc,
        number: u32,
        meshes: &mut [MeshBuilder; 2],
        is_in_group: bool,
    ) -> PlacedShape {
        let common = shape.common();
        let Common { name, material, transform, visible, casts_shadow, receives_shadow, single_sided, .. } = common;
        let Common { lights, shadows, .. } = common;
        let named = material.map(|name| self.materials.resolve(cx, "material", name));
        let mut surface = Surface {
            name: name.map(Arc::from),
            material: Some(named.unwrap_or(self.materials.default())),
            visible,
            casts_shadow,
            receives_shadow,
            single_sided,
            lights: self.links.compile(cx, ["lights_include", "lights_exclude"], lights),
            shadows: self.links.compile(cx, ["shadow_include", "shadow_exclude"], shadows),
            space: 0,
        };
        let transform = TransformDesc::compile_field(transform, cx);
        let solid = |solids: &mut Vec<Solid>, solid: Solid| {
            solids.push(solid);
            Form::Solid(solids.len() as u32 - 1)
        };
        let mut uv_sets = 1;
        let form = match shape {
            ShapeDesc::Sphere(desc) => Form::Sphere(desc.compile(cx)),
            ShapeDesc::Parallelogram(desc) => Form::Parallelogram(desc.compile(cx)),
            ShapeDesc::Rectangle(desc) => Form::Parallelogram(desc.compile(cx)),
            ShapeDesc::Plane(desc) => solid(&mut self.solids, desc.compile(cx)),
            ShapeDesc::Disk(desc) => solid(&mut self.solids, desc.compile(cx)),
            ShapeDesc::Box(desc) => solid(&mut self.solids, desc.compile(cx)),
            ShapeDesc::Cylinder(desc) => solid(&mut self.solids, desc.compile(cx)),
            ShapeDesc::Cone(desc) => solid(&mut self.solids, desc.compile(cx)),
            ShapeDesc::Torus(desc) => solid(&mut self.solids, desc.compile(cx)),
            ShapeDesc::PointSet(desc) => match desc.compile(cx, self.assets, self.files) {
                Some(points) => {
                    self.point_sets.push(points);
                    Form::Points(self.point_sets.len() as u32 - 1)
                }
                None => Form::Nothing,
            },
            ShapeDesc::Mesh(desc) => match desc.compile(cx, self.assets, self.files) {
                Some(mut source) => {
                    let faces =
                        self.face_materials(cx, &source, desc.file.is_some() && desc.materials.is_empty(), named);
                    uv_sets = source.data.uvs.len();
                    self.check_uv_sets_of_mesh(cx, desc, &source, &faces);
                    source.named = self.named_uv_sets(&source, &faces, is_in_group);
                    surface.material = if let [one] = faces[..] { Some(one) } else { None };
                    let class = self.class(&surface);
                    self.add_mesh(cx, source, meshes, transform, [number, class], faces);
                    Form::MeshPart
                }
                None => Form::Nothing,
            },
            // Models were replaced by their parts
            ShapeDesc::Model(_) => Form::Nothing,
            ShapeDesc::Instance(desc) => match self.group_ids.get(desc.of.as_str()) {
                Some(group) => Form::Instance(*group),
                None => {
                    let names: Vec<&str> = self.desc.groups.iter().map(|(name, _)| name.as_str()).collect();
                    cx.unknown("of", "group", &desc.of, &names);
                    Form::Nothing
                }
            },
        };
        if let (Some(material), false) = (named, matches!(shape, ShapeDesc::Mesh(_) | ShapeDesc::Instance(_))) {
            self.check_uv_sets_of_shape(cx, shape, material);
        }
        PlacedShape { form, transform, surface, has_material: named.is_some(), uv_sets }
    }

    /// A number for what a surface says of rays: of shapes at the same place, those of one number are the same to them.
    fn class(&mut self, surface: &Surface) -> u32 {
        let next = self.classes.len() as u32;
        let passes = surface.material.map_or([false; 2], |material| self.passes(material));
        *self.classes.entry((surface.ray_rules(), passes)).or_insert(next)
    }

    /// Whether camera rays pass through surfaces of a material from behind, and from both sides.
    fn passes(&self, material: MaterialId) -> [bool; 2] {
        [self.rules.is_single_sided(material), self.rules.is_unseen(material)]
    }

    /// Adds a mesh of such a number and class to those that are opaque, or to those that are not; where its faces
    /// differ, a part to each.
    fn add_mesh(
        &self,
        cx: &mut CompileContext,
        source: MeshSource,
        meshes: &mut [MeshBuilder; 2],
        transform: Option<DAffine3>,
        [number, class]: [u32; 2],
        faces: Vec<MaterialId>,
    ) {
        let is_mapped = faces.iter().any(|material| self.rules.is_mapped(*material));
        if is_mapped && source.uv_set >= source.data.uvs.len() {
            let message = "a normal map or bump map is on a mesh without texture coordinates";
            cx.advise("material", message, Some("each triangle shows one corner of the picture"));
        }
        if source.named.own_maps {
            meshes.iter_mut().for_each(|mesh| mesh.has_tangents = true);
        }
        let layered: Vec<bool> = faces.iter().map(|material| self.rules.is_layered(*material)).collect();
        if faces.iter().any(|material| self.passes(*material) != self.passes(faces[0])) {
            meshes[0].keeps_copies = true;
        }
        if layered.iter().all(|is| *is == layered[0]) {
            return meshes[usize::from(layered[0])].add(cx, source, transform, number, class, faces);
        }
        for (of_layers, mesh) in [false, true].into_iter().zip(meshes) {
            let part = source.part(|face| layered[face as usize] == of_layers);
            if !part.data.triangles.is_empty() {
                mesh.add(cx, part, transform, number, class, faces.clone());
            }
        }
    }

    /// What the triangles of a mesh choose from: one material for all, or one for each name of the file.
    fn face_materials(
        &self,
        cx: &mut CompileContext,
        source: &MeshSource,
        from_file: bool,
        named: Option<MaterialId>,
    ) -> Vec<MaterialId> {
        let all = named.unwrap_or(self.materials.default());
        if source.data.face_materials.is_empty() {
            return vec![all];
        }
        let mut unknown = Vec::new();
        let choose = source.data.materials.iter().enumerate().map(|(i, name)| match self.materials.find(name) {
            Some(id) => id,
            // Faces before the first name of a file
            None if from_file && name.is_empty() => all,
            None if from_file => {
                unknown.push(name.as_str());
                all
            }
            None => self.materials.resolve(cx, &format!("materials[{i}]"), name),
        });
        let chosen = choose.collect();
        if !unknown.is_empty() {
            let count = unknown.len();
            let (noun, pronoun) = if count == 1 { ("a material", "is") } else { ("materials", "are") };
            let message = format!("names {noun} that {pronoun} not described: {}", first_names(&unknown));
            let read = if source.data.material_files.is_empty() { "" } else { ".mtl files are not read: " };
            let hint = "their faces have the mesh's own material; a scene describes one as [material.phong.NAME]";
            let hint = format!("{read}{hint}");
            // A scene that describes no material, as that of a bare model, has misspelt none
            if self.desc.materials.is_empty() {
                cx.advise("file", message, Some(&hint));
            } else {
                cx.warning("file", message, Some(&hint));
            }
        }
        chosen
    }

    /// A group that holds an instance of itself would never end. Without recursion: groups may be many.
    fn refuse_circles(&self, cx: &mut CompileContext, groups: &[GroupSpace]) {
        let instances = |group: usize| -> Vec<usize> {
            let of = |leaf: &PlacedShape| if let Form::Instance(of) = leaf.form { Some(of) } else { None };
            groups[group].leaves.iter().filter_map(of).collect()
        };
        // How deep the groups below each are, once that is known; those whose depth is being found are on the path
        let mut depths: Vec<Option<usize>> = vec![None; groups.len()];
        let mut on_path = vec![false; groups.len()];
        for start in 0..groups.len() {
            if depths[start].is_some() {
                continue;
            }
            on_path[start] = true;
            let mut path = vec![(start, instances(start), 0, 0)];
            while let Some((group, of, next, deepest)) = path.last_mut() {
                let field = |i: usize| format!("group.{}.instance[{i}].of", self.desc.groups[*group].0);
                let Some(below) = of.get(*next).copied() else {
                    (depths[*group], on_path[*group]) = (Some(*deepest), false);
                    path.pop();
                    continue;
                };
                if on_path[below] {
                    let message = format!("{:?} would hold itself", self.desc.groups[below].0);
                    cx.error(&field(*next), message, Some("take an instance out of the circle of groups"));
                } else if let Some(depth) = depths[below] {
                    // Said once: of the first that is too deep
                    if depth + 1 == MAX_DEPTH + 1 && *deepest <= MAX_DEPTH {
                        let message = format!("groups are more than {MAX_DEPTH} deep");
                        cx.error(&field(*next), message, Some("place some of them directly"));
                    }
                    *deepest = (*deepest).max(depth + 1);
                } else {
                    on_path[below] = true;
                    path.push((below, instances(below), 0, 0));
                    continue;
                }
                *next += 1;
            }
        }
    }
}

/// The shapes and instances that a group places, with all that is in them. `known` are those of other groups; the
/// groups are without circles and not deep.
fn count_things(group: &GroupSpace, groups: &[GroupSpace], known: &mut [Option<u64>]) -> u64 {
    let mut things = 0u64;
    for leaf in &group.leaves {
        let within = match leaf.form {
            Form::Instance(of) => match known[of] {
                Some(count) => count,
                None => {
                    let count = count_things(&groups[of], groups, known);
                    known[of] = Some(count);
                    count
                }
            },
            _ => 0,
        };
        things = things.saturating_add(within).saturating_add(1);
    }
    things
}

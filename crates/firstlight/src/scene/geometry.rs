//! All that a ray can meet, and how a ray finds it.
//!
//! Three kinds of places:
//! - spheres and parallelograms of the world lie in plain lists while there are few of them ([`LISTED`]), and are asked
//!   one after the other;
//! - the triangles of all meshes of the world lie in one tree;
//! - everything else is *placed*: it has a space of its own and a transform to the world. A second tree, over the boxes
//!   of all that is placed, leads to it: that is the upper one of two levels.
//!
//! A group that has instances is flattened: each of its meshes, point sets and solids is placed once for every
//! instance, however deep the groups are nested. No tree can change an answer: what is first on a ray is the smallest
//! distance, and the lowest id at the same distance.

use std::sync::Arc;

use super::links::{LinkId, LinkSets};
use super::occluders::Opacity;
use crate::accel::{Aabb, Bvh};
use crate::ids::{LightId, MaterialId, SurfaceId};
use crate::material::{Material, UvSetUse};
use crate::math::{DAffine3, DVec3, Facet, Ray, Vec2};
use crate::shape::{
    Mesh, Parallelogram, Placement, PointSet, ShadowTerminator, Solid, Sphere, TrianglePoint, UnboundedPlane,
};

/// What a surface id stands for.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// What the scene calls it: the names of the instances around it and its own, with `/` between.
    pub name: Option<Arc<str>>,
    /// Its material; `None` where each triangle of a mesh has its own.
    pub material: Option<MaterialId>,
    /// Whether camera rays see it.
    pub visible: bool,
    /// Whether it stands in the way of light.
    pub casts_shadow: bool,
    /// Whether others can take its light away.
    pub receives_shadow: bool,
    /// Whether camera rays pass through from behind.
    pub single_sided: bool,
    /// The lights that shine on it; `None`: all.
    pub lights: Option<LinkId>,
    /// The lights it casts shadows for, if it casts any; `None`: all.
    pub shadows: Option<LinkId>,
    /// Which of [`Geometry::spaces`] it was described in.
    pub space: u32,
}

/// A space that shapes were described in: their own, before all transforms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectSpace {
    pub scene_from_object: DAffine3,
    /// The outermost instance that placed it there, from 1 on in the order of the scene; 0 without.
    pub instance: u32,
}

/// What a surface says of rays: which of them it lets pass. Of two shapes at the same place that say the same, no ray
/// ends at the one with the higher id, and no light is stopped by it alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct RayRules {
    visible: bool,
    single_sided: bool,
    opacity: Opacity,
}

impl Surface {
    pub fn ray_rules(&self) -> RayRules {
        let Surface { visible, single_sided, .. } = *self;
        RayRules { visible, single_sided, opacity: self.opacity() }
    }

    /// Which light it stops.
    #[inline(always)]
    pub fn opacity(&self) -> Opacity {
        match self.shadows {
            _ if !self.casts_shadow => Opacity::Clear,
            None => Opacity::Opaque,
            Some(lights) => Opacity::Linked(lights),
        }
    }
}

/// A thing with a space of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PlacedTarget {
    /// The mesh of that index of [`Geometry::meshes`].
    Mesh(u32),
    /// The point set of that index of [`Geometry::point_sets`].
    Points(u32),
    /// The solid of that index of [`Geometry::solids`].
    Solid(u32),
}

/// A thing in the world.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub placement: Placement,
    pub target: PlacedTarget,
    /// Its surface; the first of several in a joined mesh.
    pub surface: SurfaceId,
    /// To camera rays, and to light.
    pub camera: Opacity,
    pub shadow: Opacity,
    /// Whether it is a layer: see [`Layers`].
    pub layered: bool,
}

/// What of a material decides which rays end at its surfaces.
#[derive(Clone, Debug, Default)]
pub(crate) struct MaterialRules {
    /// For each material whether it is not opaque; empty if all are.
    layered: Vec<bool>,
    /// For each material whether camera rays pass through from behind; empty if they do through none.
    single_sided: Vec<bool>,
    /// For each material whether camera rays pass through from both sides; empty if they do through none.
    unseen: Vec<bool>,
    /// For each material whether it bends shading normals; empty if none does.
    mapped: Vec<bool>,
    /// For each material whether its shading normals are bent, raised, or filtered; empty if those of none are.
    refined: Vec<bool>,
    /// For each material the sets of texture coordinates that its textures name; empty if none of any does.
    uv_sets: Vec<UvSetUse>,
}

impl MaterialRules {
    pub fn new(materials: &[Material]) -> MaterialRules {
        let each = |is: fn(&Material) -> bool| match materials.iter().any(is) {
            true => materials.iter().map(is).collect(),
            false => Vec::new(),
        };
        MaterialRules {
            layered: each(|material| material.common.alpha.is_some()),
            single_sided: each(|material| material.common.single_sided),
            unseen: each(Material::is_shadow_catcher),
            mapped: each(Material::is_mapped),
            refined: each(Material::refines_normals),
            uv_sets: match materials.iter().any(|material| material.uv_sets.all != 0) {
                true => materials.iter().map(|material| material.uv_sets).collect(),
                false => Vec::new(),
            },
        }
    }

    /// The sets of texture coordinates that textures of a material name.
    pub fn uv_sets(&self, material: MaterialId) -> UvSetUse {
        self.uv_sets.get(material.index()).copied().unwrap_or_default()
    }

    /// The same, as bits.
    #[inline(always)]
    pub fn named_uv_sets(&self, material: MaterialId) -> u8 {
        self.uv_sets.get(material.index()).map_or(0, |sets| sets.all)
    }

    /// Whether textures name any set of texture coordinates.
    pub fn has_uv_sets(&self) -> bool {
        !self.uv_sets.is_empty()
    }

    /// Whether a map of a material bends normals by the set of texture coordinates that the mesh chooses.
    pub fn has_own_map(&self, material: MaterialId) -> bool {
        self.is_mapped(material) && self.uv_sets.get(material.index()).is_none_or(|sets| sets.has_own_map)
    }

    /// Whether a material bends shading normals.
    #[inline(always)]
    pub fn is_mapped(&self, material: MaterialId) -> bool {
        self.mapped.get(material.index()).is_some_and(|is| *is)
    }

    /// Whether shading normals of surfaces of a material are bent, raised, or filtered.
    #[inline(always)]
    pub fn refines(&self, material: MaterialId) -> bool {
        self.refined.get(material.index()).is_some_and(|is| *is)
    }

    /// The same of any material.
    pub fn refines_any(&self) -> bool {
        !self.refined.is_empty()
    }

    /// Whether any material bends shading normals.
    pub fn has_maps(&self) -> bool {
        !self.mapped.is_empty()
    }

    /// Whether surfaces of a material are layers.
    pub fn is_layered(&self, material: MaterialId) -> bool {
        self.layered.get(material.index()).is_some_and(|is| *is)
    }

    /// The same, by which camera rays see shadow catchers.
    pub fn with_catchers(self) -> MaterialRules {
        MaterialRules { unseen: Vec::new(), ..self }
    }

    /// Whether camera rays pass through surfaces of a material from both sides: through shadow catchers.
    pub fn is_unseen(&self, material: MaterialId) -> bool {
        self.unseen.get(material.index()).is_some_and(|is| *is)
    }

    /// Whether camera rays pass from behind through surfaces of a material.
    pub fn is_single_sided(&self, material: MaterialId) -> bool {
        self.single_sided.get(material.index()).is_some_and(|is| *is)
    }
}

/// Where the surfaces are that are not opaque. They lie in no other tree and in no list, so that what is known of
/// those is known of opaque things alone.
pub(crate) struct Layers {
    pub items: Vec<UpperItem>,
    /// Over the boxes of `items`.
    pub upper: Bvh,
    /// What has no box: planes.
    pub unbounded: Vec<u32>,
}

/// Where on a surface a ray ended. In whole words: such a value is copied for every camera ray, and the compiler's own
/// layout is copied byte by byte.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(u32)]
pub(crate) enum At {
    Sphere(u32),
    Parallelogram(u32),
    /// A light's shape.
    Light,
    /// On the mesh of the world.
    World(TrianglePoint),
    /// On something placed.
    Placed(u32, PlacedSpot),
}

/// Where on something placed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(u32)]
pub(crate) enum PlacedSpot {
    Triangle(TrianglePoint),
    /// The point of a point set.
    Point(u32),
    /// The part of a solid.
    Part(u8),
}

/// The first thing on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where: the ray's `o + t d`, t > 0.
    pub t: f64,
    /// What.
    pub surface: SurfaceId,
    pub(crate) at: At,
}

impl Hit {
    /// How much the second and the third corner of a triangle count at the hit; 0 for all else.
    pub fn barycentric(&self) -> Vec2 {
        match self.at {
            At::World(point) | At::Placed(_, PlacedSpot::Triangle(point)) => Vec2::new(point.u, point.v),
            _ => Vec2::ZERO,
        }
    }

    /// The triangle that was hit, where it is.
    pub(crate) fn facet(&self) -> Facet {
        match self.at {
            At::World(point) => Facet { source: 0, triangle: point.triangle },
            At::Placed(index, PlacedSpot::Triangle(point)) => Facet { source: index + 1, triangle: point.triangle },
            _ => Facet::NONE,
        }
    }
}

/// The nearest hit so far: of several at the same distance, the one with the lowest id.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Nearest(pub Option<Hit>);

impl Nearest {
    #[inline(always)]
    pub fn offer(&mut self, t: f64, surface: SurfaceId, at: At) {
        if self.0.is_none_or(|hit| t < hit.t || t == hit.t && surface < hit.surface) {
            self.0 = Some(Hit { t, surface, at });
        }
    }

    /// What is farther than this cannot be nearest. Rounded up, so that nothing at the same distance is lost.
    #[inline(always)]
    pub fn limit(&self) -> f32 {
        self.0.map_or(f32::INFINITY, |hit| (hit.t as f32).next_up())
    }
}

/// What lies in the upper tree.
#[derive(Clone, Copy, Debug)]
pub(crate) enum UpperItem {
    Sphere(u32),
    Parallelogram(u32),
    Placed(u32),
}

/// A shape of the world, and which surface it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Owned<T> {
    /// Whether camera rays end there: it is visible and no layer.
    pub seen: bool,
    /// Whether it is a layer: see [`Layers`].
    pub layered: bool,
    pub shape: T,
    pub surface: SurfaceId,
}

/// Up to this many spheres and parallelograms are asked one by one, without a tree.
pub(crate) const LISTED: usize = 48;

/// All that a ray can meet, but for the lights.
pub(crate) struct Geometry {
    /// What each surface id of a shape stands for.
    pub surfaces: Vec<Surface>,
    pub spaces: Vec<ObjectSpace>,
    /// The names of the outermost instances.
    pub instances: Vec<Option<Arc<str>>>,
    pub spheres: Vec<Owned<Sphere>>,
    pub parallelograms: Vec<Owned<Parallelogram>>,
    /// Whether spheres and parallelograms are few: then they are asked one by one and do not lie in the upper tree.
    pub listed: bool,
    /// The triangles of all meshes of the world, in world space.
    pub world: Option<Joined>,
    pub placed: Vec<Placed>,
    pub meshes: Vec<Arc<Mesh>>,
    pub point_sets: Vec<Arc<PointSet>>,
    pub solids: Vec<Solid>,
    /// What has no box: planes.
    pub unbounded: Vec<u32>,
    pub items: Vec<UpperItem>,
    /// Over the boxes of `items`.
    pub upper: Bvh,
    /// What is not opaque; `None` if all is.
    pub layers: Option<Layers>,
    pub rules: MaterialRules,
    /// Where light is gathered on meshes with smooth normals.
    pub terminator: ShadowTerminator,
    /// The sets of lights that surfaces choose.
    pub links: LinkSets,
    /// How far what is computed of a shape in f64 may be off its place, in metres: two shapes with faces in one plane
    /// have them in one plane to within this.
    pub rounding: f32,
}

/// The mesh of the world, and which rays meet it.
pub(crate) struct Joined {
    pub mesh: Arc<Mesh>,
    pub camera: Opacity,
    pub shadow: Opacity,
}

/// What the walk through a scene finds.
#[derive(Default)]
pub(crate) struct Parts {
    pub surfaces: Vec<Surface>,
    pub spaces: Vec<ObjectSpace>,
    pub instances: Vec<Option<Arc<str>>>,
    pub spheres: Vec<Owned<Sphere>>,
    pub parallelograms: Vec<Owned<Parallelogram>>,
    pub world: Option<Joined>,
    pub placed: Vec<Placed>,
    pub meshes: Vec<Arc<Mesh>>,
    pub point_sets: Vec<Arc<PointSet>>,
    pub solids: Vec<Solid>,
    pub links: LinkSets,
    pub rules: MaterialRules,
}

/// Leaves out what has the key of something before it.
fn drop_copies<T, K: Ord>(list: &mut Vec<T>, key: impl Fn(&T) -> K) {
    let mut keys: Vec<(K, usize)> = list.iter().enumerate().map(|(i, thing)| (key(thing), i)).collect();
    keys.sort_unstable();
    let mut is_copy = vec![false; list.len()];
    for pair in keys.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        is_copy[pair[1].1] = true;
    }
    let mut is_copy = is_copy.into_iter();
    list.retain(|_| is_copy.next() != Some(true));
}

/// The same for two placed things that no ray can tell apart: of one shape, at one place, with the same to say of rays.
/// That of the lower surface, which is the one that was placed first, is then the one that rays end at.
fn same_to_rays(thing: &Placed, surfaces: &[Surface], meshes: &[Arc<Mesh>], solids: &[Solid]) -> [u8; 32] {
    let rules = |of: u32| surfaces[(thing.surface.0 + of) as usize].ray_rules();
    // Numbers are written so that different ones differ
    let what = match thing.target {
        PlacedTarget::Mesh(mesh) => {
            let rules: Vec<RayRules> = meshes[mesh as usize].parts.iter().map(|part| rules(part.surface)).collect();
            format!("mesh {mesh} {rules:?}")
        }
        PlacedTarget::Points(points) => format!("points {points} {:?}", rules(0)),
        PlacedTarget::Solid(solid) => format!("{:?} {:?}", solids[solid as usize], rules(0)),
    };
    let mut hash = blake3::Hasher::new();
    hash.update(what.as_bytes());
    for number in thing.placement.world_from_object.to_cols_array() {
        hash.update(&number.to_bits().to_le_bytes());
    }
    *hash.finalize().as_bytes()
}

/// A box of the upper tree: a little larger, so that no rounding of the shape's own test lies outside.
fn widened([low, high]: [DVec3; 2]) -> Aabb {
    let room = (high - low) * 1e-6 + low.abs().max(high.abs()) * 1e-6;
    Aabb { min: (low - room).as_vec3(), max: (high + room).as_vec3() }
}

impl std::fmt::Debug for Geometry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Geometry({} surfaces, {} placed)", self.surfaces.len(), self.placed.len())
    }
}

impl Geometry {
    /// From shapes that are in the world; the trees of meshes and point sets are there already.
    pub fn new(parts: Parts, terminator: ShadowTerminator) -> Self {
        let Parts {
            surfaces,
            spaces,
            instances,
            mut spheres,
            mut parallelograms,
            world,
            placed,
            meshes,
            point_sets,
            solids,
            links,
            rules: of_materials,
        } = parts;
        if spheres.len() + parallelograms.len() > LISTED {
            let rules = |surface: SurfaceId| surfaces[surface.index()].ray_rules();
            let own = |layered: bool, surface: SurfaceId| layered.then_some(surface);
            drop_copies(&mut spheres, |s| {
                (s.shape.place_bits(), s.shape.single_sided, rules(s.surface), own(s.layered, s.surface))
            });
            drop_copies(&mut parallelograms, |f| {
                (f.shape.place_bits(), f.shape.single_sided, rules(f.surface), own(f.layered, f.surface))
            });
        }
        let listed = spheres.len() + parallelograms.len() <= LISTED;
        let (mut items, mut boxes, mut unbounded) = (Vec::new(), Vec::new(), Vec::new());
        let (mut layers, mut layer_boxes, mut unbounded_layers) = (Vec::new(), Vec::new(), Vec::new());
        for (i, sphere) in spheres.iter().enumerate().filter(|(_, sphere)| sphere.layered || !listed) {
            let (items, boxes) =
                if sphere.layered { (&mut layers, &mut layer_boxes) } else { (&mut items, &mut boxes) };
            items.push(UpperItem::Sphere(i as u32));
            boxes.push(widened(sphere.shape.bounds()));
        }
        for (i, flat) in parallelograms.iter().enumerate().filter(|(_, flat)| flat.layered || !listed) {
            let (items, boxes) = if flat.layered { (&mut layers, &mut layer_boxes) } else { (&mut items, &mut boxes) };
            items.push(UpperItem::Parallelogram(i as u32));
            boxes.push(widened(flat.shape.bounds()));
        }
        for (i, thing) in placed.iter().enumerate() {
            let own = match thing.target {
                // Nothing in it can be hit
                PlacedTarget::Mesh(mesh) if meshes[mesh as usize].tree.len() == 0 => continue,
                PlacedTarget::Points(points) if point_sets[points as usize].bounds().is_none() => continue,
                PlacedTarget::Mesh(mesh) => meshes[mesh as usize].bounds(),
                PlacedTarget::Points(points) => point_sets[points as usize].bounds(),
                PlacedTarget::Solid(solid) => solids[solid as usize].bounds(),
            };
            match own {
                Some(own) if thing.layered => {
                    layers.push(UpperItem::Placed(i as u32));
                    layer_boxes.push(widened(thing.placement.bounds(own)));
                }
                None if thing.layered => unbounded_layers.push(i as u32),
                Some(own) => {
                    items.push(UpperItem::Placed(i as u32));
                    boxes.push(widened(thing.placement.bounds(own)));
                }
                None => unbounded.push(i as u32),
            }
        }
        drop_copies(&mut unbounded, |i| same_to_rays(&placed[*i as usize], &surfaces, &meshes, &solids));
        // Where things cannot be told apart by their boxes; what is left of spheres and parallelograms can
        let key = |item: u32| match items[item as usize] {
            UpperItem::Placed(i) => Err(same_to_rays(&placed[i as usize], &surfaces, &meshes, &solids)),
            _ => Ok(item),
        };
        let upper = Bvh::build_distinct(&boxes, key);
        let is_layered = !layers.is_empty() || !unbounded_layers.is_empty();
        let layers =
            is_layered.then(|| Layers { items: layers, upper: Bvh::build(&layer_boxes), unbounded: unbounded_layers });
        let mut geometry = Geometry {
            surfaces,
            spaces,
            instances,
            spheres,
            parallelograms,
            listed,
            world,
            placed,
            meshes,
            point_sets,
            solids,
            unbounded,
            items,
            upper,
            layers,
            rules: of_materials,
            terminator,
            links,
            rounding: 0.0,
        };
        geometry.rounding = geometry.largest_coordinate() as f32 * (64.0 * f64::EPSILON) as f32;
        geometry
    }

    /// The largest coordinate of what any shape is described by.
    fn largest_coordinate(&self) -> f64 {
        let layers = self.layers.iter().flat_map(|layers| &layers.unbounded);
        let planes = self.unbounded.iter().chain(layers).filter_map(|thing| {
            let Placed { placement, target: PlacedTarget::Solid(solid), .. } = &self.placed[*thing as usize] else {
                return None;
            };
            let (point, _) = self.solids[*solid as usize].plane()?;
            Some(placement.world_from_object.transform_point3(point).abs())
        });
        let corners = self.bounds().map(|[low, high]| low.abs().max(high.abs()));
        planes.chain(corners).map(DVec3::max_element).fold(0.0, f64::max)
    }

    /// What the scene calls each surface.
    pub fn surface_names(&self) -> impl Iterator<Item = Option<&str>> {
        self.surfaces.iter().map(|surface| surface.name.as_deref())
    }

    /// The lights that shine on a surface; `None`: all.
    #[inline(always)]
    pub fn lights_of(&self, surface: SurfaceId) -> Option<LinkId> {
        if self.links.is_empty() { None } else { self.surfaces[surface.index()].lights }
    }

    /// Whether what has such an opacity stops light of a light, or some of it may.
    #[inline(always)]
    pub fn stops(&self, opacity: Opacity, light: LightId) -> bool {
        match opacity {
            Opacity::Opaque | Opacity::Mixed => true,
            Opacity::Clear => false,
            Opacity::Linked(lights) => self.links.contains(Some(lights), light),
            Opacity::Light(own) => own != light,
        }
    }

    /// Whether a surface stands in the way of a light.
    #[inline]
    pub fn casts(&self, surface: SurfaceId, light: LightId) -> bool {
        self.stops(self.surfaces[surface.index()].opacity(), light)
    }

    /// One of the things that have no end: a plane, where it is placed.
    #[inline(always)]
    pub fn plane(&self, index: u32) -> (&Placed, &UnboundedPlane) {
        let thing = &self.placed[index as usize];
        if let PlacedTarget::Solid(solid) = thing.target
            && let Solid::Plane(plane) = &self.solids[solid as usize]
        {
            return (thing, plane);
        }
        unreachable!("only planes have no end")
    }

    /// Whether something placed has no end.
    #[inline(always)]
    pub fn is_plane(&self, index: u32) -> bool {
        let PlacedTarget::Solid(solid) = self.placed[index as usize].target else { return false };
        matches!(self.solids[solid as usize], Solid::Plane(_))
    }

    /// How far along a camera ray it meets a plane.
    #[inline(always)]
    pub fn meet_plane(&self, index: u32, ray: &Ray) -> Option<f64> {
        let (thing, plane) = self.plane(index);
        let single_sided = self.surfaces[thing.surface.index()].single_sided;
        plane.intersect(&thing.placement.ray(ray), 0.0, f64::INFINITY, single_sided).map(|hit| hit.t)
    }

    /// Every mesh, that of the world first.
    pub fn all_meshes(&self) -> impl Iterator<Item = &Mesh> {
        self.world.iter().map(|world| &world.mesh).chain(&self.meshes).map(Arc::as_ref)
    }

    /// Bytes of meshes and point sets without trees, and of all trees.
    pub fn bytes(&self) -> [u64; 2] {
        let meshes: usize = self.all_meshes().map(Mesh::bytes).sum();
        let points: usize = self.point_sets.iter().map(|points| points.bytes()).sum();
        let mesh_trees: usize = self.all_meshes().map(|mesh| mesh.tree.bytes()).sum();
        let point_trees: usize = self.point_sets.iter().map(|points| points.tree_bytes()).sum();
        let placed = size_of_val(self.placed.as_slice()) + size_of_val(self.items.as_slice());
        let upper = self.upper.bytes() + self.layers.as_ref().map_or(0, |layers| layers.upper.bytes());
        [(meshes + points) as u64, (mesh_trees + point_trees + upper + placed) as u64]
    }

    /// The box around something placed, in its own space; `None` if it is empty or has no end.
    pub fn bounds_of(&self, target: PlacedTarget) -> Option<[DVec3; 2]> {
        match target {
            PlacedTarget::Mesh(mesh) => self.meshes[mesh as usize].bounds(),
            PlacedTarget::Points(points) => self.point_sets[points as usize].bounds(),
            PlacedTarget::Solid(solid) => self.solids[solid as usize].bounds(),
        }
    }

    /// The box around all shapes that have an end: its least and its greatest corner. `None` without such shapes.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let spheres = self.spheres.iter().map(|sphere| sphere.shape.bounds());
        let flats = self.parallelograms.iter().map(|flat| flat.shape.bounds());
        let world = self.world.iter().filter_map(|world| world.mesh.bounds());
        let placed =
            self.placed.iter().filter_map(|thing| self.bounds_of(thing.target).map(|own| thing.placement.bounds(own)));
        let all = spheres.chain(flats).chain(world).chain(placed);
        all.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
    }
}

#[cfg(test)]
mod tests {
    use crate::context::NoAssets;
    use crate::scene::{CompileOptions, Scene, SceneDesc};

    fn compile(text: &str) -> Scene {
        let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
        assert_eq!(parsed.faults(), []);
        parsed.compile(&NoAssets, &CompileOptions::default()).expect("is a scene").scene
    }

    #[test]
    fn copies_of_shapes_are_met_once() {
        let camera = "[camera]\nposition = [0, 0, 9]\n[[light.point]]\nname = \"l\"\nposition = [0, 5, 9]\n";
        let sphere = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n";
        let kinds = [
            "[[parallelogram]]\np = [0, 0, 0]\ne0 = [1, 0, 0]\ne1 = [0, 1, 0]\n",
            "[[box]]\ncenter = [5, 0, 0]\n",
            "[[plane]]\npoint = [0, -3, 0]\n",
        ];
        let mut text = camera.to_owned();
        for shape in [sphere].iter().chain(&kinds) {
            text += &shape.repeat(500);
            // They differ in what rays meet, not in what is seen of them
            for other in ["material = \"m\"", "name = \"n\"", "receives_shadow = false", "lights_exclude = [\"l\"]"] {
                text += &format!("{shape}{other}\n");
            }
            for other in ["visible = false", "casts_shadow = false", "single_sided = true", "shadow_exclude = [\"l\"]"]
            {
                text += &format!("{shape}{other}\n").repeat(2);
            }
        }
        text += "[material.phong.m]\n";
        let geometry = compile(&text).geometry;
        assert_eq!(geometry.surfaces.len(), 4 * (500 + 4 + 8));
        assert_eq!((geometry.spheres.len(), geometry.parallelograms.len()), (5, 5));
        assert_eq!((geometry.placed.len(), geometry.unbounded.len()), (2 * 512, 5));
        assert!(geometry.listed && geometry.spheres[0].surface.0 == 0);
        let met = geometry.upper.len();
        assert_eq!(met, 5);
        // In a different place, turned, or of another size they are no copies
        let others = "[[box]]\ncenter = [5, 0, 0]\nsize = [1, 1, 2]\n[[box]]\ncenter = [0, 0, 0]\n\
            transform = { translate = [5, 0, 0] }\n\
                      [[box]]\ncenter = [5, 0, 0]\ntransform = { rotate_deg = [0, 0, 0.1] }\n";
        assert_eq!(compile(&format!("{camera}{others}{others}")).geometry.upper.len(), 3);
    }

    #[test]
    fn copies_of_instances_are_met_once() {
        let group = "[camera]\nposition = [0, 0, 9]\n[[group.g.sphere]]\ncenter = [0, 0, 0]\nradius = 1\n\
            [[group.g.mesh]]\n\
                     positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\ntriangles = [[0, 1, 2]]\n";
        let text = format!("{group}{}", "[[instance]]\nof = \"g\"\n".repeat(300));
        let geometry = compile(&text).geometry;
        assert_eq!((geometry.spheres.len(), geometry.upper.len()), (1, 1));
        let hidden = format!("{text}{}", "[[instance]]\nof = \"g\"\ncasts_shadow = false\n".repeat(300));
        let geometry = compile(&hidden).geometry;
        assert_eq!((geometry.spheres.len(), geometry.upper.len()), (2, 2));
    }
}

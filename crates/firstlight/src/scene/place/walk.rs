//! The second step of placing shapes: a walk through a scene and all its instances, which gives every leaf a surface
//! and a place in the world.

use std::sync::Arc;

use glam::DAffine3;

use super::{Form, GroupSpace, MAX_NAMES, PlacedShape};
use crate::ids::{MaterialId, SurfaceId};
use crate::math::DVec3;
use crate::scene::geometry::{MaterialRules, ObjectSpace, Owned, Parts, Placed, PlacedTarget, Surface};
use crate::scene::links::{LinkId, Links};
use crate::scene::occluders::Opacity;
use crate::shape::{Mesh, Placement, Solid};

/// What an instance says of everything in it.
#[derive(Clone)]
pub(super) struct Over {
    /// The names of the instances around, with `/` between.
    name: Option<Arc<str>>,
    material: Option<MaterialId>,
    visible: bool,
    casts_shadow: bool,
    receives_shadow: bool,
    single_sided: bool,
    lights: Option<LinkId>,
    shadows: Option<LinkId>,
    /// The number of the outermost of them; 0 without.
    instance: u32,
}

impl Over {
    pub const NONE: Over = Over {
        name: None,
        material: None,
        visible: true,
        casts_shadow: true,
        receives_shadow: true,
        single_sided: false,
        lights: None,
        shadows: None,
        instance: 0,
    };

    /// The name of something within.
    fn path(&self, own: &Option<Arc<str>>) -> Option<Arc<str>> {
        match (&self.name, own) {
            (Some(name), Some(own)) => Some(format!("{name}/{own}").into()),
            (name, own) => name.clone().or_else(|| own.clone()),
        }
    }

    /// What an instance within says, under this.
    fn within(&self, leaf: &PlacedShape, links: &mut Links) -> Over {
        Over {
            name: self.path(&leaf.surface.name),
            material: self.material.or(leaf.surface.material.filter(|_| leaf.has_material)),
            visible: self.visible && leaf.surface.visible,
            casts_shadow: self.casts_shadow && leaf.surface.casts_shadow,
            receives_shadow: self.receives_shadow && leaf.surface.receives_shadow,
            single_sided: self.single_sided || leaf.surface.single_sided,
            lights: links.both(self.lights, leaf.surface.lights),
            shadows: links.both(self.shadows, leaf.surface.shadows),
            instance: self.instance,
        }
    }

    fn surface(&self, own: &Surface, links: &mut Links) -> Surface {
        Surface {
            name: self.path(&own.name),
            material: self.material.or(own.material),
            visible: self.visible && own.visible,
            casts_shadow: self.casts_shadow && own.casts_shadow,
            receives_shadow: self.receives_shadow && own.receives_shadow,
            single_sided: self.single_sided || own.single_sided,
            lights: links.both(self.lights, own.lights),
            shadows: links.both(self.shadows, own.shadows),
            space: 0,
        }
    }
}

/// Walks a scene through all its instances.
pub(super) struct SceneWalk<'a> {
    pub groups: &'a [GroupSpace],
    /// The opaque and the layered mesh of each group, as indices of all meshes.
    pub mesh_of: Vec<[Option<u32>; 2]>,
    pub parts: Parts,
    pub links: Links,
    /// Bytes of the names of surfaces within instances.
    pub name_bytes: usize,
}

impl SceneWalk<'_> {
    /// Places what a group holds. `index` is that of the group, `None` for the scene itself.
    pub fn group(&mut self, group: &GroupSpace, index: Option<usize>, world_from_group: DAffine3, over: &Over) {
        let outer = over.name.as_ref().map_or(0, |name| name.len());
        if outer > 0 {
            let own = |leaf: &PlacedShape| leaf.surface.name.as_ref().map_or(0, |name| outer + 1 + name.len());
            self.name_bytes += group.leaves.iter().map(own).sum::<usize>();
        }
        if self.name_bytes > MAX_NAMES {
            return;
        }
        let first = self.parts.surfaces.len() as u32;
        let surfaces = group.leaves.iter().filter(|leaf| !matches!(leaf.form, Form::Instance(_)));
        let (links, rules) = (&mut self.links, &self.parts.rules);
        self.parts.surfaces.extend(surfaces.map(|leaf| {
            let mut surface = over.surface(&leaf.surface, links);
            surface.single_sided |= surface.material.is_some_and(|material| rules.is_single_sided(material));
            surface.visible &= !surface.material.is_some_and(|material| rules.is_unseen(material));
            surface
        }));
        let own_space = self.parts.spaces.len() as u32;
        self.parts.spaces.push(ObjectSpace { scene_from_object: world_from_group, instance: over.instance });
        for (i, leaf) in group.leaves.iter().enumerate() {
            let world = leaf.transform.map_or(world_from_group, |transform| world_from_group * transform);
            let surface = SurfaceId(first + i as u32);
            let own =
                if matches!(leaf.form, Form::Instance(_)) { None } else { self.parts.surfaces.get(surface.index()) };
            let layered =
                own.and_then(|own| own.material).is_some_and(|material| self.parts.rules.is_layered(material));
            let single_sided = own.is_some_and(|own| own.single_sided);
            let seen = own.is_some_and(|own| own.visible) && !layered;
            if !matches!(leaf.form, Form::Instance(_)) {
                let space = if leaf.transform.is_some() { self.parts.spaces.len() as u32 } else { own_space };
                if leaf.transform.is_some() {
                    self.parts.spaces.push(ObjectSpace { scene_from_object: world, instance: over.instance });
                }
                self.parts.surfaces[surface.index()].space = space;
            }
            match &leaf.form {
                Form::Nothing | Form::MeshPart => {}
                Form::Sphere(sphere) => match sphere.moved(&world) {
                    Some(mut shape) => {
                        shape.single_sided |= single_sided;
                        self.parts.spheres.push(Owned { seen, layered, shape, surface });
                    }
                    None => {
                        self.parts.solids.push(Solid::Ball(sphere.ball()));
                        let target = PlacedTarget::Solid(self.parts.solids.len() as u32 - 1);
                        self.place(world * sphere.world_from_ball(), target, surface, layered);
                    }
                },
                Form::Parallelogram(flat) => {
                    let mut shape = flat.moved(&world);
                    shape.single_sided |= single_sided;
                    self.parts.parallelograms.push(Owned { seen, layered, shape, surface });
                }
                Form::Solid(solid) => self.place(world, PlacedTarget::Solid(*solid), surface, layered),
                Form::Points(points) => {
                    let origin = self.parts.point_sets[*points as usize].origin();
                    self.place(from(world, origin), PlacedTarget::Points(*points), surface, layered);
                }
                Form::Instance(of) => {
                    let groups = self.groups;
                    let mut over = over.within(leaf, &mut self.links);
                    if over.instance == 0 {
                        self.parts.instances.push(leaf.surface.name.clone());
                        over.instance = self.parts.instances.len() as u32;
                    }
                    self.group(&groups[*of], Some(*of), world, &over);
                }
            }
        }
        // The mesh of the scene itself is in the world already
        let Some(meshes) = index.map(|index| self.mesh_of[index]) else { return };
        for (mesh, of_layers) in meshes.into_iter().zip([false, true]) {
            // One material for all in an instance says it for all
            let layered = over.material.map_or(of_layers, |material| self.parts.rules.is_layered(material));
            if let Some(mesh) = mesh {
                let world = from(world_from_group, group.origin);
                self.place(world, PlacedTarget::Mesh(mesh), SurfaceId(first), layered);
            }
        }
    }

    /// Gives something a place in the scene.
    pub fn place(&mut self, world_from_object: DAffine3, target: PlacedTarget, surface: SurfaceId, layered: bool) {
        let Parts { surfaces, rules, meshes, .. } = &self.parts;
        let (camera, shadow) = match target {
            PlacedTarget::Mesh(mesh) => opacities(surfaces, rules, surface.0, &meshes[mesh as usize]),
            PlacedTarget::Points(_) | PlacedTarget::Solid(_) => {
                let own = &surfaces[surface.index()];
                (if own.visible { Opacity::Opaque } else { Opacity::Clear }, own.opacity())
            }
        };
        let placement = Placement::new(world_from_object);
        self.parts.placed.push(Placed { placement, target, surface, camera, shadow, layered });
    }
}

/// The same transform, for coordinates that count from `origin`.
fn from(transform: DAffine3, origin: DVec3) -> DAffine3 {
    if origin == DVec3::ZERO {
        return transform;
    }
    DAffine3 { translation: transform.transform_point3(origin), ..transform }
}

/// How opaque a mesh whose surfaces start at `first` is: to camera rays, and to light.
pub(super) fn opacities(surfaces: &[Surface], rules: &MaterialRules, first: u32, mesh: &Mesh) -> (Opacity, Opacity) {
    let own = || mesh.parts.iter().map(|part| &surfaces[(first + part.surface) as usize]);
    let of = |all: bool, any: bool| match (all, any) {
        (true, _) => Opacity::Opaque,
        (false, true) => Opacity::Mixed,
        (false, false) => Opacity::Clear,
    };
    let passes = |material: &MaterialId| rules.is_single_sided(*material) || rules.is_unseen(*material);
    let faces_pass = mesh
        .parts
        .iter()
        .any(|part| surfaces[(first + part.surface) as usize].material.is_none() && part.materials.iter().any(passes));
    (
        of(own().all(|s| s.visible && !s.single_sided) && !faces_pass, own().any(|s| s.visible)),
        of(own().all(|s| s.opacity() == Opacity::Opaque), own().any(|s| s.opacity() != Opacity::Clear)),
    )
}

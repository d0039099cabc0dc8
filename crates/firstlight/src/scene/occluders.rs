//! What in lists may stand in the way of light, and of which lights: the one list that all who look for it walk.
//!
//! Spheres and parallelograms, where they are few, and the lights that block. What lies in trees says with the same
//! [`Opacity`] which light it stops; what else lets light through has its place there.

use super::geometry::{Geometry, Owned};
use super::light_spheres::LightSpheres;
use super::{LinkId, Scene};
use crate::ids::{LightId, SurfaceId};
use crate::light::{AreaShape, Light};
use crate::shape::{Disk, Parallelogram, PlaneSide, Sphere};

/// Which rays of one kind something stops: camera rays, or light on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Opacity {
    /// All.
    Opaque,
    /// None.
    Clear,
    /// The light of these lights.
    Linked(LinkId),
    /// A light's shape: the light of all others. Its own points lie on it, and it never hides them.
    Light(LightId),
    /// Its surfaces differ: each says.
    Mixed,
}

/// Something in a list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listed<T> {
    pub shape: T,
    pub opacity: Opacity,
}

impl<T> Listed<T> {
    /// The same, seen in another way.
    #[inline(always)]
    pub fn map<U>(&self, see: impl FnOnce(&T) -> U) -> Listed<U> {
        Listed { shape: see(&self.shape), opacity: self.opacity }
    }
}

/// All that is listed and stops light.
#[derive(Clone, Debug, Default)]
pub(crate) struct ListedOccluders {
    /// Spheres, then the sphere lights that block.
    pub spheres: Vec<Listed<Sphere>>,
    /// How many of them are no lights.
    surfaces: usize,
    /// Over those that are, where they are many.
    tree: Option<LightSpheres>,
    /// Parallelograms, then the rectangle lights that block.
    pub flats: Vec<Listed<Parallelogram>>,
    /// Whether the camera sees each of `flats`; it does not those beyond the end.
    pub flats_seen: Vec<bool>,
    /// The disk lights that block.
    pub disks: Vec<Listed<Disk>>,
    /// For each area light, on which side of each of `flats` it lies; nothing where that is not known.
    sides: Vec<Vec<PlaneSide>>,
}

/// Pairs of a light and a flat shape whose sides are kept.
const MAX_SIDES: usize = 1 << 24;

impl ListedOccluders {
    /// The listed surfaces that stop light, and the lights that do.
    pub fn new(geometry: &Geometry, lights: &[Light]) -> Self {
        let mut listed = ListedOccluders::default();
        if geometry.listed {
            let opacity = |surface: SurfaceId| geometry.surfaces[surface.index()].opacity();
            let stops = |layered: bool, surface: SurfaceId| !layered && opacity(surface) != Opacity::Clear;
            for Owned { shape, surface, .. } in
                geometry.spheres.iter().filter(|owned| stops(owned.layered, owned.surface))
            {
                listed.spheres.push(Listed { shape: *shape, opacity: opacity(*surface) });
            }
            let flats = geometry.parallelograms.iter().filter(|owned| stops(owned.layered, owned.surface));
            for Owned { shape, surface, seen, .. } in flats {
                listed.flats.push(Listed { shape: *shape, opacity: opacity(*surface) });
                listed.flats_seen.push(*seen);
            }
        }
        listed.surfaces = listed.spheres.len();
        for (index, light) in lights.iter().enumerate() {
            let Some(area) = light.area().filter(|area| area.blocks) else { continue };
            let opacity = Opacity::Light(LightId(index as u32));
            match &area.shape {
                AreaShape::Rectangle(rectangle) => listed.flats.push(Listed { shape: rectangle.shape, opacity }),
                AreaShape::Disk(disk) => listed.disks.push(Listed { shape: disk.shape, opacity }),
                AreaShape::Sphere(sphere) => listed.spheres.push(Listed { shape: sphere.shape, opacity }),
            }
        }
        listed.tree = LightSpheres::new(listed.light_spheres());
        let areas = lights.iter().filter_map(Light::area).count();
        let known = areas * listed.flats.len() <= MAX_SIDES;
        let sides = |light: &Light| match light.area() {
            Some(area) if known => listed.flats.iter().map(|flat| area.shape.side_of(&flat.shape)).collect(),
            _ => Vec::new(),
        };
        listed.sides = lights.iter().map(sides).collect();
        listed
    }

    /// The spheres that are no lights.
    pub fn surface_spheres(&self) -> &[Listed<Sphere>] {
        &self.spheres[..self.surfaces]
    }

    /// The sphere lights that block.
    pub fn light_spheres(&self) -> &[Listed<Sphere>] {
        &self.spheres[self.surfaces..]
    }

    /// The tree over [`light_spheres`](Self::light_spheres).
    #[inline(always)]
    pub fn light_tree(&self) -> Option<&LightSpheres> {
        self.tree.as_ref()
    }

    /// On which side of the plane of each of `flats` all of a light lies; both, of those beyond the end.
    #[inline(always)]
    pub fn sides(&self, light: LightId) -> &[PlaneSide] {
        &self.sides[light.index()]
    }
}

impl Scene {
    /// Those of a list that stop light of a light, by their places in it.
    #[inline(always)]
    pub(crate) fn that_stop<'a, T>(
        &'a self,
        list: &'a [Listed<T>],
        light: LightId,
    ) -> impl Iterator<Item = (usize, &'a Listed<T>)> {
        list.iter().enumerate().filter(move |(_, listed)| self.geometry.stops(listed.opacity, light))
    }
}

//! Occluders in BVHs: gathered in the shaft between points and a light.

use super::DirectLighting;
use crate::accel::Aabb;
use crate::ids::LightId;
use crate::material::ShadingPoint;
use crate::math::{DVec3, Facet};
use crate::render::Counts;
use crate::scene::{Scene, ShadowMesh};
use crate::visibility::{ShadowView, Shaft, Target, Viewpoint, Visibility};

/// The most leaves whose triangles are tested one by one.
const LEAVES: usize = 12;

impl DirectLighting<'_> {
    /// Whether nothing in BVHs occludes a light, seen from a point and all of its footprint, but shapes that are
    /// integrated as listed ones.
    pub(super) fn is_clear_of_trees(&mut self, index: usize, point: &ShadingPoint) -> bool {
        let (scene, lights, ShadingPoint { reach, turn, .. }) = (self.scene, self.lights, *point);
        if !lights.has_trees(scene, index) {
            return true;
        }
        let (target, trees, place) = (&lights.targets[index], &mut self.occluders, Viewpoint::of(point));
        let shaft = Shaft::around(&place, reach, turn > 0.0, &target.hull);
        trees.gather_in(self.level, scene, target, &shaft, LEAVES);
        trees.others.retain(|thing| !is_beside(scene, target, &place, reach, turn, *thing));
        // What does not rise over the one horizon of a flat footprint occludes nothing
        if reach > 0.0 && turn == 0.0 && place.but != Facet::NONE {
            trees.leaves.retain(|(source, leaf)| rises(scene, &place, *source, *leaf));
        }
        !trees.layers && !trees.has_meshes() && lights.know(index, trees.others.iter().copied())
    }

    /// The visibility of light `index` from all of some points together, by one shaft.
    pub fn gather_for(&mut self, index: usize, points: &[Viewpoint], counts: &mut Counts) -> Visibility {
        self.indices.clear();
        self.indices.extend(0..points.len() as u32);
        let occluders = &mut self.occluders;
        occluders.gather(self.level, self.scene, &self.lights.targets[index], points, &self.indices, 0);
        counts.visibility.shafts += 1;
        let is_known = || self.lights.know(index, occluders.others.iter().copied()) && !occluders.has_meshes();
        if occluders.layers || occluders.has_trees() && !is_known() {
            Visibility::Partial
        } else if occluders.count() > 0 {
            Visibility::Listed
        } else {
            Visibility::Full
        }
    }

    /// Classifies the visibility of light `index` from each of those `points` whose numbers are in `order`. `each` gets
    /// the point's number, the visibility, and, where the light has no closed form, the occluders for sampling.
    pub fn classify(
        &mut self,
        index: usize,
        points: &[Viewpoint],
        order: &mut [u32],
        counts: &mut Counts,
        mut each: impl FnMut(usize, Visibility, Option<ShadowView>),
    ) {
        let (lights, views) = (self.lights, &mut self.views);
        let (target, listed) = (&lights.targets[index], self.scene.geometry.listed);
        let stats = &mut counts.visibility;
        self.resolver.resolve(self.level, self.scene, target, points, order, stats, |k, visibility, view| {
            if visibility != Visibility::Partial {
                return each(k, visibility, None);
            }
            let is_listed = listed || view.spheres.is_empty() && view.flats.is_empty();
            let is_known = || lights.know(index, view.others.iter().map(|(thing, _)| *thing));
            if !view.trees && !view.layers && is_listed && view.triangles.is_empty() && is_known() {
                each(k, Visibility::Listed, None);
            } else {
                each(k, visibility, Some(std::mem::replace(view, views.pop().unwrap_or_default())));
            }
        });
    }

    /// The occluders of light `index`, seen from one point; `None` if it is not visible.
    pub fn classify_one(&mut self, index: usize, point: &ShadingPoint, counts: &mut Counts) -> Option<ShadowView> {
        let mut kept = self.views.pop().unwrap_or_default();
        if !(self.scene.lights[index].shadows && point.receives_shadow) {
            kept.clear();
            return Some(kept);
        }
        let mut found = None;
        let (target, points) = (&self.lights.targets[index], [Viewpoint::of(point)]);
        let settled = &mut counts.visibility;
        self.resolver.resolve(self.level, self.scene, target, &points, &mut [0], settled, |_, visibility, view| {
            found = Some(visibility);
            std::mem::swap(&mut kept, view);
        });
        match found {
            Some(Visibility::None | Visibility::BelowHorizon) | None => {
                self.views.push(kept);
                None
            }
            Some(_) => Some(kept),
        }
    }

    /// Takes a view back, for its memory.
    pub fn keep(&mut self, view: ShadowView) {
        self.views.push(view);
    }
}

/// Whether something placed is a plane that has a light and all within `reach` of a place on one side, or that the
/// place lies on, if its normal does not turn.
fn is_beside(scene: &Scene, target: &Target, place: &Viewpoint, reach: f32, turn: f32, thing: u32) -> bool {
    if !scene.geometry.is_plane(thing) {
        return false;
    }
    let (thing, plane) = scene.geometry.plane(thing);
    let (p, n) = plane.place();
    let (p, n) = (thing.placement.world_from_object.transform_point3(p), thing.placement.normal(n).normalize_or_zero());
    let height = n.dot(place.p.as_dvec3() - p);
    let (room, n) = (n.abs().dot(place.error.0.as_dvec3()), n * height.signum());
    if height.abs() <= room {
        return turn == 0.0 && n.cross(place.horizon.as_dvec3()).length() < 1e-6;
    }
    let beside = if target.hull.finite {
        let Aabb { min, max } = target.hull.bounds();
        n.max(DVec3::ZERO).dot(min.as_dvec3() - p) + n.min(DVec3::ZERO).dot(max.as_dvec3() - p)
    } else {
        n.dot(target.hull.center.as_dvec3())
    };
    height.abs() > f64::from(reach) + room && beside >= 0.0
}

/// Whether anything in a leaf of a mesh rises over the horizon of a flat place.
fn rises(scene: &Scene, place: &Viewpoint, source: u32, leaf: u32) -> bool {
    let Some(mesh) = ShadowMesh::of(&scene.geometry, source, LightId(0)) else { return true };
    mesh.mesh.tree.leaf(leaf).any(|(_, corners)| {
        corners.iter().any(|q| {
            let way = mesh.in_world(*q) - place.p.as_dvec3();
            let room = way.abs().max_element() * 1e-6 + f64::from(place.error.0.max_element());
            place.horizon.as_dvec3().dot(way) > room
        })
    })
}

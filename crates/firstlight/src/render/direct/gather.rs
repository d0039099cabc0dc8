//! Occluders in BVHs: gathered in the shaft between points and a light.

use arrayvec::ArrayVec;

use super::{DirectLighting, Group};
use crate::accel::Aabb;
use crate::ids::LightId;
use crate::material::ShadingPoint;
use crate::math::{DVec3, Facet, LANES};
use crate::render::Counts;
use crate::scene::Scene;
use crate::visibility::{ShadowMesh, ShadowView, Shaft, Target, Viewpoint, Visibility};

/// The most triangles behind which a light is integrated; with more it is sampled.
const FEW_TRIANGLES: usize = 6;
/// The most leaves whose triangles are tested one by one.
const LEAVES: usize = 12;

impl DirectLighting<'_> {
    /// Gathers the occluders in BVHs for the first of some queries, and for those after it whose points are on its
    /// surface. Returns the visibility and the number of queries that share it.
    pub(super) fn gather_run(&mut self, of: &Group, members: &[u32]) -> (Visibility, usize) {
        let first = of.point(members[0]);
        let is_like = |k: &&u32| {
            let point = of.point(**k);
            first.reach + point.reach == 0.0
                && point.surface == first.surface
                && of.query(**k).visibility == Visibility::Partial
        };
        let mut run = 1 + members[1..].iter().take(LANES - 1).take_while(is_like).count();
        loop {
            let points: ArrayVec<Viewpoint, LANES> =
                members[..run].iter().map(|k| Viewpoint::of(of.point(*k))).collect();
            let visibility = self.gather(of.light, &points, first);
            if run == 1 || visibility != Visibility::Partial {
                return (visibility, run);
            }
            run /= 2;
        }
    }

    /// Gathers the occluders in BVHs between a light and one point with its footprint, or several points.
    fn gather(
        &mut self,
        index: usize,
        points: &[Viewpoint],
        ShadingPoint { reach, turn, .. }: &ShadingPoint,
    ) -> Visibility {
        let (scene, lights, reach, turn) = (self.scene, self.lights, *reach, *turn);
        if !lights.has_trees(scene, index) {
            return Visibility::Listed;
        }
        let (target, trees) = (&lights.targets[index], &mut self.occluders);
        match points {
            [point] => {
                trees.gather_around(self.level, scene, target, point, reach, turn > 0.0, LEAVES);
                trees.others.retain(|thing| !is_beside(scene, target, point, reach, turn, *thing));
                // Below the horizon of a flat footprint nothing is an occluder
                if reach > 0.0 && turn == 0.0 && point.but != Facet::NONE {
                    trees.leaves.retain(|(source, leaf)| rises(scene, point, *source, *leaf));
                }
            }
            points => {
                self.indices.clear();
                self.indices.extend(0..points.len() as u32);
                let shaft = Shaft::of(points, &self.indices, &target.hull);
                trees.gather_in(self.level, scene, target, &shaft, LEAVES);
            }
        }
        let is_known = lights.know(index, trees.others.iter().copied());
        if is_known && !trees.has_meshes() {
            Visibility::Listed
        } else if is_known
            && !trees.too_many
            && let Some(emitter) = &lights.emitters[index]
            && self.near.gather(scene, target.light, emitter, trees, lights.obstacles[index].occluders.len())
        {
            Visibility::Gathered
        } else {
            Visibility::Partial
        }
    }

    /// Whether nothing in BVHs occludes a light of one point, from all of a footprint.
    pub(super) fn is_unoccluded_by_trees(&mut self, index: usize, point: &ShadingPoint) -> bool {
        self.gather(index, &[Viewpoint::of(point)], point) == Visibility::Listed
    }

    /// The visibility of light `index` from all of some points together, by one shaft.
    pub fn gather_for(&mut self, index: usize, points: &[Viewpoint], counts: &mut Counts) -> Visibility {
        self.indices.clear();
        self.indices.extend(0..points.len() as u32);
        let occluders = &mut self.occluders;
        occluders.gather(self.level, self.scene, &self.lights.targets[index], points, &self.indices, 0);
        counts.visibility.shafts += 1;
        let is_known = || self.lights.know(index, occluders.others.iter().copied()) && !occluders.has_meshes();
        if occluders.has_trees() && !is_known() {
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
            if view.trees
                || !lights.know(index, view.others.iter().map(|(thing, _)| *thing))
                || view.triangles.len() > FEW_TRIANGLES
            {
                each(k, visibility, Some(std::mem::replace(view, views.pop().unwrap_or_default())));
            } else if is_listed && view.triangles.is_empty() {
                each(k, Visibility::Listed, None);
            } else {
                each(k, Visibility::Gathered, None);
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
            let q = mesh.placement.map_or(q.as_dvec3(), |at| at.world_from_object.transform_point3(q.as_dvec3()));
            let way = q - place.p.as_dvec3();
            let room = way.abs().max_element() * 1e-6 + f64::from(place.error.0.max_element());
            place.horizon.as_dvec3().dot(way) > room
        })
    })
}

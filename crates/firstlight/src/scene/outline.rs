//! How far what a camera sees reaches in each direction: the support function of its convex hull.

use super::geometry::{Geometry, PlacedTarget};
use super::occluders::Opacity;
use crate::math::DVec3;
use crate::shape::Mesh;

/// What a camera can see of the shapes that have an end.
pub(super) struct ShapeOutline<'a> {
    geometry: &'a Geometry,
    /// Where its coordinates, and all answers, count from.
    pub origin: DVec3,
    /// The corners of the mesh of the world that are seen.
    world: Vec<DVec3>,
    /// Those of each of the other meshes, in its own space.
    meshes: Vec<Vec<DVec3>>,
}

/// The corners of the triangles of `mesh` whose surface is seen, each once. `first` is the surface that its own are
/// counted from.
fn corners(geometry: &Geometry, mesh: &Mesh, first: u32) -> Vec<DVec3> {
    let mut seen = vec![false; mesh.positions.len()];
    let ends = mesh.parts.iter().skip(1).map(|part| part.first_triangle as usize).chain([mesh.triangles.len()]);
    for (part, end) in mesh.parts.iter().zip(ends) {
        if geometry.surfaces[(first + part.surface) as usize].visible {
            let own = &mesh.triangles[part.first_triangle as usize..end];
            let own = own.iter().filter(|triangle| mesh.is_hit(triangle));
            own.for_each(|triangle| triangle.iter().for_each(|i| seen[*i as usize] = true));
        }
    }
    let seen = mesh.positions.iter().zip(seen).filter(|(_, seen)| *seen);
    seen.map(|(p, _)| DVec3::new(p[0].into(), p[1].into(), p[2].into())).collect()
}

/// The most that `d` . p is over points.
fn farthest(points: &[DVec3], d: DVec3) -> f64 {
    points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max)
}

impl<'a> ShapeOutline<'a> {
    pub fn new(geometry: &'a Geometry, origin: DVec3) -> Self {
        let world = geometry.world.as_ref().map(|world| corners(geometry, &world.mesh, 0)).unwrap_or_default();
        let mut meshes = vec![Vec::new(); geometry.meshes.len()];
        // What an instance hides is hidden as a whole, and so one that is seen speaks for all
        for thing in geometry.placed.iter().filter(|thing| thing.camera != Opacity::Clear) {
            if let PlacedTarget::Mesh(mesh) = thing.target
                && meshes[mesh as usize].is_empty()
            {
                meshes[mesh as usize] = corners(geometry, &geometry.meshes[mesh as usize], thing.surface.0);
            }
        }
        ShapeOutline { geometry, origin, world, meshes }
    }

    /// The smallest box around all of it, but for rounding; `None` if there is nothing.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let reach = |d: DVec3| self.support(d);
        let high = DVec3::new(reach(DVec3::X), reach(DVec3::Y), reach(DVec3::Z));
        let low = -DVec3::new(reach(DVec3::NEG_X), reach(DVec3::NEG_Y), reach(DVec3::NEG_Z));
        (low.is_finite() && high.is_finite()).then_some([low, high])
    }

    /// The most that `d` . x is over it; minus infinity if there is nothing.
    pub fn support(&self, d: DVec3) -> f64 {
        let Geometry { spheres, parallelograms, placed, point_sets, solids, .. } = self.geometry;
        let length = d.length();
        let spheres = spheres.iter().filter(|sphere| sphere.seen).map(|s| s.shape.c.dot(d) + s.shape.r * length);
        let flats = parallelograms.iter().filter(|flat| flat.seen).map(|flat| flat.shape.support(d));
        let mut most = spheres.chain(flats).fold(farthest(&self.world, d), f64::max);
        for thing in placed.iter().filter(|thing| thing.camera != Opacity::Clear) {
            let Some(own) = self.geometry.bounds_of(thing.target) else { continue };
            // Of many, nearly all lie within reach of others
            let placement = &thing.placement;
            let [low, high] = placement.bounds(own);
            if !((low * d).max(high * d).element_sum() > most) {
                continue;
            }
            let there = placement.world_from_object.matrix3.transpose() * d;
            let reach = match thing.target {
                PlacedTarget::Mesh(mesh) => farthest(&self.meshes[mesh as usize], there),
                PlacedTarget::Points(points) => point_sets[points as usize].support(there),
                PlacedTarget::Solid(solid) => solids[solid as usize].support(there),
            };
            most = most.max(reach + placement.world_from_object.translation.dot(d));
        }
        most
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::NoAssets;
    use crate::scene::{CompileOptions, SceneDesc};

    /// The box around what a camera sees of a scene.
    fn bounds(text: &str) -> Option<[DVec3; 2]> {
        let scene = format!("[camera]\nposition = [0, 0, 50]\n{text}");
        let parsed = SceneDesc::parse("s.toml", scene.as_bytes(), &NoAssets);
        let compiled = parsed.compile(&NoAssets, &CompileOptions::default());
        let scene = compiled.map(|compiled| compiled.scene).map_err(|e| e.to_string()).expect("a scene");
        ShapeOutline::new(&scene.geometry, DVec3::ZERO).bounds()
    }

    #[test]
    fn every_shape_reaches_as_far_as_it_does() {
        for (text, low, high) in [
            ("[[sphere]]\ncenter = [1, 2, 3]\nradius = 2", [-1.0, 0.0, 1.0], [3.0, 4.0, 5.0]),
            (
                "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\ntransform = { scale = [1, 2, 3] }",
                [-1.0, -2.0, -3.0],
                [1.0, 2.0, 3.0],
            ),
            ("[[parallelogram]]\np = [0, 0, 0]\ne0 = [2, 0, 1]\ne1 = [-1, 3, 0]", [-1.0, 0.0, 0.0], [2.0, 3.0, 1.0]),
            ("[[box]]\ncenter = [0, 1, 0]\nsize = [2, 2, 4]", [-1.0, 0.0, -2.0], [1.0, 2.0, 2.0]),
            ("[[cylinder]]\np0 = [0, 0, 0]\np1 = [0, 2, 0]\nradius = 1", [-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]),
            (
                "[[torus]]\ncenter = [0, 0, 0]\nmajor_radius = 2\nminor_radius = 0.5",
                [-2.5, -0.5, -2.5],
                [2.5, 0.5, 2.5],
            ),
            ("[[point_set]]\npositions = [[0, 0, 0], [1, 0, 0]]\nradius = 0.5", [-0.5, -0.5, -0.5], [1.5, 0.5, 0.5]),
            // The second vertex list entry is used by no triangle
            (
                "[[mesh]]\npositions = [[0, 0, 0], [9, 9, 9], [1, 0, 0], [0, 2, 0]]\ntriangles = [[0, 2, 3]]",
                [0.0; 3],
                [1.0, 2.0, 0.0],
            ),
            // What no camera sees is not looked for, and a plane has no end
            (
                "[[plane]]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n[[sphere]]\ncenter = [9, 0, 0]\nradius = 1\n\
                 visible = false",
                [-1.0; 3],
                [1.0; 3],
            ),
            (
                "[[group.g.mesh]]\npositions = [[0, 0, 0], [1, 0, 0], [0, 2, 0]]\ntriangles = [[0, 1, 2]]\n\
                 [[instance]]\nof = \"g\"\ntransform = { translate = [5, 0, 0] }\n[[instance]]\nof = \"g\"\n\
                 [[instance]]\nof = \"g\"\ntransform = { translate = [50, 0, 0] }\nvisible = false",
                [0.0; 3],
                [6.0, 2.0, 0.0],
            ),
        ] {
            let [a, b] = bounds(text).unwrap_or_default();
            let off = (a - DVec3::from(low)).abs().max((b - DVec3::from(high)).abs()).max_element();
            assert!(off < 1e-6, "{text}: {a} {b}");
        }
        assert_eq!(bounds("[[plane]]"), None);
    }
}

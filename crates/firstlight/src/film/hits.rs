//! The hits of the camera rays of neighbouring pixels.
//!
//! The rays of a block of 8 x 8 traverse the tree of the mesh in world coordinates as a packet, and those of placed
//! meshes where few things are placed; all else is intersected ray by ray. The hits have the bits of
//! [`Scene::intersect`].

use fearless_simd::{Level, f32x16, prelude::*};

use super::tile::Tile;
use crate::accel::{Planes, RayTile};
use crate::math::{LANES, Ray, Vec3, dispatch_wide};
use crate::scene::{Hit, Nearest, Scene};
use crate::shape::{RayDifferential, TileHits, bits};

/// Rays across a block.
const BLOCK: u32 = 8;

/// The camera rays of a square of pixels, and their hits.
pub(crate) struct PixelHits {
    level: Level,
    /// Rays across a pixel.
    n: u32,
    /// Pixels across.
    side: u32,
    /// Rays across.
    across: u32,
    /// The pixel that it begins at.
    first: [u32; 2],
    /// The nearest hit of each ray.
    hits: Vec<Nearest>,
    rays: Box<RayTile>,
    found: Box<TileHits>,
    /// The meshes that are placed where the rays of a block go.
    meshes: Vec<u32>,
}

impl PixelHits {
    /// Of `n` x `n` rays in each pixel.
    pub fn new(level: Level, n: u32) -> Self {
        let side = (BLOCK / n).max(1);
        let across = side * n;
        PixelHits {
            level,
            n,
            side,
            across,
            first: [0; 2],
            hits: vec![Nearest(None); (across * across) as usize],
            rays: Box::new(RayTile::ZERO),
            found: Box::new(TileHits::new(0.0)),
            meshes: Vec::new(),
        }
    }

    /// Pixels across and down that are traced together.
    pub fn side(&self) -> u32 {
        self.side
    }

    /// Traces the rays of some pixels, at most [`side`](Self::side) across and down.
    pub fn trace(&mut self, scene: &Scene, pixels: Tile) {
        let n = self.n;
        let Tile { x, y, width, height } = pixels;
        self.first = [x, y];
        for rays in (Tile { x: x * n, y: y * n, width: width * n, height: height * n }).parts(BLOCK, 1) {
            self.block(scene, rays);
        }
    }

    /// Traces a block of rays, counted on the film.
    fn block(&mut self, scene: &Scene, rays: Tile) {
        let geometry = &scene.geometry;
        self.aim(scene, rays.x, rays.y);
        let [left, top] = [rays.x - self.first[0] * self.n, rays.y - self.first[1] * self.n];
        let (w, h) = (rays.width, rays.height);
        let bundle = geometry.is_world_seen();
        // Whether packets find all hits with placed things too
        let upper_bundle = {
            let corners = [[0, 0], [w - 1, 0], [w - 1, h - 1], [0, h - 1]].map(|[column, row]| {
                let place = place(column, row);
                [self.rays.o(place), self.rays.d(place)].map(Vec3::as_dvec3)
            });
            geometry.few_meshes(self.level, &Planes::around(corners), &mut self.meshes)
        };
        let at = |place: usize| {
            let (row, column) = (place / 32 * 4 + place % 16 / 4, place / 16 % 2 * 4 + place % 4);
            (top as usize + row) * self.across as usize + left as usize + column
        };
        let rays = &self.rays;
        let ray = |place: usize| Ray { o: rays.o(place), d: rays.d(place) };
        let mut active = 0u64;
        for row in 0..h {
            for column in 0..w {
                let place = place(column, row);
                let ray = ray(place);
                let mut nearest = scene.meet_listed(&ray);
                if upper_bundle {
                    geometry.meet_unbounded(self.level, &ray, &mut nearest);
                } else {
                    geometry.meet_upper(self.level, &ray, &mut nearest);
                }
                active |= 1 << place;
                self.hits[at(place)] = nearest;
            }
        }
        if bundle {
            ask_from_here(&mut self.found, active, |place| self.hits[at(place)].limit());
            let met = geometry.meet_world(self.level, &self.rays, active, &mut self.found);
            for place in bits(met) {
                let nearest = &mut self.hits[at(place)];
                if !geometry.offer_world(&ray(place), &self.found, place, nearest) {
                    geometry.meet_trees(self.level, &ray(place), nearest);
                }
            }
        }
        if upper_bundle && !self.meshes.is_empty() {
            ask_from_here(&mut self.found, active, |place| self.hits[at(place)].limit());
            let mut met = 0;
            for mesh in &self.meshes {
                met |= geometry.meet_placed_tile(self.level, *mesh, &self.rays, active, &mut self.found);
            }
            for place in bits(met) {
                let nearest = &mut self.hits[at(place)];
                if !geometry.offer_placed(&self.meshes, &ray(place), &self.found, place, nearest) {
                    geometry.meet_trees(self.level, &ray(place), nearest);
                }
            }
        }
    }

    /// Finds the rays of the block from ray (`x`, `y`) of the film: the bits of [`grid_ray`].
    fn aim(&mut self, scene: &Scene, x: u32, y: u32) {
        let [xs, ys] = [x, y].map(|first| std::array::from_fn::<f32, 8, _>(|k| on_film(self.n, first + k as u32)));
        for part in 0..4usize {
            let (columns, rows) = (&xs[part % 2 * 4..][..4], &ys[part / 2 * 4..][..4]);
            let x: [f32; LANES] = std::array::from_fn(|k| columns[k % 4]);
            let y: [f32; LANES] = std::array::from_fn(|k| rows[k / 4]);
            let ways = ray_lanes(self.level, scene, x, y);
            for (to, from) in [&mut self.rays.o, &mut self.rays.d].into_iter().zip(ways) {
                for axis in 0..3 {
                    to[axis][LANES * part..][..LANES].copy_from_slice(&from[axis]);
                }
            }
        }
    }

    /// The camera ray through a pixel, where a pixel has one.
    #[inline(always)]
    pub fn ray(&self, [i, j]: [u32; 2]) -> Ray {
        debug_assert_eq!(self.n, 1, "of several, each belongs to a block of its own");
        let place = place(i - self.first[0], j - self.first[1]);
        Ray { o: self.rays.o(place), d: self.rays.d(place) }
    }

    /// The hit of ray (`column`, `row`) of a pixel that was traced.
    #[inline(always)]
    pub fn get(&self, [i, j]: [u32; 2], column: u32, row: u32) -> Option<Hit> {
        let [i, j] = [i - self.first[0], j - self.first[1]];
        self.hits[((j * self.n + row) * self.across + i * self.n + column) as usize].0
    }
}

/// Limits hits to the nearest known hit of each ray.
fn ask_from_here(found: &mut TileHits, active: u64, limit: impl Fn(usize) -> f32) {
    for place in bits(active) {
        found.t[place] = limit(place);
        found.surface[place] = u32::MAX;
        found.triangle[place] = u32::MAX;
    }
}

/// Camera ray (`x`, `y`) of the film, counted in rays, and its differentials.
#[inline(always)]
pub(crate) fn camera_ray(scene: &Scene, x: u32, y: u32) -> (Ray, RayDifferential) {
    grid_ray(scene, scene.antialiasing, x, y)
}

/// The same of a grid of `n` x `n` rays in each pixel.
#[inline(always)]
pub(super) fn grid_ray(scene: &Scene, n: u32, x: u32, y: u32) -> (Ray, RayDifferential) {
    scene.camera.local_ray(on_film(n, x), on_film(n, y), 1.0 / n as f32)
}

/// The position of a ray of such a grid on the film along one axis, in pixels: the middle of its part of the pixel.
#[inline(always)]
fn on_film(n: u32, ray: u32) -> f32 {
    (ray / n) as f32 + ((ray % n) as f32 + 0.5) / n as f32
}

/// The index of a ray in its block, which consists of blocks of 4 x 4.
#[inline(always)]
fn place(column: u32, row: u32) -> usize {
    ((row / 4 * 2 + column / 4) * 16 + row % 4 * 4 + column % 4) as usize
}

/// The origins and the ways of the camera rays through sixteen places on the film, axis by axis.
fn ray_lanes(level: Level, scene: &Scene, x: [f32; LANES], y: [f32; LANES]) -> [[[f32; LANES]; 3]; 2] {
    dispatch_wide!(level, simd => simd.vectorize(
        #[inline(always)]
        || {
            let [x, y] = [x, y].map(|places| f32x16::simd_from(simd, places));
            scene.camera.ray_lanes(simd, x, y).map(|v| [v.x.to_array(), v.y.to_array(), v.z.to_array()])
        },
    ))
}

/// The camera rays of one pixel, row by row.
pub(crate) struct PixelRays {
    level: Level,
    /// Where in the pixel they are, sixteen by sixteen: across and down.
    places: Vec<[[f32; LANES]; 2]>,
    rays: Vec<Ray>,
}

impl PixelRays {
    /// For a scene whose pixels have `n` x `n` rays.
    pub fn new(level: Level, n: u32) -> Self {
        let ray = Ray { o: Vec3::ZERO, d: Vec3::ZERO };
        let place = |number: u32| [number % n, number / n].map(|k| (k as f32 + 0.5) / n as f32);
        let places = (0..n * n).step_by(LANES).map(|first| {
            let number = |k: usize| (first + k as u32).min(n * n - 1);
            [std::array::from_fn(|k| place(number(k))[0]), std::array::from_fn(|k| place(number(k))[1])]
        });
        PixelRays { level, places: places.collect(), rays: vec![ray; (n * n) as usize] }
    }

    /// Those of pixel (`i`, `j`): the bits of [`camera_ray`].
    pub fn of(&mut self, scene: &Scene, [i, j]: [u32; 2]) -> &[Ray] {
        let PixelRays { places, rays, .. } = self;
        for (places, rays) in places.iter().zip(rays.chunks_mut(LANES)) {
            let [o, d] = ray_lanes(self.level, scene, places[0].map(|x| x + i as f32), places[1].map(|y| y + j as f32));
            for (k, ray) in rays.iter_mut().enumerate() {
                *ray = Ray { o: Vec3::new(o[0][k], o[1][k], o[2][k]), d: Vec3::new(d[0][k], d[1][k], d[2][k]) };
            }
        }
        &self.rays
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::SimdLevel;
    use crate::context::NoAssets;
    use crate::scene::{CompileOptions, SceneDesc};

    #[test]
    fn the_rays_of_a_pixel_are_those_that_are_made_one_by_one() {
        let level = SimdLevel::Auto.resolve().token();
        for projection in ["", "projection = \"orthographic\"\nheight = 3"] {
            for n in [1, 2, 3, 4, 5, 8] {
                let text = format!(
                    "[render]\nwidth = 70\nheight = 50\nantialiasing = {n}\n\
                     [camera]\nposition = [1, 2, 3]\nlook_at = [0, 0.3, 0]\n{projection}\n"
                );
                let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
                let scene = parsed.compile(&NoAssets, &CompileOptions::default()).expect("is a scene").scene;
                let mut rays = PixelRays::new(level, n);
                for (i, j) in [(0, 0), (69, 49), (33, 7)] {
                    for (k, ray) in rays.of(&scene, [i, j]).iter().enumerate() {
                        let (one, _) = camera_ray(&scene, i * n + k as u32 % n, j * n + k as u32 / n);
                        assert_eq!((ray.o, ray.d), (one.o, one.d), "{n} {i} {j} {k}");
                    }
                }
            }
        }
    }

    #[test]
    fn placed_meshes_are_met_as_ray_by_ray() {
        let level = SimdLevel::Auto.resolve().token();
        let part = |more: &str| {
            format!(
                "[[group.star.mesh]]\n\
                 positions = [[0, 1, 0], [1, -1, 0.5], [-1, -1, -0.5], [0, 0, 1], [0.3, 0.2, -1]]\n\
                 triangles = [[0, 1, 2], [0, 2, 3], [1, 3, 4], [4, 0, 1], [2, 4, 3]]\n{more}\n"
            )
        };
        let place = |x: f64, more: &str| {
            format!("[[instance]]\nof = \"star\"\ntransform = {{ translate = [{x}, 0, 0] }}\n{more}\n")
        };
        let ball = "[[group.ball.sphere]]\ncenter = [0, 1.2, 0]\nradius = 0.5\n[[instance]]\nof = \"ball\"\n";
        let tilted =
            "[[instance]]\nof = \"star\"\ntransform = { rotate_deg = [20, 30, 5], scale = [0.7, -1.1, 0.8] }\n";
        let own = "[[mesh]]\npositions = [[-3, -1, -1], [3, -1, -1], [0, 2, 0.4]]\ntriangles = [[0, 1, 2]]\n";
        let mixed = "[material.phong.solid]\n[material.phong.veil]\nalpha_mode = \"blend\"\n[[group.star.mesh]]\n\
                     positions = [[1, 0, 1], [2, 0, 1], [1, 1, 0], [0, 1, 1]]\ntriangles = [[0, 1, 2], [0, 2, 3]]\n\
                     materials = [\"solid\", \"veil\"]\nface_materials = [0, 1]\n";
        let both = place(0.4, "") + &place(0.4, "") + tilted;
        for (number, (text, projection)) in [
            (both.clone(), ""),
            (both.clone() + own, ""),
            (both.clone() + own + ball, "projection = \"orthographic\"\nheight = 3"),
            (place(-1.0, "visible = false") + &both, ""),
            ((0..9).map(|k| place(f64::from(k) * 0.4 - 1.6, "")).collect::<String>() + ball, ""),
            // An instance makes both meshes of its group opaque, which have one surface
            (mixed.to_owned() + &place(0.4, "material = \"solid\""), ""),
        ]
        .into_iter()
        .enumerate()
        {
            for single in ["", "single_sided = true"] {
                let text = format!(
                    "[render]\nwidth = 45\nheight = 37\n[camera]\nposition = [1, 0.5, 4]\nlook_at = [0, 0, 0]\n\
                     {projection}\n{}{text}",
                    part(single)
                );
                let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
                let scene = parsed.compile(&NoAssets, &CompileOptions::default()).expect("is a scene").scene;
                let mut hits = PixelHits::new(level, 1);
                let mut met = 0;
                for block in (Tile { x: 0, y: 0, width: 45, height: 37 }).parts(8, 1) {
                    hits.trace(&scene, block);
                    for pixel in block.pixels() {
                        let one = scene.intersect_at(level, &hits.ray(pixel));
                        assert_eq!(format!("{:?}", hits.get(pixel, 0, 0)), format!("{one:?}"), "{number} {pixel:?}");
                        met += u32::from(one.is_some());
                    }
                }
                assert!(met > 100, "{number}: {met}");
            }
        }
    }
}

//! The hits of the camera rays of neighbouring pixels.
//!
//! The rays of a block of 8 x 8 traverse the tree of the mesh in world coordinates as a packet, and those of placed
//! meshes where few things are placed; all else is intersected ray by ray. The hits have the bits of
//! [`Scene::intersect`].

use fearless_simd::{Level, f32x16, prelude::*};

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
    hits: Vec<Option<Hit>>,
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
            hits: vec![None; (across * across) as usize],
            rays: Box::new(RayTile::ZERO),
            found: Box::new(TileHits::new(0.0)),
            meshes: Vec::new(),
        }
    }

    /// Pixels across and down that are traced together.
    pub fn side(&self) -> u32 {
        self.side
    }

    /// Traces the rays of the pixels from (`i`, `j`), `width` x `height` of them, at most [`side`](Self::side).
    pub fn trace(&mut self, scene: &Scene, i: u32, j: u32, width: u32, height: u32) {
        let n = self.n;
        let (rays_across, rays_down) = (width * n, height * n);
        for top in (0..rays_down).step_by(BLOCK as usize) {
            for left in (0..rays_across).step_by(BLOCK as usize) {
                let (w, h) = ((rays_across - left).min(BLOCK), (rays_down - top).min(BLOCK));
                self.block(scene, i * n, j * n, left, top, w, h);
            }
        }
    }

    /// Traces the `w` x `h` rays from (`left`, `top`) of the square that begins at ray (`x`, `y`) of the film.
    #[allow(clippy::too_many_arguments, reason = "a rectangle in a square on a film")]
    fn block(&mut self, scene: &Scene, x: u32, y: u32, left: u32, top: u32, w: u32, h: u32) {
        let geometry = &scene.geometry;
        self.aim(scene, x + left, y + top);
        let bundle = geometry.world_as_bundle();
        // Whether packets find all hits with placed things too
        let upper_bundle = (bundle || !geometry.has_world()) && {
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
        let mut active = 0u64;
        for row in 0..h {
            for column in 0..w {
                let place = place(column, row);
                let ray = Ray { o: self.rays.o(place), d: self.rays.d(place) };
                let mut nearest = scene.meet_listed(&ray);
                if upper_bundle {
                    geometry.meet_unbounded(self.level, &ray, &mut nearest);
                } else if bundle {
                    geometry.meet_upper(self.level, &ray, &mut nearest);
                } else if geometry.has_trees() {
                    geometry.meet_trees(self.level, &ray, &mut nearest);
                }
                active |= 1 << place;
                self.hits[at(place)] = nearest.0;
            }
        }
        if bundle {
            ask_from_here(&mut self.found, active, |place| Nearest(self.hits[at(place)]));
            let met = geometry.meet_world(self.level, &self.rays, active, &mut self.found);
            for place in bits(met) {
                improve(&mut self.hits[at(place)], |nearest| geometry.offer_world(&self.found, place, nearest));
            }
        }
        if upper_bundle && !self.meshes.is_empty() {
            ask_from_here(&mut self.found, active, |place| Nearest(self.hits[at(place)]));
            let mut met = 0;
            for mesh in &self.meshes {
                met |= geometry.meet_placed_tile(self.level, *mesh, &self.rays, active, &mut self.found);
            }
            for place in bits(met) {
                let offer = |nearest: &mut Nearest| geometry.offer_placed(&self.meshes, &self.found, place, nearest);
                improve(&mut self.hits[at(place)], offer);
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
            let ways = dispatch_wide!(self.level, simd => simd.vectorize(
                #[inline(always)]
                || {
                    let [x, y] = [x, y].map(|places| f32x16::simd_from(simd, places));
                    let ways = scene.camera.ray_lanes(simd, x, y);
                    ways.map(|v| [v.x.to_array(), v.y.to_array(), v.z.to_array()])
                },
            ));
            for (to, from) in [&mut self.rays.o, &mut self.rays.d].into_iter().zip(ways) {
                for axis in 0..3 {
                    to[axis][LANES * part..][..LANES].copy_from_slice(&from[axis]);
                }
            }
        }
    }

    /// The camera ray through a pixel of the last block, where a pixel has one.
    #[inline(always)]
    pub fn ray(&self, i: u32, j: u32) -> Ray {
        debug_assert_eq!(self.n, 1, "of several, each belongs to a block of its own");
        let place = place(i, j);
        Ray { o: self.rays.o(place), d: self.rays.d(place) }
    }

    /// The hit of ray (`column`, `row`) of pixel (`i`, `j`), counted from the first pixel that was traced.
    #[inline(always)]
    pub fn get(&self, i: u32, j: u32, column: u32, row: u32) -> Option<Hit> {
        self.hits[((j * self.n + row) * self.across + i * self.n + column) as usize]
    }
}

/// Replaces a ray's nearest hit by a nearer one.
fn improve(hit: &mut Option<Hit>, offer: impl FnOnce(&mut Nearest)) {
    let mut nearest = Nearest(*hit);
    offer(&mut nearest);
    *hit = nearest.0;
}

/// Limits hits to the nearest known hit of each ray.
fn ask_from_here(found: &mut TileHits, active: u64, nearest: impl Fn(usize) -> Nearest) {
    for place in bits(active) {
        found.t[place] = nearest(place).limit();
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
            let [o, d] = dispatch_wide!(self.level, simd => simd.vectorize(
                #[inline(always)]
                || {
                    let [x, y] = places.map(|places| f32x16::simd_from(simd, places));
                    let ways = scene.camera.ray_lanes(simd, x + i as f32, y + j as f32);
                    ways.map(|v| [v.x.to_array(), v.y.to_array(), v.z.to_array()])
                },
            ));
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
        let both = place(0.4, "") + &place(0.4, "") + tilted;
        for (number, (text, projection)) in [
            (both.clone(), ""),
            (both.clone() + own, ""),
            (both.clone() + own + ball, "projection = \"orthographic\"\nheight = 3"),
            (place(-1.0, "visible = false") + &both, ""),
            ((0..9).map(|k| place(f64::from(k) * 0.4 - 1.6, "")).collect::<String>() + ball, ""),
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
                for (y, x) in (0..37).step_by(8).flat_map(|y| (0..45).step_by(8).map(move |x| (y, x))) {
                    let (w, h) = (8.min(45 - x), 8.min(37 - y));
                    hits.trace(&scene, x, y, w, h);
                    for (j, i) in (0..h).flat_map(|j| (0..w).map(move |i| (j, i))) {
                        let one = scene.intersect_at(level, &hits.ray(i, j));
                        assert_eq!(
                            format!("{:?}", hits.get(i, j, 0, 0)),
                            format!("{one:?}"),
                            "{number} {x} {y} {i} {j}"
                        );
                        met += u32::from(one.is_some());
                    }
                }
                assert!(met > 100, "{number}: {met}");
            }
        }
    }
}

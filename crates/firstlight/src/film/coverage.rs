//! Planes from all n x n camera rays of a pixel: coverage, Cryptomatte, and means of planes of centre rays.
//!
//! Independent of all lighting, as [`centers`](super::centers) is. All rays are traced, in every antialiasing mode;
//! they are the camera rays of the picture.

use std::ops::ControlFlow;

use fearless_simd::Level;

use super::centers::{Center, nothing};
use super::hits::{PixelHits, grid_ray};
use super::{CenterValue, FilmTile};
use crate::ids::SurfaceId;
use crate::image::cryptomatte::{self, Named, hashed_name, id_bits};
use crate::image::{Buffer, Plane};
use crate::scene::{Hit, LayerStack, Scene};

/// Rays between two calls of `go_on`.
const QUESTION_EVERY: u32 = 1 << 20;

/// The planes of a film that come from all camera rays, each with its number.
pub(crate) struct CoveragePlanes {
    /// The surfaces of coverage planes, by their ids.
    objects: Vec<(SurfaceId, usize)>,
    background: Option<usize>,
    mattes: Vec<(Matte, usize)>,
    /// Means over the rays of a plane of centre rays.
    means: Vec<(Plane, usize)>,
}

/// A layer of Cryptomatte.
struct Matte {
    named: Named,
    /// The bits of each name, that of id 1 first.
    bits: Vec<u32>,
}

/// Fills the planes of tiles from all camera rays, for one thread.
pub(crate) struct Coverage<'a> {
    scene: &'a Scene,
    asked: &'a CoveragePlanes,
    hits: PixelHits,
    /// What the rays of a pixel show: the number of the ray on the film, and the hit.
    shown: Vec<([u32; 2], Hit)>,
    /// All that they meet, layers included, each with the part of its ray that ends there.
    met: Vec<(f64, Hit)>,
    stack: LayerStack,
    shares: Shares,
    /// One for each of the means.
    sums: Vec<[f64; 3]>,
}

/// Counts how many rays have the same key, parts of rays included.
#[derive(Default)]
struct Shares {
    keys: Vec<(u32, f64)>,
    /// Each key and how many rays have it, by the key.
    counts: Vec<(u32, f64)>,
}

impl CoveragePlanes {
    /// Those of some planes; `None` if there are none.
    pub fn new(scene: &Scene, planes: &[Buffer]) -> Option<CoveragePlanes> {
        let mut asked = CoveragePlanes { objects: Vec::new(), background: None, mattes: Vec::new(), means: Vec::new() };
        for (number, buffer) in planes.iter().enumerate() {
            match *buffer {
                Buffer::Coverage(object) => asked.objects.push((object, number)),
                Buffer::Plane(Plane::BackgroundCoverage) => asked.background = Some(number),
                Buffer::Plane(plane) => {
                    asked.mattes.extend(Named::of_layer(plane).map(|named| (Matte::new(scene, named), number)));
                    asked.means.extend(plane.of_each_ray().map(|of| (of, number)));
                }
                Buffer::Light(..) | Buffer::Group(..) => {}
            }
        }
        asked.objects.sort_unstable();
        planes.iter().any(|buffer| buffer.plane().is_of_all_rays()).then_some(asked)
    }
}

impl Matte {
    fn new(scene: &Scene, named: Named) -> Matte {
        let names = (1..).zip(scene.names_of(named));
        Matte { named, bits: names.map(|(id, name)| id_bits(&hashed_name(id, name))).collect() }
    }

    /// The bits of the name of what was met; `None` for what has no such name.
    fn bits_of(&self, scene: &Scene, hit: &Hit) -> Option<u32> {
        let geometry = &scene.geometry;
        let surface = geometry.surfaces.get(hit.surface.index());
        let place = match self.named {
            Named::Object => hit.surface.index(),
            Named::Instance => (geometry.spaces[surface?.space as usize].instance as usize).checked_sub(1)?,
            Named::Material => surface?.material.unwrap_or_else(|| geometry.face_material(hit)).index(),
        };
        Some(self.bits[place])
    }
}

impl Shares {
    /// Counts `keys`.
    fn count(&mut self, keys: impl Iterator<Item = (u32, f64)>) {
        self.keys.clear();
        self.keys.extend(keys);
        // Of one key in the order of the rays
        self.keys.sort_by_key(|(key, _)| *key);
        self.counts.clear();
        let same = self.keys.chunk_by(|(a, _), (b, _)| a == b);
        self.counts.extend(same.map(|same| (same[0].0, same.iter().map(|(_, part)| part).sum())));
    }

    /// Those with the greatest counts, as a layer of Cryptomatte has them: bits and share of `all`. Of equal counts the
    /// lower bits are first, so that no order of a scene decides.
    fn ranks(&mut self, all: f32) -> [f32; cryptomatte::NUMBERS] {
        self.counts.sort_unstable_by(|(a, of_a), (b, of_b)| of_b.total_cmp(of_a).then(a.cmp(b)));
        let mut numbers = [0.0; cryptomatte::NUMBERS];
        for ([id, share], (bits, count)) in numbers.as_chunks_mut::<2>().0.iter_mut().zip(&self.counts) {
            (*id, *share) = (f32::from_bits(*bits), *count as f32 / all);
        }
        numbers
    }
}

impl<'a> Coverage<'a> {
    pub fn new(scene: &'a Scene, asked: &'a CoveragePlanes, level: Level) -> Self {
        let hits = PixelHits::new(level, scene.antialiasing);
        let sums = vec![[0.0; 3]; asked.means.len()];
        let (shown, met) = (Vec::new(), Vec::new());
        Coverage { scene, asked, hits, shown, met, stack: LayerStack::default(), shares: Shares::default(), sums }
    }

    /// Fills the planes of a tile. `go_on` is called now and then, and stops it with a break.
    pub fn fill(&mut self, film: &mut FilmTile, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let (scene, n) = (self.scene, self.scene.antialiasing);
        let mut traced = 0;
        for block in film.tile.parts(self.hits.side(), 1) {
            self.hits.trace(scene, block);
            for [i, j] in block.pixels() {
                self.shown.clear();
                self.met.clear();
                let mut past = 0.0;
                for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
                    let hit = self.hits.get([i, j], column, row);
                    let ray = [i * n + column, j * n + row];
                    past += self.meet(ray, hit);
                }
                self.pixel(film, [i, j], past);
            }
            traced += block.width * block.height * n * n;
            if traced >= QUESTION_EVERY {
                traced = 0;
                go_on()?;
            }
        }
        ControlFlow::Continue(())
    }

    /// Fills a pixel of a tile from the hits of its rays.
    fn pixel(&mut self, film: &mut FilmTile, at: [u32; 2], past: f64) {
        let Coverage { scene, asked, met, shares, .. } = self;
        let rays = scene.antialiasing * scene.antialiasing;
        if let Some(plane) = asked.background {
            film.set_pixel(plane, at, &[past as f32 / rays as f32]);
        }
        if !asked.objects.is_empty() {
            shares.count(met.iter().map(|(part, hit)| (hit.surface.0, *part)));
            for (object, count) in &shares.counts {
                if let Ok(object) = asked.objects.binary_search_by_key(object, |(asked, _)| asked.0) {
                    film.set_pixel(asked.objects[object].1, at, &[*count as f32 / rays as f32]);
                }
            }
        }
        for (matte, plane) in &asked.mattes {
            shares.count(met.iter().filter_map(|(part, hit)| Some((matte.bits_of(scene, hit)?, *part))));
            film.set_pixel(*plane, at, &shares.ranks(rays as f32));
        }
        if !asked.means.is_empty() {
            self.means(film, at);
        }
    }

    /// Adds what a ray meets that ends at the opaque thing `end`. Returns the part of it that goes past all.
    fn meet(&mut self, number: [u32; 2], end: Option<Hit>) -> f64 {
        let Coverage { scene, shown, met, stack, .. } = self;
        let mut left = 1.0;
        let mut first = end;
        if scene.has_layers() {
            let (ray, differential) = grid_ray(scene, scene.antialiasing, number[0], number[1]);
            first = scene.shown(&ray, &differential, end);
            scene.find_layers(&ray, &differential, end.as_ref(), stack);
            met.extend(stack.layers.iter().map(|layer| (f64::from(layer.weight), layer.hit)));
            left = f64::from(stack.left);
        }
        shown.extend(first.map(|hit| (number, hit)));
        match end {
            Some(hit) if left > 0.0 => {
                met.push((left, hit));
                0.0
            }
            _ => left,
        }
    }

    /// Fills a pixel of the means: sums in 64 bits, ray by ray.
    fn means(&mut self, film: &mut FilmTile, at: [u32; 2]) {
        let Coverage { scene, asked, shown, sums, .. } = self;
        sums.fill([0.0; 3]);
        for ([i, j], hit) in &*shown {
            let (ray, differential) = grid_ray(scene, scene.antialiasing, *i, *j);
            let there = Center::new(scene, ray, differential, *hit);
            for ((of, _), sum) in asked.means.iter().zip(&mut *sums) {
                let said = floats(there.says(*of));
                *sum = std::array::from_fn(|channel| sum[channel] + f64::from(said[channel]));
            }
        }
        for ((of, plane), sum) in asked.means.iter().zip(sums) {
            let mean = match shown.len() {
                0 => floats(nothing(*of)),
                count => sum.map(|sum| (sum / count as f64) as f32),
            };
            film.set_pixel(*plane, at, &mean);
        }
    }
}

fn floats(value: CenterValue) -> [f32; 3] {
    match value {
        CenterValue::Floats(numbers) => numbers,
        CenterValue::Whole(_) => unreachable!("ids have no mean"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_shares_come_first_and_of_equal_ones_the_lower_bits() {
        let mut shares = Shares::default();
        let bits = |name: &str| id_bits(name);
        let keys = "abcdefghhhaaaaccc".chars().map(|name| (bits(&name.to_string()), 1.0));
        shares.count(keys);
        assert_eq!(shares.counts.iter().map(|(_, count)| count).sum::<f64>(), 17.0);
        let ranks = shares.ranks(32.0);
        let mut equal = ["b", "d", "e", "f", "g"].map(bits);
        equal.sort_unstable();
        let expected = [(bits("a"), 5), (bits("c"), 4), (bits("h"), 3), (equal[0], 1), (equal[1], 1), (equal[2], 1)];
        for (rank, (id, count)) in expected.into_iter().enumerate() {
            assert_eq!((ranks[2 * rank].to_bits(), ranks[2 * rank + 1]), (id, count as f32 / 32.0), "{rank}");
        }
        shares.count(std::iter::once((bits("a"), 1.0)));
        assert_eq!(shares.ranks(1.0)[1..], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
}

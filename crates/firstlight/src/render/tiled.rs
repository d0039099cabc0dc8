//! The renderer that pictures are made with: a tile goes through the same stations together, and each surface in a pixel is
//! shaded once where that is shown to be enough.
//!
//! Camera rays say which surfaces a pixel holds ([`patch`](super::patch)); at each of them every light arrives once
//! ([`arrival`](super::arrival)), with a bound of how much it bends over the patch. Where the bound shows, the light is asked
//! for at every ray.

use std::ops::ControlFlow;

use super::arrival::{Arrival, Arrivals, Place};
use super::film::FilmTile;
use super::hits::PixelHits;
use super::patch::{Patch, PixelPatches};
use super::tile::Tile;
use super::{AaMode, Counts};
use crate::color::Rgb;
use crate::integrate::Sums;
use crate::material::Bsdf;
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;

/// In display steps: how much may bend over a patch that is shaded once.
const BEND: f32 = 0.4;

/// One thread's way from tiles to film.
pub(crate) struct Tiled<'a> {
    scene: &'a Scene,
    mode: AaMode,
    hits: PixelHits,
    arrivals: Arrivals<'a>,
    pixel: PixelPatches,
    /// What arrived of each light at the patch at hand.
    arrived: Vec<Arrival>,
    /// Diffuse and specular of each light, in scene order.
    terms: Vec<[Rgb; 2]>,
}

impl<'a> Tiled<'a> {
    pub fn new(scene: &'a Scene, mode: AaMode, hits: PixelHits, arrivals: Arrivals<'a>) -> Self {
        let lights = scene.lights.len();
        Tiled {
            scene,
            mode,
            hits,
            arrivals,
            pixel: PixelPatches::new(),
            arrived: vec![Arrival::default(); lights],
            terms: vec![[Rgb::BLACK; 2]; lights],
        }
    }

    /// Renders one tile. `go_on` is asked now and then.
    pub fn render(
        &mut self,
        tile: &Tile,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<(), (FilmTile, Counts)> {
        let mut film = FilmTile::new(tile);
        let mut counts = Counts::default();
        let side = self.hits.side();
        for top in (0..tile.height).step_by(side as usize) {
            for left in (0..tile.width).step_by(side as usize) {
                go_on()?;
                let (w, h) = ((tile.width - left).min(side), (tile.height - top).min(side));
                self.hits.trace(self.scene, tile.x + left, tile.y + top, w, h);
                for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
                    let at = [tile.x + left + x, tile.y + top + y];
                    film.set(left + x, top + y, self.pixel(at, [x, y], &mut counts));
                }
            }
        }
        ControlFlow::Continue((film, counts))
    }

    /// The colour of a pixel: red, green, blue premultiplied, alpha. `place` is where it is among the hits that were traced.
    fn pixel(&mut self, at: [u32; 2], place: [u32; 2], counts: &mut Counts) -> [f32; 4] {
        let scene = self.scene;
        let n = scene.antialiasing;
        counts.camera_rays += (n * n) as u64;
        let mut pixel = std::mem::replace(&mut self.pixel, PixelPatches::new());
        let hits = &self.hits;
        pixel.collect(scene, at, self.mode == AaMode::Adaptive, |column, row| hits.get(n, place[0], place[1], column, row));
        self.terms.fill([Rgb::BLACK; 2]);
        let mut ambient = Rgb::BLACK;
        for patch in &pixel.patches {
            ambient += scene.ambient * patch.bsdf.ambient * patch.members.len() as f32;
            self.shade(patch, counts);
        }
        // The sum in its one order
        let rays = (n * n) as f32;
        let mean = |sum: Rgb| Rgb::new(sum.r / rays, sum.g / rays, sum.b / rays);
        let uncovered = pixel.background as f32 / rays;
        let mut color = if scene.transparent { Rgb::BLACK } else { scene.background * uncovered };
        color += mean(pixel.emission);
        color += mean(ambient);
        for [diffuse, specular] in &self.terms {
            color += mean(*diffuse);
            color += mean(*specular);
        }
        let alpha = if scene.transparent { 1.0 - uncovered } else { 1.0 };
        self.pixel = pixel;
        [color.r, color.g, color.b, alpha]
    }

    /// Adds what all lights send to a patch, for all its rays.
    fn shade(&mut self, patch: &Patch, counts: &mut Counts) {
        let scene = self.scene;
        let members = patch.members.len() as f32;
        if patch.members.len() == 1 || patch.uneven {
            for member in &patch.members {
                self.arrivals.look_around(&member.si);
                for index in 0..scene.lights.len() {
                    self.at_ray(index, &member.si, &member.bsdf, counts);
                }
            }
            return;
        }
        // At its middle
        self.arrivals.look_around(&patch.si);
        let base = scene.ambient * patch.bsdf.ambient;
        let mut value = base;
        for index in 0..scene.lights.len() {
            let scale = self.arrivals.scale(index);
            let colors = [scale * patch.bsdf.diffuse, scale * patch.bsdf.specular];
            let place =
                Place { si: &patch.si, lobe: &patch.bsdf.lobe, reach: patch.reach, turn: patch.turn, base, colors };
            let arrival = self.arrivals.arrival(index, &place, counts);
            value += colors[0] * arrival.sums.diffuse + colors[1] * arrival.sums.specular;
            self.arrived[index] = arrival;
        }
        // What bends too much is asked for at every ray, the worst first, until the rest does not show
        let steps = |this: &Self, index: usize| {
            let (scale, Sums { diffuse, specular }) = (this.arrivals.scale(index), this.arrived[index].bend);
            this.arrivals.steps(value, scale * patch.bsdf.diffuse * diffuse + scale * patch.bsdf.specular * specular)
        };
        let allowed = BEND / (scene.lights.len() as f32).sqrt();
        for index in 0..scene.lights.len() {
            if steps(self, index) > allowed {
                for member in &patch.members {
                    self.arrivals.look_around(&member.si);
                    self.at_ray(index, &member.si, &member.bsdf, counts);
                }
            } else {
                let (scale, sums) = (self.arrivals.scale(index) * members, self.arrived[index].sums);
                self.terms[index][0] += scale * patch.bsdf.diffuse * sums.diffuse;
                self.terms[index][1] += scale * patch.bsdf.specular * sums.specular;
            }
        }
    }

    /// Adds what one light sends to where one camera ray ends.
    fn at_ray(&mut self, index: usize, si: &SurfaceInteraction, bsdf: &Bsdf, counts: &mut Counts) {
        let scale = self.arrivals.scale(index);
        let colors = [scale * bsdf.diffuse, scale * bsdf.specular];
        let base = self.scene.ambient * bsdf.ambient;
        let place = Place { si, lobe: &bsdf.lobe, reach: 0.0, turn: 0.0, base, colors };
        let sums = self.arrivals.arrival(index, &place, counts).sums;
        self.terms[index][0] += colors[0] * sums.diffuse;
        self.terms[index][1] += colors[1] * sums.specular;
    }
}

//! The fast renderer's way through a tile: what may stand before a light is gathered once for neighbouring points.
//!
//! The camera rays of a block of pixels first, then light by light: the points of the block that need it are taken
//! together, and a [`Settler`] finds from which of them the light is lit, hidden, below the horizon, or cut. The sums over the
//! samples are those of [`Lanes`](super::lanes::Lanes), in the same order.

use std::ops::ControlFlow;

use fearless_simd::Level;

use super::film::FilmTile;
use super::hits::PixelHits;
use super::lanes::{Obstacles, sum_area};
use super::pixel::{Lighting, LobeSums, PixelSum};
use super::plain::Plain;
use super::tile::Tile;
use super::{Counts, QUESTION_EVERY};
use crate::ids::LightId;
use crate::light::LightKind;
use crate::material::{Bsdf, Lobe};
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{Settler, Target, View, Viewpoint, Visibility};

/// The points of a block of pixels, and what is needed to light them.
pub(crate) struct Shafts<'a> {
    scene: &'a Scene,
    targets: &'a [Target],
    level: Level,
    hits: PixelHits,
    points: Vec<Viewpoint>,
    surfaces: Vec<(SurfaceInteraction, Bsdf)>,
    /// What one light sends to each point.
    sums: Vec<[f32; 2]>,
    /// The points that are being lit, part by part.
    order: Vec<u32>,
    settler: Settler,
}

impl<'a> Shafts<'a> {
    pub fn new(scene: &'a Scene, targets: &'a [Target], level: Level) -> Self {
        Shafts {
            scene,
            targets,
            level,
            hits: PixelHits::new(level, scene.antialiasing),
            points: Vec::new(),
            surfaces: Vec::new(),
            sums: Vec::new(),
            order: Vec::new(),
            settler: Settler::default(),
        }
    }

    /// Renders one tile.
    pub fn render(&mut self, tile: &Tile, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<(), (FilmTile, Counts)> {
        let mut film = FilmTile::new(tile);
        let mut counts = Counts::default();
        let side = self.hits.side();
        let rays = (self.scene.antialiasing * self.scene.antialiasing) as f32;
        let mut pixels: Vec<(PixelSum, usize)> = (0..side * side).map(|_| (PixelSum::new(self.scene), 0)).collect();
        for top in (0..tile.height).step_by(side as usize) {
            for left in (0..tile.width).step_by(side as usize) {
                let (w, h) = ((tile.width - left).min(side), (tile.height - top).min(side));
                let pixels = &mut pixels[..(w * h) as usize];
                let before = counts.work();
                self.block([tile.x + left, tile.y + top], [w, h], pixels, &mut counts, go_on)?;
                // What is settled for all points of the block together is shared
                let work = rays + (counts.work() - before) / pixels.len() as f32;
                for (i, (pixel, _)) in pixels.iter().enumerate() {
                    let (x, y) = (i as u32 % w, i as u32 / w);
                    film.set(left + x, top + y, pixel.color(self.scene));
                    film.spend(left + x, top + y, work);
                }
            }
        }
        ControlFlow::Continue((film, counts))
    }

    /// Renders the pixels from (`i`, `j`), row by row. Each goes with the number of points of those up to it.
    fn block(
        &mut self,
        [i, j]: [u32; 2],
        [w, h]: [u32; 2],
        pixels: &mut [(PixelSum, usize)],
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scene = self.scene;
        let n = scene.antialiasing;
        self.hits.trace(scene, i, j, w, h);
        self.points.clear();
        self.surfaces.clear();
        for (place, (pixel, end)) in pixels.iter_mut().enumerate() {
            let (x, y) = (place as u32 % w, place as u32 / w);
            pixel.clear();
            for row in 0..n {
                for column in 0..n {
                    counts.camera_rays += 1;
                    let (ray, differential, hit) = self.hits.seen(n, x, y, column, row);
                    if let Some((si, bsdf)) = pixel.see(scene, scene.see(ray, *hit, differential)) {
                        self.points.push(Viewpoint::of(&si));
                        self.surfaces.push((si, bsdf));
                    }
                }
            }
            *end = self.surfaces.len();
        }
        for index in 0..scene.lights.len() {
            self.light(index, counts, go_on)?;
            let mut start = 0;
            for (pixel, end) in pixels.iter_mut() {
                for k in start..*end {
                    let (si, bsdf) = &self.surfaces[k];
                    if shines_on(scene, index, si) {
                        pixel.light(scene, index, bsdf, self.sums[k]);
                    }
                }
                start = *end;
            }
        }
        ControlFlow::Continue(())
    }

    /// Finds what one light sends to each point that it shines on.
    fn light(&mut self, index: usize, counts: &mut Counts, go_on: &impl Fn() -> ControlFlow<()>) -> ControlFlow<()> {
        let (scene, level, target) = (self.scene, self.level, &self.targets[index]);
        let light = &scene.lights[index];
        let (surfaces, sums) = (&self.surfaces, &mut self.sums);
        sums.clear();
        sums.resize(surfaces.len(), [0.0; 2]);
        let samples = light.samples() as u64;
        // Those that nothing can shadow
        self.order.clear();
        for (k, (si, bsdf)) in surfaces.iter().enumerate() {
            if !shines_on(scene, index, si) {
                continue;
            }
            if light.shadows && si.receives_shadow {
                self.order.push(k as u32);
            } else {
                counts.shadow_rays += samples;
                counts.shadow_rays_skipped += samples;
                sums[k] = lit(scene, level, index, si, &bsdf.lobe);
            }
        }
        // The others in parts that are not too long for someone who waits
        let at_once = (QUESTION_EVERY / samples).clamp(1, 1 << 20) as usize;
        for part in self.order.chunks_mut(at_once) {
            if counts.shadow_rays >= counts.next_question {
                counts.next_question = counts.shadow_rays + QUESTION_EVERY;
                go_on()?;
            }
            settle(
                &mut self.settler,
                level,
                scene,
                index,
                target,
                &self.points,
                part,
                counts,
                |k, visibility, view| {
                    let (si, bsdf) = &surfaces[k];
                    sums[k] = sent(scene, level, index, si, &bsdf.lobe, visibility, view);
                },
            );
        }
        ControlFlow::Continue(())
    }
}

/// What light `index`, which shines on the surface, sends to one point of it.
#[allow(clippy::too_many_arguments, reason = "a light of a scene and a point of a surface")]
pub(super) fn to_point(
    settler: &mut Settler,
    level: Level,
    scene: &Scene,
    index: usize,
    target: &Target,
    si: &SurfaceInteraction,
    lobe: &Lobe,
    counts: &mut Counts,
) -> [f32; 2] {
    let light = &scene.lights[index];
    if !(light.shadows && si.receives_shadow) {
        counts.shadow_rays += light.samples() as u64;
        counts.shadow_rays_skipped += light.samples() as u64;
        return lit(scene, level, index, si, lobe);
    }
    let mut sums = [0.0; 2];
    settle(settler, level, scene, index, target, &[Viewpoint::of(si)], &mut [0], counts, |_, visibility, view| {
        sums = sent(scene, level, index, si, lobe, visibility, view);
    });
    sums
}

/// Hears what of light `index` is seen from those `points` whose numbers are in `part`, and counts the samples.
#[allow(clippy::too_many_arguments, reason = "a light of a scene and points, as lists")]
fn settle(
    settler: &mut Settler,
    level: Level,
    scene: &Scene,
    index: usize,
    target: &Target,
    points: &[Viewpoint],
    part: &mut [u32],
    counts: &mut Counts,
    each: impl FnMut(usize, Visibility, &View),
) {
    let samples = scene.lights[index].samples() as u64;
    let all = samples * part.len() as u64;
    let settled = &mut counts.settled;
    let before = *settled;
    settler.settle(level, scene, target, points, part, settled, each);
    // Cut by shapes of the lists, which are asked for every sample, or by what is in the trees
    let cut = settled.visibility[Visibility::Mask as usize] - before.visibility[Visibility::Mask as usize];
    let traced = settled.traced - before.traced;
    let asked = if scene.geometry.has_trees() { traced } else { samples * cut };
    counts.shadow_rays += all;
    counts.shadow_rays_skipped += all - asked;
}

/// Whether a surface lets light `index` shine on it.
#[inline(always)]
fn shines_on(scene: &Scene, index: usize, si: &SurfaceInteraction) -> bool {
    let links = scene.geometry.lights_of(si.surface);
    scene.geometry.links.contains(links, LightId(index as u32))
}

fn totals(sums: LobeSums) -> [f32; 2] {
    [sums.diffuse.total(), sums.specular.total()]
}

/// What arrives of light `index`, so much of which is seen.
#[inline(always)]
fn sent(
    scene: &Scene,
    level: Level,
    index: usize,
    si: &SurfaceInteraction,
    lobe: &Lobe,
    visibility: Visibility,
    view: &View,
) -> [f32; 2] {
    match visibility {
        Visibility::Hidden | Visibility::BelowHorizon => [0.0; 2],
        Visibility::Lit => lit(scene, level, index, si, lobe),
        Visibility::Mask => masked(scene, level, index, si, lobe, view),
    }
}

/// What arrives of light `index` where nothing hides any of it.
#[inline(always)]
fn lit(scene: &Scene, level: Level, index: usize, si: &SurfaceInteraction, lobe: &Lobe) -> [f32; 2] {
    totals(match &scene.lights[index].kind {
        LightKind::Area(area) => sum_area(level, area, si, lobe, &Obstacles::default()),
        _ => {
            let unshadowed = SurfaceInteraction { receives_shadow: false, ..*si };
            Plain.gather(scene, index, &unshadowed, lobe, &mut Counts::default())
        }
    })
}

/// What arrives of light `index` past what is in `view`.
#[inline(always)]
fn masked(scene: &Scene, level: Level, index: usize, si: &SurfaceInteraction, lobe: &Lobe, view: &View) -> [f32; 2] {
    totals(match &scene.lights[index].kind {
        LightKind::Area(area) => {
            let View { spheres, flats, disks, hidden, .. } = view;
            let obstacles = Obstacles { spheres, flats, disks, hidden, ..Obstacles::default() };
            sum_area(level, area, si, lobe, &obstacles)
        }
        _ => Plain.gather(scene, index, si, lobe, &mut Counts::default()),
    })
}

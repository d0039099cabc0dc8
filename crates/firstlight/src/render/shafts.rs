//! The fast renderer's way through a tile: what may stand before a light is gathered once for neighbouring points.
//!
//! The camera rays of a block of pixels first, then light by light: the points of the block that need it are taken
//! together, what lies between them and the light is gathered ([`Occluders`]), and from each point the light is lit, hidden,
//! below the horizon, or cut ([`View`]). Where the trees hold too much for all of them, the points are parted where their
//! box is longest, down to single ones; where it is too much for one, the trees are asked ray by ray. The sums over the
//! samples are those of [`Lanes`](super::lanes::Lanes), in the same order.

use std::ops::ControlFlow;

use fearless_simd::Level;

use super::film::FilmTile;
use super::hits::{PixelHits, camera_ray};
use super::lanes::{Obstacles, sum_rectangle};
use super::pixel::{Lighting, LobeSums, PixelSum};
use super::plain::Plain;
use super::tile::Tile;
use super::{Counts, QUESTION_EVERY};
use crate::light::LightKind;
use crate::material::Bsdf;
use crate::scene::Scene;
use crate::shape::SurfaceInteraction;
use crate::visibility::{Occluders, Target, View, Viewpoint, Visibility};

/// Leaves of triangles gathered for many points; more, and the points are parted.
const MANY: usize = 16;
/// For one point: as many as are dearer to look at than rays are to trace, at first and for each block of samples.
const ONE: usize = 24;
const ONE_MORE: usize = 12;

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
    occluders: Occluders,
    view: View,
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
            occluders: Occluders::default(),
            view: View::default(),
        }
    }

    /// Renders one tile.
    pub fn render(
        &mut self,
        tile: &Tile,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<(), (FilmTile, Counts)> {
        let mut film = FilmTile::new(tile);
        let mut counts = Counts::default();
        let side = self.hits.side();
        let mut pixels: Vec<(PixelSum, usize)> =
            (0..side * side).map(|_| (PixelSum::new(self.scene), 0)).collect();
        for top in (0..tile.height).step_by(side as usize) {
            for left in (0..tile.width).step_by(side as usize) {
                let (w, h) = ((tile.width - left).min(side), (tile.height - top).min(side));
                let pixels = &mut pixels[..(w * h) as usize];
                self.block([tile.x + left, tile.y + top], [w, h], pixels, &mut counts, go_on)?;
                for (i, (pixel, _)) in pixels.iter().enumerate() {
                    let (x, y) = (i as u32 % w, i as u32 / w);
                    film.set(left + x, top + y, pixel.color(self.scene));
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
                    let (ray, differential) = camera_ray(scene, (i + x) * n + column, (j + y) * n + row);
                    let hit = self.hits.get(n, x, y, column, row);
                    if let Some((si, bsdf)) = pixel.see(scene, scene.see(&ray, hit, &differential)) {
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
                    pixel.light(scene, index, &self.surfaces[k].1, self.sums[k]);
                }
                start = *end;
            }
        }
        ControlFlow::Continue(())
    }

    /// Finds what one light sends to each point.
    fn light(
        &mut self,
        index: usize,
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.sums.clear();
        self.sums.resize(self.points.len(), [0.0; 2]);
        let light = &self.scene.lights[index];
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        let mut flow = ControlFlow::Continue(());
        for k in 0..self.points.len() {
            let shadowed = light.shadows && self.surfaces[k].0.receives_shadow;
            if shadowed {
                order.push(k as u32);
            } else {
                counts.shadow_rays += light.samples() as u64;
                counts.shadow_rays_skipped += light.samples() as u64;
                self.sum(index, k, Visibility::Lit, counts);
            }
        }
        // A point that casts no light has no side
        if !order.is_empty() {
            flow = self.part(index, &mut order, counts, go_on);
        }
        self.order = order;
        flow
    }

    /// Lights some points: all together, or part by part.
    fn part(
        &mut self,
        index: usize,
        part: &mut [u32],
        counts: &mut Counts,
        go_on: &impl Fn() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (scene, target) = (self.scene, &self.targets[index]);
        if counts.shadow_rays >= counts.next_question {
            counts.next_question = counts.shadow_rays + QUESTION_EVERY;
            go_on()?;
        }
        let cap = if part.len() > 1 { MANY } else { ONE + ONE_MORE * target.blocks.len() };
        self.occluders.gather(self.level, scene, index, &target.hull, &self.points, part, cap);
        counts.shafts += 1;
        if self.occluders.too_many && part.len() > 1 {
            let half = halve(&self.points, part);
            let (left, right) = part.split_at_mut(half);
            self.part(index, left, counts, go_on)?;
            return self.part(index, right, counts, go_on);
        }
        counts.occluders += self.occluders.count() as u64;
        for k in part.iter().map(|k| *k as usize) {
            let samples = target.samples as u64;
            counts.shadow_rays += samples;
            let visibility = self.view.classify(self.level, scene, target, &self.occluders, &self.points[k]);
            if visibility == Visibility::Mask {
                self.view.mask(self.level, scene, target, &self.points[k]);
            } else {
                counts.shadow_rays_skipped += samples;
            }
            counts.visibility[visibility as usize] += 1;
            self.sum(index, k, visibility, counts);
        }
        ControlFlow::Continue(())
    }

    /// Sums what reaches point `k`.
    #[inline(always)]
    fn sum(&mut self, index: usize, k: usize, visibility: Visibility, counts: &mut Counts) {
        let scene = self.scene;
        let (si, bsdf) = &self.surfaces[k];
        let obstacles = match visibility {
            Visibility::Hidden | Visibility::BelowHorizon => return,
            Visibility::Lit => Obstacles::default(),
            Visibility::Mask => Obstacles {
                spheres: &self.view.spheres,
                flats: &self.view.flats,
                trees: None,
                hidden: &self.view.hidden,
            },
        };
        let sums: LobeSums = match &scene.lights[index].kind {
            LightKind::Rectangle(rectangle) => {
                // Without vectors for trees, the trees are asked with the rest
                let trees = (visibility == Visibility::Mask && self.view.trees && self.view.hidden.is_empty())
                    .then_some(&*scene.geometry);
                sum_rectangle(self.level, rectangle, si, &bsdf.lobe, &Obstacles { trees, ..obstacles })
            }
            _ => {
                let mut own = Counts::default();
                let lit = SurfaceInteraction { receives_shadow: visibility == Visibility::Mask, ..*si };
                Plain.gather(scene, index, &lit, &bsdf.lobe, &mut own)
            }
        };
        let _ = counts;
        self.sums[k] = [sums.diffuse.total(), sums.specular.total()];
    }
}

/// Parts points where their box is longest, and says how many are in the first part: at least one in each.
fn halve(points: &[Viewpoint], part: &mut [u32]) -> usize {
    use crate::accel::Aabb;
    let bounds = part.iter().fold(Aabb::EMPTY, |bounds, k| bounds.with(points[*k as usize].start));
    let size = bounds.max - bounds.min;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let middle = bounds.min[axis] + size[axis] * 0.5;
    let mut left = 0;
    for i in 0..part.len() {
        if points[part[i] as usize].start[axis] < middle {
            part.swap(i, left);
            left += 1;
        }
    }
    if left == 0 || left == part.len() { part.len() / 2 } else { left }
}

//! Pixels that provably see one shape whose highlight a texture drives. Data are filtered over the pixel, so they vary
//! little within it: the material at the four corners, which neighbours share, tells whether one shading point with
//! their mean represents the pixel, or one for each quadrant. Other pixels are traced.

use super::{CELL, CellRenderer, FragmentQuery};
use crate::integrate::TOLERANCE;
use crate::material::Bsdf;
use crate::math::Vec3;
use crate::render::Counts;
use crate::render::fragment::ShadingRate;
use crate::render::visible_shape::{MeanBsdf, VisibleShape};
use crate::scene::Scene;

/// Corners of pixels along a side of a cell.
const SIDE: u32 = CELL + 1;

/// A shape at a corner of pixels; of several shapes the one that was looked up last.
#[derive(Clone, Copy)]
struct PixelCorner {
    shape: VisibleShape,
    p: Vec3,
    bsdf: Bsdf,
}

/// The corners of the pixels of a cell that were looked up. Keeps its memory.
#[derive(Default)]
pub(super) struct PixelCorners {
    known: Vec<Option<PixelCorner>>,
}

impl PixelCorners {
    /// Forgets all.
    pub fn begin(&mut self) {
        self.known.clear();
    }

    /// The material of a shape at the corner of pixels `at`, of a cell that begins at `cell`.
    fn look_up(&mut self, scene: &Scene, shape: VisibleShape, at: [u32; 2], cell: [u32; 2]) -> Option<PixelCorner> {
        self.known.resize((SIDE * SIDE) as usize, None);
        let known = &mut self.known[((at[1] - cell[1]) * SIDE + at[0] - cell[0]) as usize];
        if known.is_none_or(|known| known.shape != shape) {
            let step = 1.0 / scene.antialiasing as f32;
            let (ray, differential) = scene.camera.local_ray(at[0] as f32, at[1] as f32, step);
            let t = shape.intersect(scene, &ray)?;
            let si = shape.interaction(scene, &ray, t, &differential);
            *known = Some(PixelCorner { shape, p: si.p, bsdf: scene.bsdf(&si) });
        }
        *known
    }
}

impl CellRenderer<'_> {
    /// Adds the fragment of a pixel that provably sees one shape, without its camera rays, and queues the lights;
    /// `false` if the pixel has to be traced.
    pub(super) fn add_varied(&mut self, at: [u32; 2], shape: VisibleShape, counts: &mut Counts) -> bool {
        let scene = self.scene;
        let material = scene.geometry.surfaces.get(shape.surface(scene).index()).and_then(|surface| surface.material);
        let varies = material.is_some_and(|material| scene.materials[material.index()].varies_by_data());
        if !varies {
            return false;
        }
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]]
            .map(|[x, y]| self.corners.look_up(scene, shape, [at[0] + x, at[1] + y], self.corner));
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { return false };
        let corners = [a, b, c, d];
        let Some(mean) = MeanBsdf::of(corners.iter().map(|corner| corner.bsdf)) else { return false };
        let number = self.pixels.len() as u32;
        let rate = if mean.lobes_differ {
            // Half as wide, quadrants vary half as much
            let is_near = MeanBsdf::spans(corners.map(|corner| corner.bsdf.lobe), 2.0 * TOLERANCE.same_lobe);
            if !(is_near && self.fragments.add_whole_quadrants(scene, number, at, shape, mean)) {
                return false;
            }
            ShadingRate::Quadrant
        } else {
            if !self.fragments.add_whole_center(scene, number, at, shape, mean, corners.map(|corner| corner.p)) {
                return false;
            }
            ShadingRate::Fragment
        };
        let pixel = self.pixel(at, 1, counts);
        self.pixels.push(pixel);
        let fragment = self.fragments.all.len() as u32 - 1;
        let lights = 0..scene.lights.len() as u32;
        self.queues[rate as usize].extend(lights.map(|light| FragmentQuery::new(fragment, light)));
        true
    }
}

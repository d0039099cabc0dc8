//! Patches: the parts of fragments that have one shading point, a whole fragment or one of its rays.

use crate::material::ShadingPoint;
use crate::render::cell::CELL;
use crate::render::fragment::{Fragment, Fragments, is_one_surface};
use crate::render::pooled::salt;
use crate::scene::Scene;

/// A fragment that its middle may represent, or one ray of a fragment without a middle.
#[derive(Clone, Copy)]
pub(super) struct Patch {
    /// Its shading point and footprint; the colours of the material are the mean over its rays.
    pub point: ShadingPoint,
    /// The number of camera rays of its pixel that meet it, and whether all of them do.
    pub count: u32,
    pub is_whole: bool,
    /// Its pixel in the cell, row by row, and which of the cell's fragments it is of.
    pub pixel: u32,
    pub fragment: u32,
}

/// The patches of one cell. Keeps its memory.
#[derive(Default)]
pub(super) struct Patches {
    /// In the order of the cell's fragments: those of a pixel lie together.
    pub all: Vec<Patch>,
    /// Which of them fills each pixel of the cell.
    pub whole: Vec<Option<usize>>,
    /// Columns and rows of the cell that the film has.
    pub size: [u32; 2],
}

impl Patches {
    /// Those of all fragments of a cell, of which `size` columns and rows are on the film. `pixel` returns the pixel of
    /// a fragment in the cell.
    pub fn begin(&mut self, scene: &Scene, fragments: &Fragments, size: [u32; 2], pixel: impl Fn(usize) -> u32) {
        self.all.clear();
        self.whole.clear();
        self.whole.resize((CELL * CELL) as usize, None);
        self.size = size;
        for fragment in 0..fragments.all.len() {
            for patch in Patch::of(scene, fragments, fragment, pixel(fragment)) {
                if patch.is_whole {
                    self.whole[patch.pixel as usize] = Some(self.all.len());
                }
                self.all.push(patch);
            }
        }
    }
}

impl Patch {
    fn new(point: ShadingPoint) -> Patch {
        let point = ShadingPoint { share: 1.0, most_motion: f32::INFINITY, closed_form_budget: f32::INFINITY, ..point };
        Patch { point, count: 1, is_whole: false, pixel: 0, fragment: 0 }
    }

    /// Those of a fragment, which is in such a pixel of the cell.
    pub fn of<'f>(
        scene: &'f Scene,
        fragments: &'f Fragments,
        fragment: usize,
        pixel: u32,
    ) -> impl Iterator<Item = Patch> + 'f {
        let Fragment { center, rays, count, .. } = &fragments.all[fragment];
        let is_whole = *count == scene.antialiasing * scene.antialiasing;
        let center = fragments.points[center.clone()].iter();
        let center = center.map(move |point| Patch { count: *count, is_whole, ..Patch::new(*point) });
        let alone = if center.len() > 0 { 0..0 } else { rays.clone() };
        let each = fragments.rays[alone].iter().map(|point| Patch::new(*point));
        center.chain(each).map(move |patch| Patch { pixel, fragment: fragment as u32, ..patch })
    }

    /// Where it is in the cell: column and row.
    pub fn at(&self) -> [u32; 2] {
        [self.pixel % CELL, self.pixel / CELL]
    }

    /// The seed of its samples.
    pub fn salt(&self) -> u64 {
        salt(self.at(), self.point.surface)
    }

    /// Which quarter of a block twice as wide as `half` it is in.
    pub fn quarter(&self, half: u32) -> u32 {
        let [x, y] = self.at().map(|at| at / half % 2);
        y * 2 + x
    }

    /// Whether another patch is of the same surface.
    pub fn holds(&self, other: &Patch) -> bool {
        is_one_surface(&self.point, &other.point)
    }

    /// Calls `each` with the shading point of every ray of it.
    pub fn for_each(&self, fragments: &Fragments, mut each: impl FnMut(ShadingPoint)) {
        if self.point.reach == 0.0 && self.count == 1 {
            return each(self.point);
        }
        let rays = fragments.all[self.fragment as usize].rays.clone();
        fragments.rays[rays].iter().for_each(|point| each(*point));
    }
}

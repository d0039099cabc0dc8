//! The film: pixels in planes of one size, one for each buffer that a render is to fill; and what is made of films.
//!
//! Before it stands the scene; after it, the renderer, which adds light. Planes that no light is needed for are filled
//! here: by [`centers`] from centre rays, by [`coverage`] from all camera rays.

pub(crate) mod catchers;
pub(crate) mod centers;
mod coco;
pub(crate) mod coverage;
mod heat;
pub(crate) mod hits;
mod masks;
mod motion;
pub(crate) mod passes;
mod receipt;
mod receipt_settings;
mod relight;
pub(crate) mod resolve;
pub(crate) mod settings;
pub(crate) mod tile;

use std::ops::Range;
use std::sync::Arc;

pub use coco::Coco;
pub use heat::Heat;
pub use masks::{Mask, ObjectMasks};
pub use receipt_settings::{ReceiptFault, ReceiptSettings};
pub use relight::{LightChange, RelightError, Relit, relight};
pub use settings::{AaMode, RenderSettings, VisibilityMode};

use crate::image::{
    Buffer, FileSettings, Format, Image, ImageError, NamedPlane, Plane, PlaneFile, PlaneNumbers, PlaneVec, Receipt,
    Window,
};
use crate::scene::Scene;
use catchers::ChosenPixels;
use resolve::TermSums;
use tile::Tile;

/// The pixels of a picture, in the planes that were rendered.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    window: Window,
    /// Each with its name in files.
    planes: Vec<(String, Buffer, PlaneVec)>,
}

/// The pixels of one tile.
pub(crate) struct FilmTile {
    pub tile: Tile,
    /// Those of its pixels that are asked for; `None`: all.
    pub chosen: Option<Arc<ChosenPixels>>,
    planes: Vec<(Buffer, PlaneVec)>,
}

/// The value of a plane at a pixel's centre ray.
pub(super) enum CenterValue {
    Floats([f32; 3]),
    Whole(u32),
}

fn empty(planes: &[Buffer], window: Window) -> Vec<(Buffer, PlaneVec)> {
    let pixels = window.width as usize * window.height as usize;
    let numbers = |plane: Plane| match plane.is_whole() {
        true => PlaneVec::Wholes(vec![0; pixels]),
        false => PlaneVec::Floats(vec![0.0; pixels * plane.channels().len()]),
    };
    planes.iter().map(|buffer| (*buffer, numbers(buffer.plane()))).collect()
}

/// Copies rows of `length` numbers to those that begin at `starts`.
fn copy_rows<T: Copy>(to: &mut [T], starts: impl Iterator<Item = usize>, from: &[T], length: usize) {
    for (start, row) in starts.zip(from.chunks_exact(length)) {
        to[start..][..length].copy_from_slice(row);
    }
}

impl Film {
    /// The film of a scene, of which `window` is exposed.
    pub(crate) fn new(scene: &Scene, window: Window, planes: &[Buffer]) -> Self {
        let planes = empty(planes, window).into_iter();
        let planes = planes.map(|(buffer, numbers)| (scene.buffer_name(buffer), buffer, numbers)).collect();
        Film { size: [scene.width, scene.height], window, planes }
    }

    /// Adds a plane of floats, or replaces it.
    pub(crate) fn put(&mut self, scene: &Scene, buffer: Buffer, numbers: Vec<f32>) {
        self.planes.retain(|(_, known, _)| *known != buffer);
        self.planes.push((scene.buffer_name(buffer), buffer, PlaneVec::Floats(numbers)));
    }

    /// Removes all planes but these, and puts them into this order.
    pub(crate) fn keep(&mut self, buffers: &[Buffer]) {
        let place = |of: Buffer| buffers.iter().position(|buffer| *buffer == of);
        self.planes.retain(|(_, buffer, _)| place(*buffer).is_some());
        self.planes.sort_by_key(|(_, buffer, _)| place(*buffer));
    }

    /// Copies the pixels of a tile.
    pub(crate) fn merge(&mut self, from: &FilmTile) {
        let Tile { x, y, width, height } = from.tile;
        let (left, top) = (x - self.window.x, y - self.window.y);
        let first = |row: u32| (top + row) as usize * self.window.width as usize + left as usize;
        for ((_, buffer, to), (_, from)) in self.planes.iter_mut().zip(&from.planes) {
            let channels = buffer.plane().channels().len();
            let (starts, length) = ((0..height).map(|row| first(row) * channels), width as usize * channels);
            match (to, from) {
                (PlaneVec::Floats(to), PlaneVec::Floats(from)) => copy_rows(to, starts, from, length),
                (PlaneVec::Wholes(to), PlaneVec::Wholes(from)) => copy_rows(to, starts, from, length),
                _ => unreachable!("a tile has the planes of its film"),
            }
        }
    }

    /// The width and height of the whole film.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The part of it that was rendered, which its planes hold.
    pub fn window(&self) -> Window {
        self.window
    }

    /// The buffers that it holds: [`RenderSettings::buffers`](super::RenderSettings::buffers), in their order.
    pub fn planes(&self) -> impl Iterator<Item = Buffer> {
        self.planes.iter().map(|(_, buffer, _)| *buffer)
    }

    /// The values of a plane; `None` if it was not rendered.
    pub fn numbers(&self, of: impl Into<Buffer>) -> Option<PlaneNumbers<'_>> {
        let of = of.into();
        self.planes.iter().find(|(_, buffer, _)| *buffer == of).map(|(.., numbers)| numbers.numbers())
    }

    /// The numbers of a plane of floats.
    fn floats(&self, of: Buffer) -> Option<&[f32]> {
        match self.numbers(of)? {
            PlaneNumbers::Floats(numbers) => Some(numbers),
            PlaneNumbers::Wholes(_) => None,
        }
    }

    /// Moves out the values of all planes, each with its name, in their order.
    pub fn into_planes(self) -> impl Iterator<Item = (String, Buffer, PlaneVec)> {
        self.planes.into_iter()
    }

    /// The work for each pixel; `None` if [`Plane::Rays`] was not rendered.
    pub fn heat(&self) -> Option<Heat> {
        let work = self.floats(Plane::Rays.into())?.to_vec();
        Some(Heat { film: self.size, window: self.window, work })
    }

    /// The bytes of a file that holds some of its planes: EXR and NPZ any, the others one. The same film, settings and
    /// receipt always give the same bytes. The receipt in it has the description of each plane and the hash of its
    /// bits.
    ///
    /// # Errors
    /// A format that cannot hold several buffers, or not the values of this one; a plane that was not rendered;
    /// settings or a receipt outside their ranges.
    pub fn encode(
        &self,
        planes: &[Buffer],
        format: Format,
        settings: &FileSettings,
        receipt: &Receipt,
    ) -> Result<Vec<u8>, ImageError> {
        let named = |of: &Buffer| match self.planes.iter().find(|(_, buffer, _)| buffer == of) {
            Some((name, _, numbers)) => Ok(NamedPlane { name, plane: of.plane(), numbers: numbers.numbers() }),
            None => Err(ImageError::Picture(format!("the film has no plane for {of:?}: it was not asked for"))),
        };
        let planes = planes.iter().map(named).collect::<Result<Vec<_>, _>>()?;
        PlaneFile { film: self.size, window: self.window, planes: &planes }.encode(format, settings, receipt)
    }

    /// The picture.
    ///
    /// # Panics
    /// If [`Plane::Color`] was not rendered.
    pub fn develop(self) -> Image {
        let numbers = self.floats(Plane::Color.into()).expect("the film has the picture");
        Image { film: self.size, window: self.window, pixels: numbers.as_chunks().0.to_vec() }
    }
}

impl FilmTile {
    /// An empty tile with the same planes.
    pub fn new(tile: Tile, planes: &[Buffer], chosen: Option<Arc<ChosenPixels>>) -> Self {
        FilmTile { tile, chosen, planes: empty(planes, tile) }
    }

    /// Whether a pixel of the film is asked for.
    #[inline(always)]
    pub fn asks(&self, at: [u32; 2]) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| chosen.has(at))
    }

    /// Whether any of its pixels is.
    pub fn asks_any(&self) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| chosen.has_any(self.tile.pixels()))
    }

    /// The index of a pixel of the film in the planes of the tile.
    #[inline(always)]
    fn index(&self, [x, y]: [u32; 2]) -> usize {
        ((y - self.tile.y) * self.tile.width + (x - self.tile.x)) as usize
    }

    /// Stores a row of pixels of the film, from pixel `first` on: those in `some` of `sums`.
    #[inline(always)]
    pub fn set_row(&mut self, first: [u32; 2], sums: &TermSums, some: Range<usize>) {
        let here = self.index(first);
        let mut kept = sums.kept();
        for (buffer, numbers) in &mut self.planes {
            let PlaneVec::Floats(numbers) = numbers else { continue };
            let mut set = |channels: usize, pixels: &[f32]| {
                numbers[here * channels..][..pixels.len()].copy_from_slice(pixels);
            };
            match buffer.plane() {
                Plane::Color => set(4, sums.colors[some.clone()].as_flattened()),
                Plane::Alpha => {
                    let colors = &sums.colors[some.clone()];
                    numbers[here..].iter_mut().zip(colors).for_each(|(to, from)| *to = from[3]);
                }
                Plane::Rays => set(1, &sums.work[some.clone()]),
                _ if buffer.is_of_terms() => {
                    let kept = kept.next().expect("each of those buffers has its sums");
                    set(3, kept[some.clone()].as_flattened());
                }
                _ => {}
            }
        }
    }

    /// The planes of the tile.
    pub fn planes(&self) -> Vec<Buffer> {
        self.planes.iter().map(|(buffer, _)| *buffer).collect()
    }

    /// Stores the value of plane number `plane` at a pixel of the film.
    #[inline(always)]
    pub(super) fn set_center(&mut self, plane: usize, pixel: [u32; 2], said: CenterValue) {
        let index = self.index(pixel);
        match (said, &mut self.planes[plane].1) {
            (CenterValue::Floats(numbers), _) => self.set_pixel(plane, pixel, &numbers),
            (CenterValue::Whole(number), PlaneVec::Wholes(numbers)) => numbers[index] = number,
            _ => unreachable!("each plane has its numbers"),
        }
    }

    /// Stores the channels of plane number `plane` at a pixel of the film: the first of `numbers`.
    pub(super) fn set_pixel(&mut self, plane: usize, pixel: [u32; 2], numbers: &[f32]) {
        let index = self.index(pixel);
        let (buffer, PlaneVec::Floats(all)) = &mut self.planes[plane] else { unreachable!("it has floats") };
        let channels = buffer.plane().channels().len();
        all[index * channels..][..channels].copy_from_slice(&numbers[..channels]);
    }
}

//! The film: pixels in planes of one size, one for each buffer that a render is to fill; and what is made of films.
//!
//! Before it stands the scene; after it, the renderer, which adds light. Planes that no light is needed for are filled
//! here: by [`centers`] from centre rays, by [`coverage`] from all camera rays.

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

pub use coco::Coco;
pub use heat::Heat;
pub use masks::{Mask, ObjectMasks};
pub use receipt_settings::{ReceiptFault, ReceiptSettings};
pub use relight::{LightChange, RelightError, Relit, relight};
pub use settings::{AaMode, RenderSettings, VisibilityMode};

use crate::image::cryptomatte;
use crate::image::{
    Buffer, FileSettings, Format, Image, ImageError, NamedPlane, Plane, PlaneFile, PlaneNumbers, PlaneVec, Receipt,
    Window,
};
use crate::scene::Scene;
use resolve::TermSums;
use tile::Tile;

/// The values of a plane, pixel by pixel.
#[derive(Clone, Debug)]
enum Values {
    One(Vec<f32>),
    Two(Vec<[f32; 2]>),
    Three(Vec<[f32; 3]>),
    Four(Vec<[f32; 4]>),
    Twelve(Vec<[f32; cryptomatte::NUMBERS]>),
    Whole(Vec<u32>),
}

impl Values {
    fn new(plane: Plane, pixels: usize) -> Values {
        match plane.channels().len() {
            1 if plane.is_whole() => Values::Whole(vec![0; pixels]),
            1 => Values::One(vec![0.0; pixels]),
            2 => Values::Two(vec![[0.0; 2]; pixels]),
            3 => Values::Three(vec![[0.0; 3]; pixels]),
            cryptomatte::NUMBERS => Values::Twelve(vec![[0.0; cryptomatte::NUMBERS]; pixels]),
            _ => Values::Four(vec![[0.0; 4]; pixels]),
        }
    }

    /// Copies `length` pixels of `from`, from index `first` on, to index `at`.
    fn take(&mut self, at: usize, from: &Values, first: usize, length: usize) {
        fn copy<T: Copy>(to: &mut [T], at: usize, from: &[T], first: usize, length: usize) {
            to[at..at + length].copy_from_slice(&from[first..first + length]);
        }
        match (self, from) {
            (Values::One(to), Values::One(from)) => copy(to, at, from, first, length),
            (Values::Two(to), Values::Two(from)) => copy(to, at, from, first, length),
            (Values::Three(to), Values::Three(from)) => copy(to, at, from, first, length),
            (Values::Four(to), Values::Four(from)) => copy(to, at, from, first, length),
            (Values::Twelve(to), Values::Twelve(from)) => copy(to, at, from, first, length),
            (Values::Whole(to), Values::Whole(from)) => copy(to, at, from, first, length),
            _ => unreachable!("a tile has the planes of its film"),
        }
    }

    fn into_numbers(self) -> PlaneVec {
        match self {
            Values::One(numbers) => PlaneVec::Floats(numbers),
            Values::Two(numbers) => PlaneVec::Floats(numbers.into_flattened()),
            Values::Three(numbers) => PlaneVec::Floats(numbers.into_flattened()),
            Values::Four(numbers) => PlaneVec::Floats(numbers.into_flattened()),
            Values::Twelve(numbers) => PlaneVec::Floats(numbers.into_flattened()),
            Values::Whole(numbers) => PlaneVec::Wholes(numbers),
        }
    }

    fn numbers(&self) -> PlaneNumbers<'_> {
        match self {
            Values::One(numbers) => PlaneNumbers::Floats(numbers),
            Values::Two(numbers) => PlaneNumbers::Floats(numbers.as_flattened()),
            Values::Three(numbers) => PlaneNumbers::Floats(numbers.as_flattened()),
            Values::Four(numbers) => PlaneNumbers::Floats(numbers.as_flattened()),
            Values::Twelve(numbers) => PlaneNumbers::Floats(numbers.as_flattened()),
            Values::Whole(numbers) => PlaneNumbers::Wholes(numbers),
        }
    }
}

/// The pixels of a picture, in the planes that were rendered.
#[derive(Clone, Debug)]
pub struct Film {
    size: [u32; 2],
    window: Window,
    planes: Vec<(Buffer, Values)>,
    /// The name of each plane in files.
    names: Vec<String>,
}

/// The pixels of one tile.
pub(crate) struct FilmTile {
    pub tile: Tile,
    planes: Vec<(Buffer, Values)>,
}

/// The value of a plane at a pixel's centre ray.
pub(super) enum CenterValue {
    Floats([f32; 3]),
    Whole(u32),
}

fn empty(planes: &[Buffer], pixels: usize) -> Vec<(Buffer, Values)> {
    planes.iter().map(|buffer| (*buffer, Values::new(buffer.plane(), pixels))).collect()
}

impl Film {
    /// The film of a scene, of which `window` is exposed.
    pub(crate) fn new(scene: &Scene, window: Window, planes: &[Buffer]) -> Self {
        let pixels = window.width as usize * window.height as usize;
        let names = planes.iter().map(|buffer| scene.buffer_name(*buffer)).collect();
        Film { size: [scene.width, scene.height], window, planes: empty(planes, pixels), names }
    }

    /// Adds a plane of floats, or replaces it.
    pub(crate) fn put(&mut self, scene: &Scene, buffer: Buffer, numbers: &[f32]) {
        let values = match buffer.plane().channels().len() {
            1 => Values::One(numbers.to_vec()),
            _ => Values::Three(numbers.as_chunks().0.to_vec()),
        };
        match self.planes.iter_mut().find(|(known, _)| *known == buffer) {
            Some((_, known)) => *known = values,
            None => {
                self.planes.push((buffer, values));
                self.names.push(scene.buffer_name(buffer));
            }
        }
    }

    /// Removes all planes but these, and puts them into this order.
    pub(crate) fn keep(&mut self, buffers: &[Buffer]) {
        let place = |of: Buffer| buffers.iter().position(|buffer| *buffer == of);
        let planes = std::mem::take(&mut self.planes).into_iter().zip(std::mem::take(&mut self.names));
        let mut kept: Vec<_> = planes.filter_map(|plane| Some((place(plane.0.0)?, plane))).collect();
        kept.sort_by_key(|(place, _)| *place);
        (self.planes, self.names) = kept.into_iter().map(|(_, plane)| plane).unzip();
    }

    /// Copies the pixels of a tile.
    pub(crate) fn merge(&mut self, from: &FilmTile) {
        let Tile { x, y, width, height } = from.tile;
        let (left, top) = ((x - self.window.x) as usize, (y - self.window.y) as usize);
        for ((_, to), (_, from)) in self.planes.iter_mut().zip(&from.planes) {
            for row in 0..height as usize {
                let at = (top + row) * self.window.width as usize + left;
                to.take(at, from, row * width as usize, width as usize);
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
        self.planes.iter().map(|(buffer, _)| *buffer)
    }

    /// The values of a plane; `None` if it was not rendered.
    pub fn numbers(&self, of: impl Into<Buffer>) -> Option<PlaneNumbers<'_>> {
        let of = of.into();
        self.planes.iter().find(|(buffer, _)| *buffer == of).map(|(_, values)| values.numbers())
    }

    /// Moves out the values of all planes, each with its name, in their order.
    pub fn into_planes(self) -> impl Iterator<Item = (String, Buffer, PlaneVec)> {
        let planes = self.names.into_iter().zip(self.planes);
        planes.map(|(name, (buffer, values))| (name, buffer, values.into_numbers()))
    }

    /// The work for each pixel; `None` if [`Plane::Rays`] was not rendered.
    pub fn heat(&self) -> Option<Heat> {
        let PlaneNumbers::Floats(work) = self.numbers(Plane::Rays)? else { return None };
        Some(Heat { film: self.size, window: self.window, work: work.to_vec() })
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
        let named = |of: &Buffer| match self.planes.iter().position(|(buffer, _)| buffer == of) {
            Some(k) => Ok(NamedPlane { name: &self.names[k], plane: of.plane(), numbers: self.planes[k].1.numbers() }),
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
        let pixels = self.planes.into_iter().find_map(|(plane, values)| match (plane, values) {
            (Buffer::Plane(Plane::Color), Values::Four(pixels)) => Some(pixels),
            _ => None,
        });
        Image { film: self.size, window: self.window, pixels: pixels.expect("the film has the picture") }
    }
}

impl FilmTile {
    /// An empty tile with the same planes.
    pub fn new(tile: &Tile, planes: &[Buffer]) -> Self {
        let pixels = tile.width as usize * tile.height as usize;
        FilmTile { tile: *tile, planes: empty(planes, pixels) }
    }

    /// Stores a row of pixels, from column `x`, row `y` of the tile on: those in `some` of `sums`.
    #[inline(always)]
    pub fn set_row(&mut self, x: u32, y: u32, sums: &TermSums, some: Range<usize>) {
        let index = (y * self.tile.width + x) as usize;
        let here = index..index + some.len();
        let mut kept = sums.kept();
        for (buffer, values) in &mut self.planes {
            match (buffer.plane(), values) {
                (Plane::Color, Values::Four(pixels)) => {
                    pixels[here.clone()].copy_from_slice(&sums.colors[some.clone()])
                }
                (Plane::Alpha, Values::One(pixels)) => {
                    let colors = &sums.colors[some.clone()];
                    pixels[here.clone()].iter_mut().zip(colors).for_each(|(to, from)| *to = from[3]);
                }
                (Plane::Rays, Values::One(pixels)) => pixels[here.clone()].copy_from_slice(&sums.work[some.clone()]),
                (_, Values::Three(pixels)) if buffer.is_of_terms() => {
                    let kept = kept.next().expect("each of those buffers has its sums");
                    pixels[here.clone()].copy_from_slice(&kept[some.clone()]);
                }
                _ => {}
            }
        }
    }

    /// The planes of the tile.
    pub fn planes(&self) -> Vec<Buffer> {
        self.planes.iter().map(|(buffer, _)| *buffer).collect()
    }

    /// Stores the value of plane number `plane` at the centre ray of a pixel of the tile.
    #[inline(always)]
    pub(super) fn set_center(&mut self, plane: usize, [x, y]: [u32; 2], said: CenterValue) {
        let index = (y * self.tile.width + x) as usize;
        match (said, &mut self.planes[plane].1) {
            (CenterValue::Floats([a, ..]), Values::One(pixels)) => pixels[index] = a,
            (CenterValue::Floats([a, b, _]), Values::Two(pixels)) => pixels[index] = [a, b],
            (CenterValue::Floats(all), Values::Three(pixels)) => pixels[index] = all,
            (CenterValue::Whole(number), Values::Whole(pixels)) => pixels[index] = number,
            _ => unreachable!("each plane has its numbers"),
        }
    }

    /// Stores the channels of plane number `plane` at a pixel.
    pub(super) fn set_pixel(&mut self, plane: usize, x: u32, y: u32, numbers: &[f32]) {
        let index = (y * self.tile.width + x) as usize;
        let all = match &mut self.planes[plane].1 {
            Values::One(pixels) => &mut pixels[..],
            Values::Two(pixels) => pixels.as_flattened_mut(),
            Values::Three(pixels) => pixels.as_flattened_mut(),
            Values::Four(pixels) => pixels.as_flattened_mut(),
            Values::Twelve(pixels) => pixels.as_flattened_mut(),
            Values::Whole(_) => unreachable!("a mean is no whole number"),
        };
        all[index * numbers.len()..][..numbers.len()].copy_from_slice(numbers);
    }
}

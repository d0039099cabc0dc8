//! A buffer as a picture to look at: false colours with a legend, so that a person sees what the numbers are.
//!
//! - depth, distance, other single numbers: a colour map, with a legend that has numbers and the unit. Distances over
//!   more than a decade and a half are on a logarithmic scale;
//! - ids: each a colour of its own, the same in every file;
//! - directions: (x, y, z) / 2 + 1/2;
//! - motion: the colour wheel of Baker et al., with the wheel and its radius as the legend;
//! - positions: red, green and blue go over the range of x, y and z;
//! - colours: developed.
//!
//! What is nothing is gray beside a colour map, and black elsewhere. The picture is larger by a whole number where it
//! would be too small for a legend.

mod colors;
mod legend;
mod scale;

use super::png::{ColorType, Depth, PngSamples};
use super::quantized::NumberKind;
use super::{BufferDesc, ImageError, Plane, PlaneNumbers, Receipt, SOFTWARE, Window};
use crate::color::{Display, Encoding};
use colors::{flow, of_id};
use legend::Canvas;
use scale::Scale;

/// An sRGB colour of 8 bits.
type Rgb8 = [u8; 3];

/// A buffer to look at.
#[derive(Clone, Copy, Debug)]
pub struct BufferView<'a> {
    /// Its name, which says what its numbers are if it is a known one; else its channels do.
    pub name: &'a str,
    /// The names of its channels.
    pub channels: &'a [String],
    /// Rows from the top, each from the left, the channels of a pixel side by side.
    pub numbers: PlaneNumbers<'a>,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// The numbers at the ends of the colour map, of motion 0 and the radius of the wheel; found from the numbers if
    /// `None`. Colours, ids and directions have none.
    pub range: Option<[f64; 2]>,
    /// How colours are shown; of what is none, with an exposure of 0.
    pub display: Display,
}

/// How a buffer is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Look {
    Color,
    Direction,
    Id,
    Position,
    Flow,
    /// One number, with its unit.
    Number(&'static str),
}

/// What shows nothing beside a colour map, which has no gray.
const NOTHING: Rgb8 = [205; 3];
/// Smaller pictures are made larger.
const SMALL: u32 = 240;

/// The number at a place, whichever kind it is.
fn number(numbers: PlaneNumbers, at: usize) -> f64 {
    match numbers {
        PlaneNumbers::Floats(floats) => f64::from(floats[at]),
        PlaneNumbers::Wholes(wholes) => f64::from(wholes[at]),
    }
}

impl BufferView<'_> {
    /// The bytes of a PNG file. `receipt` is that of the file that the numbers are from.
    ///
    /// # Errors
    /// The numbers do not fill the picture; the channels are none that can be looked at; the range or the display is
    /// none.
    pub fn encode(&self, receipt: &Receipt) -> Result<Vec<u8>, ImageError> {
        self.check()?;
        let (picture, legend) = self.picture();
        let [width, height] = self.size;
        let larger = SMALL.div_ceil(width.max(height)).max(1);
        let canvas = Canvas::enlarged(&picture, self.size, larger).with_legend(legend.as_ref());
        let window = Window { x: 0, y: 0, width: canvas.width, height: canvas.height };
        let mut said = Receipt::default();
        let kept = |key: &&str| receipt.entries.iter().find(|(known, _)| known == key).cloned();
        said.entries.extend(["version", "scene_hash"].iter().filter_map(kept));
        said.entries.push(("view".to_owned(), format!("{} of {SOFTWARE}", self.name)));
        let bytes = canvas.pixels.into_flattened();
        PngSamples { window, depth: Depth::Eight, color: ColorType::Rgb, encoding: Some(Encoding::Srgb), bytes }
            .encode(&said)
    }

    fn check(&self) -> Result<(), ImageError> {
        let fault = |words: String| Err(ImageError::Picture(format!("{}: {words}", self.name)));
        let count = match self.numbers {
            PlaneNumbers::Floats(numbers) => numbers.len(),
            PlaneNumbers::Wholes(numbers) => numbers.len(),
        };
        let [width, height] = self.size;
        let channels = self.channels.len();
        if channels == 0 || count == 0 || count as u64 != u64::from(width) * u64::from(height) * channels as u64 {
            return fault(format!("{count} numbers do not fill {width} x {height} pixels of {channels} channels"));
        }
        if let Some([low, high]) = self.range
            && !(low.is_finite() && high.is_finite() && low < high)
        {
            return fault(format!("the range is {low} to {high}; two numbers are needed, the lower one first"));
        }
        let what = match self.look() {
            Look::Color if self.range.is_some() => Some("is a colour, and has no range; an exposure shows it brighter"),
            Look::Id | Look::Direction if self.range.is_some() => {
                Some("has no range: each colour is a number of its own")
            }
            Look::Flow if self.range.is_some_and(|[low, _]| low != 0.0) => {
                Some("is motion, whose range is 0 to the length at the rim of the wheel")
            }
            Look::Color => None,
            _ if self.display.exposure != 0.0 => Some("is no colour, and has no exposure; a range sets the ends"),
            _ => None,
        };
        if let Some(what) = what {
            return Err(ImageError::Picture(format!("{} {what}", self.name)));
        }
        match self.display.fault() {
            Some(words) => Err(ImageError::Display(words)),
            None => Ok(()),
        }
    }

    /// How it is looked at: by its name, else by its channels.
    fn look(&self) -> Look {
        let plane = BufferDesc::parse(self.name).ok().and_then(|desc| desc.plane());
        let plane = plane.filter(|plane| plane.channels().len() <= self.channels.len());
        let of_plane = plane.and_then(|plane| match NumberKind::of(plane) {
            _ if plane.is_of_motion() => Some(Look::Flow),
            NumberKind::Color => Some(Look::Color),
            NumberKind::Share => Some(Look::Number("")),
            NumberKind::Distance => Some(Look::Number("m")),
            NumberKind::Id => Some(Look::Id),
            NumberKind::Direction => Some(Look::Direction),
            NumberKind::Other if plane.channels().len() >= 3 => Some(Look::Position),
            NumberKind::Other if plane.channels().len() == 1 => {
                Some(Look::Number(if plane == Plane::Rays { "rays" } else { "" }))
            }
            NumberKind::Other => None,
        });
        of_plane.unwrap_or_else(|| {
            let has = |wanted: &[&str]| wanted.iter().all(|name| self.channels.iter().any(|channel| channel == name));
            match self.numbers {
                PlaneNumbers::Wholes(_) if self.channels.len() == 1 => Look::Id,
                _ if has(&["R", "G", "B"]) => Look::Color,
                _ if has(&["X", "Y", "Z"]) && self.name.contains("normal") => Look::Direction,
                _ if self.channels.len() == 1 => Look::Number(if has(&["Z"]) { "m" } else { "" }),
                _ => Look::Position,
            }
        })
    }

    /// Where a channel is, by its name or else its number.
    fn channel(&self, name: &str, number: usize) -> usize {
        self.channels.iter().position(|channel| channel == name).unwrap_or(number.min(self.channels.len() - 1))
    }

    /// The colours of all pixels, and the legend.
    fn picture(&self) -> (Vec<Rgb8>, Option<legend::Legend>) {
        let all = self.channels.len();
        let pixels = self.size[0] as usize * self.size[1] as usize;
        let at = |pixel: usize, channel: usize| number(self.numbers, pixel * all + channel);
        let axes = |names: [&str; 3]| [0, 1, 2].map(|k| self.channel(names[k], k));
        let each = |color: &dyn Fn(usize) -> Rgb8| (0..pixels).map(color).collect::<Vec<Rgb8>>();
        match self.look() {
            Look::Id => (each(&|pixel| of_id(at(pixel, 0) as u32)), None),
            Look::Color => {
                let channels = axes(["R", "G", "B"]);
                let color = |pixel: usize| {
                    let linear = channels.map(|channel| at(pixel, channel) as f32);
                    self.display.encode_color(linear).map(|encoded| (encoded * 255.0).round() as u8)
                };
                (each(&color), None)
            }
            Look::Direction => {
                let channels = axes(["X", "Y", "Z"]);
                let color = |pixel: usize| {
                    let v = channels.map(|channel| at(pixel, channel));
                    if v == [0.0; 3] { [0; 3] } else { v.map(|axis| unit_code(axis * 0.5 + 0.5)) }
                };
                (each(&color), None)
            }
            Look::Position => {
                // Of two channels there is no blue
                let channels: Vec<usize> = (0..all.min(3)).collect();
                let scales: Vec<Scale> = channels
                    .iter()
                    .map(|c| Scale::linear(self.range, (0..pixels).map(|pixel| at(pixel, *c))))
                    .collect();
                let color = |pixel: usize| {
                    let mut color = [0; 3];
                    for (channel, scale) in channels.iter().zip(&scales) {
                        color[*channel] = scale.place(at(pixel, *channel)).map_or(0, unit_code);
                    }
                    color
                };
                (each(&color), None)
            }
            Look::Flow => {
                let [x, y, _] = axes(["X", "Y", "Z"]);
                let seen = self.channels.iter().position(|channel| channel == "visible");
                let way = |pixel: usize| {
                    let has_way = seen.is_none_or(|seen| at(pixel, seen) >= 0.0);
                    Some([at(pixel, x), at(pixel, y)]).filter(|way| has_way && way.iter().all(|part| part.is_finite()))
                };
                let length = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
                let most = || (0..pixels).filter_map(way).map(length).fold(0.0, f64::max);
                let radius = self.range.map_or_else(most, |[_, high]| high);
                let radius = if radius > 0.0 { radius } else { 1.0 };
                let color = |pixel: usize| way(pixel).map_or([0; 3], |[x, y]| flow(x / radius, y / radius));
                (each(&color), Some(legend::Legend::Wheel { radius }))
            }
            Look::Number(unit) => {
                let numbers = (0..pixels).map(|pixel| at(pixel, 0));
                let scale =
                    if unit == "m" { Scale::of(self.range, numbers) } else { Scale::linear(self.range, numbers) };
                let color = |pixel: usize| scale.place(at(pixel, 0)).map_or(NOTHING, |place| scale.color(place));
                (each(&color), Some(legend::Legend::Bar { scale, unit }))
            }
        }
    }
}

/// The code of a number from 0 to 1.
fn unit_code(number: f64) -> u8 {
    (number.clamp(0.0, 1.0) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view<'a>(name: &'a str, channels: &'a [String], numbers: PlaneNumbers<'a>, size: [u32; 2]) -> BufferView<'a> {
        BufferView { name, channels, numbers, size, range: None, display: Display::default() }
    }

    fn channels(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn names_and_channels_say_how_to_look() {
        let floats = PlaneNumbers::Floats(&[]);
        for (name, of, look) in [
            ("depth", &["Z"][..], Look::Number("m")),
            ("light:key", &["R", "G", "B"], Look::Color),
            ("normal-camera", &["X", "Y", "Z"], Look::Direction),
            ("world-normal", &["X", "Y", "Z"], Look::Direction),
            ("motion", &["X", "Y", "visible"], Look::Flow),
            ("position", &["X", "Y", "Z"], Look::Position),
            ("uv", &["U", "V"], Look::Position),
            ("alpha", &["A"], Look::Number("")),
            ("ViewLayer.Combined", &["R", "G", "B", "A"], Look::Color),
            ("ViewLayer.Depth", &["Z"], Look::Number("m")),
            ("mask", &["V"], Look::Number("")),
        ] {
            assert_eq!(view(name, &channels(of), floats, [0, 0]).look(), look, "{name}");
        }
        assert_eq!(view("x", &channels(&["ID"]), PlaneNumbers::Wholes(&[]), [0, 0]).look(), Look::Id);
    }

    #[test]
    fn pictures_are_whole_and_large_enough_for_a_legend() {
        let depth = [1.0, 2.0, f32::INFINITY, f32::NAN];
        let z = channels(&["Z"]);
        let bytes = view("depth", &z, PlaneNumbers::Floats(&depth), [2, 2]).encode(&Receipt::default()).unwrap();
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut samples).unwrap();
        let info = reader.info();
        assert!(info.height == 240 && info.width > 240);
        let pixel = |x: u32, y: u32| {
            let at = 3 * (y * info.width + x) as usize;
            [samples[at], samples[at + 1], samples[at + 2]]
        };
        // The nearest and the farthest at the ends of the map, nothing gray
        assert_eq!(
            [pixel(0, 0), pixel(239, 0), pixel(0, 239), pixel(239, 239)],
            [colors::map(1.0), colors::map(0.0), NOTHING, NOTHING]
        );
    }

    #[test]
    fn numbers_that_are_nothing_break_nothing() {
        for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -3.0, f32::MAX, f32::MIN, 1e-45] {
            for (name, of) in [
                ("depth", &["Z"][..]),
                ("motion", &["X", "Y", "visible"]),
                ("normal", &["X", "Y", "Z"]),
                ("position", &["X", "Y", "Z"]),
                ("diffuse", &["R", "G", "B"]),
                ("uv", &["U", "V"]),
                ("rays", &["N"]),
            ] {
                for other in [number, 1.0] {
                    let numbers: Vec<f32> =
                        (0..2 * of.len()).map(|i| if i % 2 == 0 { number } else { other }).collect();
                    let of = channels(of);
                    let view = view(name, &of, PlaneNumbers::Floats(&numbers), [1, 2]);
                    assert!(view.encode(&Receipt::default()).is_ok(), "{name} {number}");
                }
            }
        }
        let z = channels(&["Z"]);
        let bad = BufferView { range: Some([2.0, 1.0]), ..view("depth", &z, PlaneNumbers::Floats(&[1.0]), [1, 1]) };
        assert!(bad.encode(&Receipt::default()).unwrap_err().to_string().contains("the range is 2 to 1"));
        let short = view("depth", &z, PlaneNumbers::Floats(&[1.0]), [2, 1]);
        assert!(short.encode(&Receipt::default()).unwrap_err().to_string().contains("do not fill"));
    }
}

//! Comparing picture files, number by number.

use super::{
    BufferDesc, FileSettings, Image, ImageError, NamedPlane, Plane, PlaneNumbers, Receipt, StoredPlane, StoredPlanes,
    Window, encode_planes,
};
use crate::color::{Display, Encoding, Rgb, false_color};

/// How the numbers of one buffer differ between two files.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneDifference {
    /// What the buffer is called.
    pub name: String,
    /// The channels that were compared: those that both files have.
    pub channels: Vec<String>,
    /// How many samples were compared: pixels times channels.
    pub samples: u64,
    /// How many of them have other bits.
    pub differing: u64,
    /// How many pixels these are in.
    pub pixels: u64,
    /// Of pictures of 8 or 16 bits, the largest number: 255 or 65535. Differences count in such steps.
    pub steps: Option<u32>,
    /// How far the numbers are apart; `None` for ids, of which two are the same or not.
    pub distance: Option<Distance>,
    /// The first sample that differs, row by row.
    pub first: Option<DifferingSample>,
}

/// How far the numbers of a buffer are apart. An infinite one equals itself, and so does what is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// The largest difference; infinite where only one of two samples is a finite number, or their signs differ.
    pub max: f64,
    /// The root of the mean of the squares of all finite ones.
    pub rms: f64,
    /// How many are not finite.
    pub unmatched: u64,
    /// Where the largest is; `None` if all are 0.
    pub most: Option<DifferingSample>,
}

/// A sample of two files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DifferingSample {
    /// Its column and its row, from the upper left corner of the file.
    pub pixel: [u32; 2],
    /// Which of [`PlaneDifference::channels`].
    pub channel: usize,
    /// Its two values.
    pub values: [f64; 2],
}

/// Two pictures as they are compared.
struct Pair<'a> {
    name: &'a str,
    channels: Vec<String>,
    numbers: [Samples<'a>; 2],
    steps: Option<u32>,
}

/// The samples of a plane that are compared.
struct Samples<'a> {
    numbers: PlaneNumbers<'a>,
    /// Numbers of a pixel.
    all: usize,
    /// The places of the compared channels; `None` for an alpha that is left out because it is the largest everywhere.
    places: Vec<Option<usize>>,
    /// What each is multiplied by.
    scale: u32,
}

impl Samples<'_> {
    /// The bits of a sample and its value. `one` is the largest alpha.
    fn at(&self, pixel: usize, channel: usize, one: Option<u32>) -> (u32, f64) {
        let place = self.places[channel].map(|place| pixel * self.all + place);
        match (place, self.numbers) {
            (Some(i), PlaneNumbers::Floats(numbers)) => (numbers[i].to_bits(), numbers[i].into()),
            (Some(i), PlaneNumbers::Wholes(numbers)) => {
                let number = numbers[i].wrapping_mul(self.scale);
                (number, number.into())
            }
            (None, _) => one.map_or((1f32.to_bits(), 1.0), |one| (one, one.into())),
        }
    }
}

/// Compares two buffers of so many columns.
///
/// # Errors
/// They are not of one kind: their sizes, their types or their channels.
fn pair<'a>(a: &'a StoredPlane, b: &'a StoredPlane) -> Result<Pair<'a>, String> {
    let name = a.name.as_str();
    let kind = |plane: &StoredPlane| matches!(plane.numbers, super::PlaneVec::Wholes(_));
    if kind(a) != kind(b) {
        return Err(format!("{name} has whole numbers in one file and floats in the other"));
    }
    let is_color = name == Plane::Color.name();
    // HDR files have no alpha, which is not to say that it is 1
    let both = |channel: &&String| b.channels.contains(channel);
    let opaque = |plane: &StoredPlane| is_color && plane.steps.is_some() && plane.channels.len() == 3;
    let mut channels: Vec<String> = a.channels.iter().filter(both).cloned().collect();
    let lacks_color = is_color && !(a.is_color() && b.is_color());
    if (opaque(a) && b.channels.len() == 4) || (opaque(b) && a.channels.len() == 4) {
        channels.push("A".into());
    } else if lacks_color || !is_color && (channels.len() != a.channels.len() || channels.len() != b.channels.len()) {
        let [a, b] = [a, b].map(|plane| plane.channels.join(" "));
        return Err(format!("{name} has the channels {a} in one file and {b} in the other"));
    }
    let steps = a.steps.max(b.steps);
    let samples = |plane: &'a StoredPlane| Samples {
        numbers: plane.numbers.numbers(),
        all: plane.channels.len(),
        places: channels.iter().map(|channel| plane.channels.iter().position(|own| own == channel)).collect(),
        // 65535 is 257 times 255
        scale: steps.zip(plane.steps).map_or(1, |(steps, own)| steps / own),
    };
    let numbers = [samples(a), samples(b)];
    Ok(Pair { name, channels, numbers, steps })
}

/// Whether numbers are ids, which are the same or not: of a buffer of ids, or else whole numbers that are no codes of 8
/// or 16 bits.
fn is_id(name: &str, steps: Option<u32>, numbers: PlaneNumbers) -> bool {
    let plane = BufferDesc::parse(name).ok().and_then(|desc| desc.plane());
    plane.map_or(steps.is_none(), Plane::is_whole) && matches!(numbers, PlaneNumbers::Wholes(_))
}

/// How far two numbers are apart.
fn distance(a: f64, b: f64) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        0.0
    } else if a.is_finite() && b.is_finite() {
        (a - b).abs()
    } else {
        f64::INFINITY
    }
}

impl PlaneDifference {
    /// Compares two buffers of one name of two files that have so many columns.
    ///
    /// # Errors
    /// They are not of one kind.
    pub fn compare(a: &StoredPlane, b: &StoredPlane, columns: u32) -> Result<PlaneDifference, String> {
        let Pair { name, channels, numbers: [a, b], steps } = pair(a, b)?;
        let is_id = is_id(name, steps, a.numbers);
        let pixels = a.numbers.count() / a.all.max(1);
        let sample = |pixel: usize, channel: usize, values: [f64; 2]| {
            let columns = columns as usize;
            DifferingSample { pixel: [(pixel % columns) as u32, (pixel / columns) as u32], channel, values }
        };
        let mut found = PlaneDifference {
            name: name.to_owned(),
            samples: pixels as u64 * channels.len() as u64,
            differing: 0,
            pixels: 0,
            steps,
            distance: None,
            first: None,
            channels,
        };
        let (mut most, mut max, mut squares, mut unmatched) = (None, 0.0, 0.0, 0);
        for pixel in 0..pixels {
            let before = found.differing;
            for channel in 0..found.channels.len() {
                let [(bits, x), (other, y)] = [&a, &b].map(|samples| samples.at(pixel, channel, steps));
                if bits == other {
                    continue;
                }
                found.differing += 1;
                found.first.get_or_insert_with(|| sample(pixel, channel, [x, y]));
                let apart = distance(x, y);
                if apart.is_finite() {
                    squares += apart * apart;
                } else {
                    unmatched += 1;
                }
                if apart > max {
                    (max, most) = (apart, Some(sample(pixel, channel, [x, y])));
                }
            }
            found.pixels += u64::from(found.differing > before);
        }
        let rms = (squares / (found.samples - unmatched).max(1) as f64).sqrt();
        found.distance = (!is_id).then_some(Distance { max, rms, unmatched, most });
        Ok(found)
    }
}

impl StoredPlane {
    /// Whether it is a colour: of the picture, or a term of it.
    pub fn is_color(&self) -> bool {
        ["R", "G", "B"].iter().all(|name| self.channels.iter().any(|channel| channel == name))
    }

    /// Its colours as they are displayed, over black: linear Rec. 709 after exposure and tone mapping. Those of 8 and
    /// 16 bits are decoded by the curve of `display`; others are multiplied by its exposure and tone mapped. `None` if
    /// it is none.
    pub fn displayed(&self, display: &Display) -> Option<Vec<[f32; 3]>> {
        let pixels = self.rgba()?;
        Some(match self.steps {
            Some(_) => {
                let decode = |c: f32, alpha: f32| (display.encoding.decode(c.into()) * f64::from(alpha)) as f32;
                pixels.into_iter().map(|[r, g, b, a]| [r, g, b].map(|c| decode(c, a))).collect()
            }
            None => pixels.into_iter().map(|[r, g, b, _]| display.shown([r, g, b])).collect(),
        })
    }
}

impl StoredPlanes {
    /// How a picture of 8 or 16 bits is displayed, as its receipt says; without one sRGB.
    pub fn display(&self) -> Display {
        self.receipt.get(super::DISPLAY_KEY).and_then(|said| said.parse().ok()).unwrap_or_default()
    }

    /// The buffer of a file of 8 or 16 bits as it would be stored there, all others left out; itself if it has none of
    /// that name, or has it in such bits already.
    ///
    /// # Errors
    /// A number that such a file cannot hold.
    pub fn shown_as(&self, other: &StoredPlanes) -> Result<StoredPlanes, ImageError> {
        let [StoredPlane { name, .. }] = &other.planes[..] else { return Ok(self.clone()) };
        let Some(own) = self.plane(name).filter(|plane| plane.steps.is_none()) else { return Ok(self.clone()) };
        let Window { width, height, .. } = self.window;
        let window = Window { x: 0, y: 0, width, height };
        let settings = FileSettings { display: other.display(), ..FileSettings::of(&other.receipt) };
        let bytes = if name == Plane::Color.name() {
            let Some(pixels) = own.rgba() else { return Ok(self.clone()) };
            let plane = NamedPlane::new(Plane::Color, PlaneNumbers::Floats(pixels.as_flattened()));
            encode_planes([width, height], window, &[plane], other.format, &settings, &Receipt::default())
        } else {
            let Some(plane) = BufferDesc::parse(name).ok().and_then(|desc| desc.plane()) else {
                return Ok(self.clone());
            };
            let plane = NamedPlane { name, plane, numbers: own.numbers.numbers() };
            encode_planes([width, height], window, &[plane], other.format, &settings, &Receipt::default())
        };
        StoredPlanes::read(&bytes?)
    }
}

/// A picture of 0 (black) to 1 (pale yellow), one number for each pixel, for a display of sRGB.
///
/// # Panics
/// If the numbers are not of whole rows.
pub fn false_colors(numbers: &[f32], columns: u32) -> Image {
    assert!(numbers.len().is_multiple_of(columns.max(1) as usize), "whole rows");
    let (width, height) = (columns, (numbers.len() / columns.max(1) as usize) as u32);
    let pixel = |part: &f32| {
        let Rgb { r, g, b } = false_color(*part);
        [r, g, b, 1.0]
    };
    let window = Window { x: 0, y: 0, width, height };
    Image { film: [width, height], window, pixels: numbers.iter().map(pixel).collect() }
}

/// Of each pixel the largest difference of two buffers, as a part of the largest of all; of ids 1 where they differ.
///
/// # Errors
/// They are not of one kind.
pub fn relative_differences(a: &StoredPlane, b: &StoredPlane) -> Result<Vec<f32>, String> {
    let Pair { name, channels, numbers: [a, b], steps } = pair(a, b)?;
    let is_id = is_id(name, steps, a.numbers);
    let of = |pixel: usize, channel: usize| {
        let [(bits, x), (other, y)] = [&a, &b].map(|samples| samples.at(pixel, channel, steps));
        if is_id { f64::from(u8::from(bits != other)) } else { distance(x, y) }
    };
    let pixels = a.numbers.count() / a.all.max(1);
    let apart: Vec<f64> =
        (0..pixels).map(|pixel| (0..channels.len()).map(|channel| of(pixel, channel)).fold(0.0, f64::max)).collect();
    let largest = apart.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let part = |d: f64| if d.is_finite() { d / largest.max(f64::MIN_POSITIVE) } else { 1.0 };
    Ok(apart.into_iter().map(|d| part(d) as f32).collect())
}

/// How far two pictures are apart as they are displayed, in steps of 8 bits: each pixel's largest difference of red,
/// green and blue. Both hold light after exposure and tone mapping.
pub fn display_steps(a: &[[f32; 3]], b: &[[f32; 3]], encoding: Encoding) -> Vec<f32> {
    let apart = |a: f32, b: f32| (encoding.encode(a.into()) - encoding.encode(b.into())).abs() * 255.0;
    let pixel =
        |(a, b): (&[f32; 3], &[f32; 3])| std::iter::zip(a, b).map(|(a, b)| apart(*a, *b)).fold(0.0, f64::max) as f32;
    std::iter::zip(a, b).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::super::PlaneVec;
    use super::*;

    fn plane(name: &str, channels: &str, numbers: PlaneVec, steps: Option<u32>) -> StoredPlane {
        let channels = channels.split(' ').map(str::to_owned).collect();
        StoredPlane { name: name.into(), channels, numbers, steps }
    }

    fn depth(numbers: &[f32]) -> StoredPlane {
        plane("depth", "Z", PlaneVec::Floats(numbers.to_vec()), None)
    }

    #[test]
    fn numbers_are_counted_and_measured() {
        let (a, b) =
            (depth(&[1.0, 2.0, 3.0, 4.0, f32::INFINITY, 0.0]), depth(&[1.0, 2.5, 3.0, 1.0, f32::INFINITY, -0.0]));
        let found = PlaneDifference::compare(&a, &b, 3).unwrap();
        assert_eq!((found.samples, found.differing, found.pixels), (6, 3, 3));
        let Distance { max, rms, unmatched, most } = found.distance.unwrap();
        assert_eq!((max, unmatched), (3.0, 0));
        assert!((rms - (9.25f64 / 6.0).sqrt()).abs() < 1e-12);
        assert_eq!(most, Some(DifferingSample { pixel: [0, 1], channel: 0, values: [4.0, 1.0] }));
        assert_eq!(found.first, Some(DifferingSample { pixel: [1, 0], channel: 0, values: [2.0, 2.5] }));
        assert_eq!(relative_differences(&a, &b).unwrap(), [0.0, 0.5 / 3.0, 0.0, 1.0, 0.0, 0.0]);
        let same = PlaneDifference::compare(&a, &a, 3).unwrap();
        assert_eq!((same.differing, same.first, same.distance.unwrap().max), (0, None, 0.0));
    }

    #[test]
    fn infinite_and_no_numbers_have_a_meaning() {
        let nan = f32::from_bits(0x7fc0_0001);
        let (a, b) = (depth(&[f32::NAN, f32::INFINITY, 1.0, 2.0]), depth(&[nan, f32::NEG_INFINITY, f32::NAN, 2.5]));
        let found = PlaneDifference::compare(&a, &b, 4).unwrap();
        // Two that are no number have other bits, and are no way apart
        assert_eq!(found.differing, 4);
        let Distance { max, rms, unmatched, most } = found.distance.unwrap();
        assert_eq!((max, unmatched, most.unwrap().pixel), (f64::INFINITY, 2, [1, 0]));
        assert!((rms - (0.25f64 / 2.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn ids_are_the_same_or_not() {
        let id = |numbers: &[u32]| plane("object-id", "ID", PlaneVec::Wholes(numbers.to_vec()), None);
        let found = PlaneDifference::compare(&id(&[1, 2, 3]), &id(&[1, 9, 3]), 3).unwrap();
        assert_eq!((found.differing, found.distance), (1, None));
        assert_eq!(relative_differences(&id(&[1, 2, 3]), &id(&[1, 9, 3])).unwrap(), [0.0, 1.0, 0.0]);
        assert!(
            PlaneDifference::compare(&id(&[1]), &plane("object-id", "ID", PlaneVec::Floats(vec![1.0]), None), 1)
                .is_err()
        );
    }

    #[test]
    fn eight_bits_are_among_sixteen_and_opaque_pictures_have_an_alpha() {
        let eight = plane("color", "R G B", PlaneVec::Wholes(vec![255, 0, 1]), Some(255));
        let sixteen = plane("color", "R G B A", PlaneVec::Wholes(vec![65535, 0, 257, 65535]), Some(65535));
        let found = PlaneDifference::compare(&eight, &sixteen, 1).unwrap();
        assert_eq!((found.samples, found.differing, found.steps), (4, 0, Some(65535)));
        let other = plane("color", "R G B A", PlaneVec::Wholes(vec![65535, 0, 258, 65534]), Some(65535));
        let found = PlaneDifference::compare(&other, &eight, 1).unwrap();
        assert_eq!((found.differing, found.pixels, found.distance.unwrap().max), (2, 1, 1.0));
        // HDR files say nothing of alpha
        let hdr = plane("color", "R G B", PlaneVec::Floats(vec![1.0, 0.0, 0.5]), None);
        let exr = plane("color", "R G B A", PlaneVec::Floats(vec![1.0, 0.0, 0.5, 0.25]), None);
        let found = PlaneDifference::compare(&hdr, &exr, 1).unwrap();
        assert_eq!((found.samples, found.differing), (3, 0));
    }
}

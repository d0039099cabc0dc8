//! One buffer in a file of 8 or 16 bits: what its numbers are there.
//!
//! Colours are developed like the picture. What is no colour keeps its meaning at a stated scale, and the receipt says
//! it under `stored`:
//!
//! - depth and distance: 16 bits of gray, so many units per metre ([`FileSettings::depth_scale`]), to the nearest; 0
//!   where nothing is, and where something is farther than 65535 units. As data sets of depth cameras have it: 1000 per
//!   metre in ScanNet and BOP, 5000 in that of TUM.
//! - ids: 16 bits of gray, the id; 0 where nothing is.
//! - normals and tangents: red, green and blue are (x, y, z) / 2 + 1/2; black where nothing is, which no unit vector
//!   is.
//! - alpha: gray.

use super::jpeg::QUALITY_KEY;
use super::plane::{BUFFER_KEY, is_half};
use super::png::{self, ColorType, Depth, PngSamples};
use super::{
    BufferDesc, Format, ImageError, NamedPlane, PREFIX, Plane, PlaneNumbers, PlaneVec, Receipt, StoredPlane, Window,
    hdr, jpeg,
};
use crate::color::{Display, Quantizer};

/// How files hold numbers, where there is a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileSettings {
    /// What is done to colours in files of 8 and 16 bits.
    pub display: Display,
    /// Units per metre of depth and distance in 16 bits, 0.001 to 1,000,000: 1000 are millimetres.
    pub depth_scale: f64,
    /// Whether EXR files hold colours and shares in 16-bit floats, which have 11 bits and end at 65504; larger numbers
    /// become that. All others stay as they are.
    pub half: bool,
    /// The quality of JPEG files, 1 to 100: the more, the longer they are and the less is lost.
    pub jpeg_quality: u8,
}

impl Default for FileSettings {
    /// sRGB; millimetres; 32-bit floats; quality 90.
    fn default() -> Self {
        FileSettings { display: Display::default(), depth_scale: 1000.0, half: false, jpeg_quality: 90 }
    }
}

/// The key of the scale of depth.
const SCALE_KEY: &str = "depth_scale";

impl FileSettings {
    /// Those of a file with such a receipt, but for the display.
    pub fn of(receipt: &Receipt) -> Self {
        let said = receipt.get(SCALE_KEY).and_then(|scale| scale.parse().ok());
        let default = FileSettings::default();
        let half = receipt.entries.iter().any(|(key, said)| key.starts_with(BUFFER_KEY) && is_half(said));
        let quality = receipt.get(QUALITY_KEY).and_then(|quality| quality.parse().ok());
        FileSettings {
            depth_scale: said.unwrap_or(default.depth_scale),
            half,
            jpeg_quality: quality.unwrap_or(default.jpeg_quality),
            ..default
        }
    }

    pub(super) fn check(&self) -> Result<(), ImageError> {
        if !(1e-3..=1e6).contains(&self.depth_scale) {
            return Err(ImageError::DepthScale(self.depth_scale));
        }
        if !(1..=100).contains(&self.jpeg_quality) {
            return Err(ImageError::JpegQuality(self.jpeg_quality));
        }
        Ok(())
    }

    /// Whether files that can hold a plane in 16-bit floats do.
    pub(super) fn is_half(&self, plane: Plane) -> bool {
        self.half && matches!(NumberKind::of(plane), NumberKind::Color | NumberKind::Share)
    }

    /// What is farther away than this, in metres, is 0 in 16 bits.
    pub fn farthest(&self) -> f64 {
        f64::from(u16::MAX) / self.depth_scale
    }

    /// How many of such distances are finite and 0 all the same in 16 bits: they are farther than
    /// [`farthest`](Self::farthest).
    pub fn beyond(&self, distances: &[f32]) -> usize {
        distances.iter().filter(|metres| metres.is_finite() && self.code(**metres) == 0 && **metres > 0.0).count()
    }

    /// The units of a distance; at least 1 of what is somewhere, and 0 of what is nowhere or too far.
    fn code(&self, metres: f32) -> u16 {
        let units = (f64::from(metres) * self.depth_scale).round();
        if metres > 0.0 && units <= f64::from(u16::MAX) { (units as u16).max(1) } else { 0 }
    }
}

/// What the numbers of a plane are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberKind {
    Color,
    /// Of 1.
    Share,
    Distance,
    Id,
    Direction,
    /// Any numbers.
    Other,
}

impl NumberKind {
    pub fn of(plane: Plane) -> NumberKind {
        use Plane::*;
        match plane.of_each_ray().unwrap_or(plane) {
            Color | Background | Emission | Ambient | Diffuse | Specular | Rest | Albedo => NumberKind::Color,
            Alpha | Shadow | BackgroundCoverage | Roughness | Metallic | Opacity => NumberKind::Share,
            Depth | Distance => NumberKind::Distance,
            Normal | NormalCamera | NormalObject | NormalGeometric | NormalGeometricCamera | Tangent => {
                NumberKind::Direction
            }
            plane if plane.is_whole() => NumberKind::Id,
            _ => NumberKind::Other,
        }
    }
}

impl Plane {
    /// Whether it is a colour, which 8- and 16-bit files show as they show the picture.
    pub fn is_color(self) -> bool {
        NumberKind::of(self) == NumberKind::Color
    }

    /// Whether its numbers are distances from the camera, which 16-bit files hold at a scale.
    pub fn is_distance(self) -> bool {
        NumberKind::of(self) == NumberKind::Distance
    }
}

impl StoredPlane {
    /// The numbers that a buffer of that name has where these are stored: of 8- and 16-bit files, back from the codes
    /// to metres, unit vectors, shares; the ids as they are, and colours from 0 to 1, encoded as they are.
    pub fn meant(&self, name: &str, receipt: &Receipt) -> PlaneVec {
        let (Some(steps), PlaneVec::Wholes(codes)) = (self.steps, &self.numbers) else { return self.numbers.clone() };
        let plane = BufferDesc::parse(name).ok().and_then(|desc| desc.plane());
        let kind = plane.map_or(NumberKind::Color, NumberKind::of);
        let settings = FileSettings::of(receipt);
        let part = |code: u32| f64::from(code) / f64::from(steps);
        let number = |code: u32| match kind {
            NumberKind::Distance if code == 0 => f64::INFINITY,
            NumberKind::Distance => f64::from(code) / settings.depth_scale,
            NumberKind::Direction => part(code) * 2.0 - 1.0,
            _ => part(code),
        };
        if kind == NumberKind::Id {
            return self.numbers.clone();
        }
        let mut numbers: Vec<f32> = codes.iter().map(|code| number(*code) as f32).collect();
        if kind == NumberKind::Direction {
            // Black is none
            for (v, _) in numbers
                .as_chunks_mut::<3>()
                .0
                .iter_mut()
                .zip(codes.as_chunks::<3>().0)
                .filter(|(_, code)| **code == [0; 3])
            {
                *v = [0.0; 3];
            }
        }
        PlaneVec::Floats(numbers)
    }
}

/// Numbers of a pixel of a plane, which its kind says to be floats.
fn floats<'a>(of: &NamedPlane<'a>) -> &'a [f32] {
    match of.numbers {
        PlaneNumbers::Floats(numbers) => numbers,
        PlaneNumbers::Wholes(_) => unreachable!("only ids are whole"),
    }
}

/// Colours as pixels with alpha.
fn with_pixels<R>(of: &NamedPlane, with: impl FnOnce(&[[f32; 4]]) -> R) -> R {
    let numbers = floats(of);
    match of.plane.channels().len() {
        4 => with(numbers.as_chunks().0),
        _ => with(&numbers.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect::<Vec<_>>()),
    }
}

impl Format {
    /// Why files of this format hold no buffer like `plane`, whatever its numbers; `None` if they can.
    pub fn refuses(self, plane: Plane) -> Option<String> {
        match (self, NumberKind::of(plane)) {
            (Format::Png8 | Format::Png16, NumberKind::Other) => {
                Some("its numbers have no range that 16 bits could be made of".into())
            }
            (Format::Hdr | Format::Jpeg, kind) if kind != NumberKind::Color => Some("it is no colour".into()),
            _ => None,
        }
    }

    /// Why files of this format cannot hold a buffer of that name; `None` if they can. Names hold those of lights,
    /// groups of lights and objects.
    pub fn refuses_name(self, name: &str) -> Option<String> {
        let most = match self {
            Format::Exr => MAX_EXR_NAME,
            Format::Npz => MAX_NPZ_NAME,
            Format::Png8 | Format::Png16 | Format::Npy | Format::Hdr | Format::Jpeg => return None,
        };
        let length = name.len();
        (length > most).then(|| {
            let start: String = name.chars().take(40).collect();
            format!(
                "the buffer {start:?}... has a name of {length} bytes, and at most {most} are possible; give the \
                 light, group or object in it a shorter name"
            )
        })
    }
}

/// No name in an EXR file has more than 255 bytes, that of a receipt's entry about a buffer among them.
const MAX_EXR_NAME: usize = 255 - PREFIX.len() - BUFFER_KEY.len();
/// Nor one in a zip archive more than 65535, its ending among them.
const MAX_NPZ_NAME: usize = 65535 - ".npy".len();

/// The bytes of a Radiance file of one colour. The plane and the receipt have been checked.
pub(super) fn hdr(window: Window, of: &NamedPlane, receipt: &Receipt) -> Vec<u8> {
    with_pixels(of, |pixels| hdr::encode(window, of, pixels, receipt))
}

/// The bytes of a JPEG file of one colour. The plane, the settings and the receipt have been checked.
pub(super) fn jpeg(
    window: Window,
    of: &NamedPlane,
    settings: &FileSettings,
    receipt: &Receipt,
) -> Result<Vec<u8>, ImageError> {
    with_pixels(of, |pixels| jpeg::encode(window, of, pixels, settings, receipt))
}

/// The bytes of a PNG file of one plane. The plane, the settings and the receipt have been checked. `depth` is that of
/// what may have 8 bits or 16.
pub(super) fn png(
    window: Window,
    of: &NamedPlane,
    depth: Depth,
    settings: &FileSettings,
    receipt: &Receipt,
) -> Result<Vec<u8>, ImageError> {
    let (largest, bits) = (depth.largest(), depth.bits());
    let (color, depth, unit, stored, codes): (_, _, _, _, Vec<u16>) = match NumberKind::of(of.plane) {
        NumberKind::Color => {
            let display = &settings.display;
            return with_pixels(of, |pixels| png::encode(window, of, pixels, depth, display, receipt));
        }
        NumberKind::Other => unreachable!("such a plane has been refused"),
        NumberKind::Share => {
            let codes = floats(of).iter().map(|share| Quantizer::linear(*share, largest));
            let stored = format!("{bits}-bit gray: {largest} is 1");
            (ColorType::Grayscale, depth, format!("1/{largest}"), stored, codes.collect())
        }
        NumberKind::Distance => {
            let (scale, farthest) = (settings.depth_scale, settings.farthest());
            let stored =
                format!("16-bit gray: {scale} units per metre; 0 where nothing is, or farther than {farthest} m");
            let codes = floats(of).iter().map(|metres| settings.code(*metres));
            (ColorType::Grayscale, Depth::Sixteen, format!("1/{scale} m"), stored, codes.collect())
        }
        NumberKind::Id => {
            let PlaneNumbers::Wholes(ids) = of.numbers else { unreachable!("ids are whole") };
            let codes = ids.iter().map(|id| u16::try_from(*id)).collect::<Result<_, _>>();
            let too_large = |_| ImageError::NotHeld {
                format: Format::Png16,
                buffer: of.name.to_owned(),
                reason: format!("16 bits end at 65535, and it has {}", ids.iter().max().unwrap_or(&0)),
            };
            let codes = codes.map_err(too_large);
            (ColorType::Grayscale, Depth::Sixteen, "1".into(), "16-bit gray: ids; 0 where nothing is".into(), codes?)
        }
        NumberKind::Direction => {
            let stored = format!("{bits}-bit RGB: (x, y, z) x {largest}/2 + {largest}/2; black where nothing is");
            let code = |axis: f32| Quantizer::linear(axis * 0.5 + 0.5, largest);
            let codes = floats(of).as_chunks::<3>().0.iter();
            let codes = codes.flat_map(|v| if *v == [0.0; 3] { [0; 3] } else { v.map(code) });
            (ColorType::Rgb, depth, format!("2/{largest}"), stored, codes.collect())
        }
    };
    let bytes = match depth {
        Depth::Eight => codes.into_iter().map(|code| code as u8).collect(),
        Depth::Sixteen => codes.into_iter().flat_map(u16::to_be_bytes).collect(),
    };
    let mut receipt = receipt.shown_by(None).with("stored", stored);
    if NumberKind::of(of.plane) == NumberKind::Distance {
        receipt = receipt.with(SCALE_KEY, settings.depth_scale.to_string());
    }
    let samples = PngSamples { window, depth, color, encoding: None, bytes };
    let (channels, space, convention) = (of.plane.channels().join(" "), of.plane.space(), of.plane.convention());
    let meaning = format!("unit {unit}; space {space}; {convention}");
    samples.encode(&samples.described(of, &channels, &meaning, &receipt))
}

#[cfg(test)]
mod tests {
    use super::super::{StoredPlanes, encode_planes};
    use super::*;

    const WINDOW: Window = Window { x: 0, y: 0, width: 2, height: 2 };

    fn encoded(plane: Plane, numbers: PlaneNumbers, format: Format) -> Result<Vec<u8>, ImageError> {
        let planes = [NamedPlane::new(plane, numbers)];
        encode_planes([2, 2], WINDOW, &planes, format, &FileSettings::default(), &Receipt::default())
    }

    /// The samples of a PNG file, and what it says of how they are stored.
    fn samples(bytes: &[u8]) -> (Vec<u16>, String) {
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut samples).unwrap();
        let info = reader.info();
        assert!(info.srgb.is_none() && info.gama_chunk.is_none());
        let stored = info.utf8_text.iter().find(|chunk| chunk.keyword == "firstlight:stored").unwrap();
        let codes = match info.bit_depth {
            ::png::BitDepth::Sixteen => samples.chunks(2).map(|s| u16::from_be_bytes([s[0], s[1]])).collect(),
            _ => samples.iter().map(|s| u16::from(*s)).collect(),
        };
        (codes, stored.get_text().unwrap())
    }

    #[test]
    fn depth_is_at_a_scale() {
        let depth = [f32::INFINITY, 1.2344, 65.5354, 65.5356];
        let (codes, stored) = samples(&encoded(Plane::Depth, PlaneNumbers::Floats(&depth), Format::Png8).unwrap());
        assert_eq!(codes, [0, 1234, 65535, 0]);
        assert_eq!(stored, "16-bit gray: 1000 units per metre; 0 where nothing is, or farther than 65.535 m");
        let settings = FileSettings { depth_scale: 5000.0, ..FileSettings::default() };
        assert_eq!((FileSettings::default().beyond(&depth), settings.beyond(&depth)), (1, 2));
        // What is somewhere is never nothing
        assert_eq!(
            (settings.code(1e-9), settings.code(0.0), settings.code(-1.0), settings.code(f32::NAN)),
            (1, 0, 0, 0)
        );
        for bad in [0.0, -1.0, f64::NAN, 1e7] {
            let settings = FileSettings { depth_scale: bad, ..settings };
            assert!(matches!(settings.check(), Err(ImageError::DepthScale(_))));
        }
    }

    #[test]
    fn ids_fit_in_16_bits_or_are_refused() {
        let ids = |last| [0, 1, 65535, last];
        let fits = encoded(Plane::ObjectId, PlaneNumbers::Wholes(&ids(7)), Format::Png8).unwrap();
        assert_eq!(samples(&fits).0, ids(7).map(|id| id as u16));
        let fault = encoded(Plane::ObjectId, PlaneNumbers::Wholes(&ids(65536)), Format::Png16).unwrap_err();
        let said =
            "a PNG file cannot hold object-id: 16 bits end at 65535, and it has 65536; .exr, .npz and .npy files can";
        assert_eq!(fault.to_string(), said);
    }

    #[test]
    fn normals_are_colours() {
        let normals = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.6, 0.8, 0.0];
        let of = |format| samples(&encoded(Plane::Normal, PlaneNumbers::Floats(&normals), format).unwrap());
        let (codes, stored) = of(Format::Png8);
        assert_eq!(codes, [128, 128, 255, 0, 0, 0, 0, 128, 128, 204, 229, 128]);
        assert_eq!(stored, "8-bit RGB: (x, y, z) x 255/2 + 255/2; black where nothing is");
        assert_eq!(of(Format::Png16).0[..3], [32768, 32768, 65535]);
    }

    #[test]
    fn colours_are_shown_like_the_picture() {
        let floats = |numbers| PlaneNumbers::Floats(numbers);
        let rgb = [0.0, 0.5, 1.0].repeat(4);
        let rgba = [0.0, 0.5, 1.0, 1.0].repeat(4);
        let pixels = |bytes: Vec<u8>| super::super::StoredPlanes::read(&bytes).unwrap().planes[0].rgba().unwrap();
        for format in [Format::Png8, Format::Png16, Format::Hdr] {
            let [term, picture] = [(Plane::Diffuse, &rgb), (Plane::Color, &rgba)]
                .map(|(plane, numbers)| pixels(encoded(plane, floats(numbers), format).unwrap()));
            assert_eq!(term, picture);
        }
    }

    #[test]
    fn what_a_format_cannot_hold_is_said() {
        let floats = [0.5; 12];
        for (plane, format, said) in [
            (Plane::Position, Format::Png8, "a PNG file cannot hold position: its numbers have no range"),
            (Plane::Rays, Format::Png16, "a PNG file cannot hold rays: its numbers"),
            (Plane::Depth, Format::Hdr, "an HDR file cannot hold depth: it is no colour"),
        ] {
            let numbers = PlaneNumbers::Floats(&floats[..4 * plane.channels().len()]);
            let words = encoded(plane, numbers, format).unwrap_err().to_string();
            assert!(words.starts_with(said), "{words}");
        }
        let two =
            [Plane::Depth, Plane::Distance].map(|plane| NamedPlane::new(plane, PlaneNumbers::Floats(&floats[..4])));
        for format in [Format::Png8, Format::Hdr, Format::Npy] {
            let result = encode_planes([2, 2], WINDOW, &two, format, &FileSettings::default(), &Receipt::default());
            assert!(matches!(result, Err(ImageError::OneBuffer { .. })));
        }
    }

    #[test]
    fn an_array_by_itself_is_the_one_of_the_archive() {
        let numbers = [1.0, 2.0, f32::INFINITY, 4.0];
        let [array, archive] = [Format::Npy, Format::Npz].map(|format| {
            StoredPlanes::read(&encoded(Plane::Depth, PlaneNumbers::Floats(&numbers), format).unwrap()).unwrap()
        });
        assert_eq!((&array.planes, &array.receipt), (&archive.planes, &archive.receipt));
        assert_eq!((array.format, array.is_as_written(&array.planes[0])), (Format::Npy, Some(true)));
        // The array of an archive, which is one by itself, has no name
        let bytes = encoded(Plane::Depth, PlaneNumbers::Floats(&numbers), Format::Npy).unwrap();
        let bare = StoredPlanes::read(&bytes[..128 + 4 * numbers.len()]).unwrap();
        assert_eq!((bare.planes[0].name.as_str(), bare.receipt), ("array", Receipt::default()));
        assert!(StoredPlanes::read(&bytes[..bytes.len() - 1]).is_err());
    }
}

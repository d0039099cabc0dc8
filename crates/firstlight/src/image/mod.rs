//! Pictures in memory and in files.
//!
//! Owns the encoders (one file each), writing files whole, and decoding the pictures that textures are made of.
//! Before it stands the film; after it, only the disk.

mod buffer;
mod compare;
mod contain;
pub(crate) mod cryptomatte;
mod damage;
mod error;
#[cfg(feature = "exr")]
mod exr;
mod file;
mod flip;
mod foreign;
mod format;
mod given;
mod hdr;
mod jpeg;
mod npz;
mod npz_read;
mod patient;
mod plane;
mod png;
mod quantized;
pub(crate) mod read;
mod stored;
mod view;

pub use buffer::{Buffer, BufferDesc, LightChoice, LightPart};
pub use compare::{DifferingSample, Distance, PlaneDifference, display_steps, false_colors, relative_differences};
pub use contain::is_decoding;
pub use error::ImageError;
pub use file::{PendingFile, StagedFile, Written, write_whole};
pub use flip::Flip;
pub use format::Format;
pub use given::{PlaneVec, encode_planes};
pub use patient::write_open;
pub(crate) use plane::PlaneFile;
pub use plane::{NamedPlane, Plane, PlaneNumbers, Sampling};
pub use png::display_bytes;
pub use quantized::FileSettings;
pub use stored::{StoredImage, StoredPlane, StoredPlanes};
pub use view::BufferView;

use crate::color::Display;

/// The part of a film that a picture shows, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The first column.
    pub x: u32,
    /// The first row; row 0 is the top.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A picture: linear Rec. 709, alpha premultiplied, 32-bit floats.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The width and height of the whole film.
    pub film: [u32; 2],
    /// The part of it that `pixels` holds.
    pub window: Window,
    /// Red, green, blue, alpha; the window's rows from the top, each from the left.
    pub pixels: Vec<[f32; 4]>,
}

/// What a picture file says of itself: keys and values, in order. Only what decides pixels: no clock, host, thread
/// count or absolute path.
///
/// A key is 1 to 64 of the letters a to z and A to Z, digits, `_`, `.` and `-`, and appears once. A value is any text
/// without the character NUL.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Receipt {
    /// Key and value, `("scene_hash", "9f1c...")`.
    pub entries: Vec<(String, String)>,
}

/// What made a file, as it says of itself.
pub(crate) const SOFTWARE: &str = concat!("firstlight ", env!("CARGO_PKG_VERSION"));

/// Before a receipt's key, where it stands among the names of others.
const PREFIX: &str = "firstlight:";

impl Image {
    /// The bytes of a picture file. The same picture and receipt give the same bytes, always.
    ///
    /// 8- and 16-bit formats are encoded for `display`. PNG stores straight alpha, and none if every pixel has alpha 1;
    /// a JPEG file, of quality 90, has the picture on black.
    /// The others store the film as it is, and `display` has no part in them. NaN is stored as 0 and infinity as the
    /// largest number, except in EXR and NPZ, which have both.
    ///
    /// The receipt's entry `display` is this function's own: 8- and 16-bit files say `display` there, the others have
    /// none, whatever `receipt` says of it.
    ///
    /// # Errors
    /// A picture whose window is empty, or outside its film, or which has not as many pixels as the window says; a
    /// display or receipt outside what it may be; a format that this build does not have.
    pub fn encode(&self, format: Format, display: &Display, receipt: &Receipt) -> Result<Vec<u8>, ImageError> {
        self.check()?;
        let planes = [NamedPlane::new(Plane::Color, PlaneNumbers::Floats(self.pixels.as_flattened()))];
        let settings = FileSettings { display: *display, ..FileSettings::default() };
        PlaneFile { film: self.film, window: self.window, planes: &planes }.encode(format, &settings, receipt)
    }

    /// Whether the picture is whole.
    fn check(&self) -> Result<(), ImageError> {
        Self::check_window(self.film, self.window)?;
        let Window { width, height, .. } = self.window;
        if self.pixels.len() as u64 != u64::from(width) * u64::from(height) {
            let fault = format!("{} pixels do not fill the window {width} x {height}", self.pixels.len());
            return Err(ImageError::Picture(fault));
        }
        Ok(())
    }

    /// Whether a window is a part of its film.
    fn check_window([w, h]: [u32; 2], window: Window) -> Result<(), ImageError> {
        let Window { x, y, width, height } = window;
        let inside = |first: u32, length: u32, all: u32| first.checked_add(length).is_some_and(|end| end <= all);
        if width == 0 || height == 0 || !inside(x, width, w) || !inside(y, height, h) {
            let fault = format!("the window {width} x {height} at ({x}, {y}) is empty or outside the film {w} x {h}");
            return Err(ImageError::Picture(fault));
        }
        Ok(())
    }
}

/// The key of what an 8- or 16-bit file does to the film.
const DISPLAY_KEY: &str = "display";

impl Receipt {
    /// The receipt of a file that shows the film by `display`, or as it is.
    fn shown_by(&self, display: Option<&Display>) -> Receipt {
        let others = self.entries.iter().filter(|(key, _)| key != DISPLAY_KEY).cloned();
        let own = display.map(|display| (DISPLAY_KEY.to_owned(), display.to_string()));
        Receipt { entries: others.chain(own).collect() }
    }

    /// What it says under a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.entries.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// The receipt with another entry, in place of the one that has its key.
    pub(crate) fn with(&self, key: &str, value: String) -> Receipt {
        let others = self.entries.iter().filter(|(known, _)| known != key).cloned();
        Receipt { entries: others.chain([(key.to_owned(), value)]).collect() }
    }

    /// Whether a file is a PNG that firstlight wrote, with a receipt in it. Reads no further than to where the pixels
    /// begin.
    pub fn is_in_png(file: &mut dyn std::io::Read) -> bool {
        png::has_receipt(file).unwrap_or(false)
    }

    /// Whether every format can hold it.
    fn check(&self) -> Result<(), ImageError> {
        let mut seen = std::collections::BTreeSet::new();
        for (key, value) in &self.entries {
            let legal = |c: u8| c.is_ascii_alphanumeric() || b"_.-".contains(&c);
            if !(1..=64).contains(&key.len()) || !key.bytes().all(legal) {
                return Err(ImageError::Receipt {
                    key: key.clone(),
                    fault: "is not a key: 1 to 64 letters, digits, _ . or - are",
                });
            }
            if !seen.insert(key) {
                return Err(ImageError::Receipt { key: key.clone(), fault: "appears twice; keys are unique" });
            }
            if value.contains('\0') {
                return Err(ImageError::Receipt {
                    key: key.clone(),
                    fault: "has a value with the character NUL, which no file can hold",
                });
            }
            // PNG counts in 31 bits, EXR as well; both with room for the key
            if value.len() > 1 << 30 {
                return Err(ImageError::Receipt { key: key.clone(), fault: "has a value of more than 2^30 bytes" });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture that is its whole film.
    pub(crate) fn whole(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [f32; 4]) -> Image {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Image { film: [width, height], window: Window { x: 0, y: 0, width, height }, pixels }
    }

    pub(crate) fn receipt() -> Receipt {
        let entry = |k: &str, v: &str| (k.to_owned(), v.to_owned());
        Receipt {
            entries: vec![
                entry("scene_hash", "9f1c"),
                entry("names", "Würfel, \"Kugel\"\nback\\slash = 1"),
                entry("camera.fov_y_deg", "45"),
                entry("empty", ""),
                entry("a-key-that-is-much-longer-than-the-thirty-one-bytes-of-old-exr", "x"),
            ],
        }
    }

    const FORMATS: [Format; 6] = [Format::Png8, Format::Png16, Format::Exr, Format::Npz, Format::Hdr, Format::Jpeg];

    fn built(format: Format) -> bool {
        format != Format::Exr || cfg!(feature = "exr")
    }

    #[test]
    fn pictures_that_are_not_whole_are_refused() {
        let good = whole(3, 2, |_, _| [0.0; 4]);
        let mut short = good.clone();
        short.pixels.pop();
        let mut outside = good.clone();
        outside.window.x = 1;
        let mut far = good.clone();
        far.window.y = u32::MAX;
        let empty = Image { film: [3, 2], window: Window { x: 0, y: 0, width: 0, height: 2 }, pixels: Vec::new() };
        for format in FORMATS {
            for bad in [&short, &outside, &far, &empty] {
                let result = bad.encode(format, &Display::default(), &Receipt::default());
                assert!(matches!(result, Err(ImageError::Picture(_))));
            }
        }
    }

    #[test]
    fn receipts_that_no_file_can_hold_are_refused() {
        let picture = whole(1, 1, |_, _| [0.0; 4]);
        let long = "k".repeat(65);
        for (key, value) in [("", ""), ("a b", ""), ("ä", ""), (long.as_str(), ""), ("k", "a\0b")] {
            let receipt = Receipt { entries: vec![(key.into(), value.into())] };
            let result = picture.encode(Format::Png8, &Display::default(), &receipt);
            assert!(matches!(result, Err(ImageError::Receipt { .. })), "{key}");
        }
        let twice = Receipt { entries: vec![("k".into(), "1".into()), ("k".into(), "2".into())] };
        let fault = picture.encode(Format::Hdr, &Display::default(), &twice).unwrap_err().to_string();
        assert_eq!(fault, "receipt key \"k\" appears twice; keys are unique");
    }

    #[test]
    fn the_same_picture_gives_the_same_bytes_and_its_receipt_comes_back() {
        let picture = whole(13, 9, |x, y| [x as f32 / 12.0, y as f32 / 8.0, 0.25, if x == y { 0.5 } else { 1.0 }]);
        for format in FORMATS.into_iter().filter(|&f| built(f)) {
            let bytes = picture.encode(format, &Display::default(), &receipt()).unwrap();
            for _ in 0..5 {
                assert!(picture.encode(format, &Display::default(), &receipt()).unwrap() == bytes, "{format:?}");
            }
            let mut stored = StoredPlanes::read(&bytes).unwrap();
            assert_eq!(stored.format, format);
            // What JPEG loses is no change
            let is_as_written = (format != Format::Jpeg).then_some(true);
            assert_eq!(stored.is_as_written(&stored.planes[0]), is_as_written, "{format:?}");
            let described = stored.receipt.entries.pop().unwrap();
            assert!(described.0 == "buffer.color" && described.1.starts_with("channels R G B"), "{format:?}");
            if format == Format::Jpeg {
                assert_eq!(stored.receipt.entries.pop(), Some(("jpeg_quality".into(), "90".into())));
            }
            let is_shown = format.is_display_encoded();
            assert_eq!(stored.receipt, receipt().shown_by(is_shown.then(Display::default).as_ref()), "{format:?}");
            assert_eq!((stored.film, stored.window), (picture.film, picture.window));
        }
    }

    #[test]
    fn only_files_of_8_and_16_bits_say_how_they_show_the_film() {
        let picture = whole(3, 2, |x, _| [x as f32, 0.5, 0.25, 1.0]);
        let bright = Display { exposure: 1.5, ..Display::default() };
        for format in FORMATS.into_iter().filter(|&f| built(f)) {
            let of = |display: &Display, receipt: &Receipt| picture.encode(format, display, receipt).unwrap();
            let [plain, exposed] = [Display::default(), bright].map(|display| of(&display, &receipt()));
            let is_shown = format.is_display_encoded();
            assert_eq!(plain != exposed, is_shown, "{format:?}");
            let stored = StoredImage::read(&exposed).unwrap().receipt;
            let said = stored.entries.iter().find(|(key, _)| key == "display").map(|(_, value)| value.as_str());
            assert_eq!(said, is_shown.then_some("srgb, exposure 1.5"), "{format:?}");
            // What another file said of it does not come along
            assert!(of(&Display::default(), &stored) == plain, "{format:?}");
        }
    }

    #[test]
    fn our_own_pictures_are_known_by_their_receipts() {
        let picture = whole(3, 2, |_, _| [0.5; 4]);
        let is_ours = |bytes: &[u8]| Receipt::is_in_png(&mut &bytes[..]);
        for format in [Format::Png8, Format::Png16] {
            let ours = picture.encode(format, &Display::default(), &receipt()).unwrap();
            assert!(is_ours(&ours));
            for length in 0..ours.len() {
                is_ours(&ours[..length]);
            }
        }
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/images");
        for name in ["basn2c08.png", "bricks-color.png", "bricks-color.jpeg"] {
            assert!(!is_ours(&std::fs::read(folder.join(name)).unwrap()), "{name}");
        }
        assert!(!is_ours(b"") && !is_ours(b"\x89PNG\r\n\x1a\n\xff\xff\xff\xffiTXt"));
    }

    #[test]
    fn no_number_breaks_an_encoder() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, -0.0, 1e-45, 1e-38, f32::MAX, 0.5];
        let picture = whole(10, 10, |x, y| [odd[x as usize], odd[y as usize], 0.5, odd[(x + y) as usize % 10]]);
        let display = Display::default();
        for format in FORMATS.into_iter().filter(|&f| built(f)) {
            let bytes = picture.encode(format, &display, &Receipt::default()).unwrap();
            let stored = StoredImage::read(&bytes).unwrap();
            if matches!(format, Format::Exr | Format::Npz) {
                let bits = |p: &[[f32; 4]]| p.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert!(bits(&stored.pixels) == bits(&picture.pixels));
            } else {
                assert!(stored.pixels.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
            }
        }
    }
}

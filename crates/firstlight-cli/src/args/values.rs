//! What stands behind an option, read: numbers in their ranges, pairs, names; or what is allowed instead.

use std::ops::RangeInclusive;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use firstlight::{BufferDesc, ColorDesc, Framing, MotionTo, SamplesDesc, SimdLevel, View, VisibilityMode, Window};

/// Reads whole numbers from `least` to `most`.
pub(super) fn whole<T>(least: T, most: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: std::str::FromStr + PartialOrd + std::fmt::Display + Copy + Send + Sync + 'static,
{
    move |text| match text.parse::<T>() {
        Ok(n) if least <= n && n <= most => Ok(n),
        _ => Err(format!("a whole number from {least} to {most} is needed")),
    }
}

/// Reads an angle in degrees.
pub(super) fn angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(angle) if (0.0..=180.0).contains(&angle) => Ok(angle),
        _ => Err("an angle is a number of degrees, 0 to 180".into()),
    }
}

/// Reads how shadows are found.
pub(super) fn visibility() -> impl TypedValueParser<Value = VisibilityMode> {
    PossibleValuesParser::new(VisibilityMode::ALL.iter().map(|mode| mode.name()))
        .map(|name| VisibilityMode::from_name(&name).unwrap_or(VisibilityMode::Shafts))
}

/// Reads the name of a buffer.
pub(super) fn buffer(name: &str) -> Result<BufferDesc, String> {
    BufferDesc::parse(name).map_err(|(fault, hint)| hint.map_or(fault.clone(), |hint| format!("{fault}; {hint}")))
}

/// Reads whereto motion leads: what reads as a number is a time.
pub(super) fn motion_to(text: &str) -> Result<MotionTo, String> {
    if text.parse::<f64>().is_ok() {
        return time(text).map(MotionTo::Time);
    }
    MotionTo::from_name(text).ok_or("a time in seconds, next, previous, or the name of a camera is needed".into())
}

/// Reads the number of samples, or the word for none.
pub(super) fn samples(text: &str) -> Result<SamplesDesc, String> {
    if text == "exact" {
        return Ok(SamplesDesc::Exact);
    }
    whole(1, 1_048_576)(text).map(SamplesDesc::Count).map_err(|needed| format!("{needed}, or the word exact"))
}

/// Reads the name of a camera; one without a name cannot be asked for.
pub(super) fn camera(name: &str) -> Result<String, String> {
    if name.is_empty() { Err("the name of a camera of the scene is needed".into()) } else { Ok(name.to_owned()) }
}

/// Reads an exposure in stops.
pub(super) fn exposure(text: &str) -> Result<f64, String> {
    number(text, -64.0..=64.0, "a number of stops from -64 to 64 is needed")
}

/// Reads the ends of a legend.
pub(super) fn range(text: &str) -> Result<[f64; 2], String> {
    let range = numbers::<2>(text).filter(|[low, high]| low < high);
    range.ok_or_else(|| "two numbers A,B are needed, the lower one first, as 0,10".into())
}

/// Reads a number of a range; `wanted` says which are.
fn number(text: &str, range: RangeInclusive<f64>, wanted: &str) -> Result<f64, String> {
    text.parse().ok().filter(|number| range.contains(number)).ok_or_else(|| wanted.to_owned())
}

/// Reads a scale of depth in units per metre.
pub(super) fn depth_scale(text: &str) -> Result<f64, String> {
    number(text, 1e-3..=1e6, "a number of units per metre from 0.001 to 1000000 is needed; 1000 are millimetres")
}

/// Reads the quality of JPEG files.
pub(super) fn quality(text: &str) -> Result<u8, String> {
    let quality = text.parse().ok().filter(|quality| (1..=100).contains(quality));
    quality.ok_or_else(|| {
        "a whole number from 1 to 100 is needed, of JPEG files; how much a render does is --aa N and --aa-mode full"
            .into()
    })
}

/// Reads a tolerance in display steps.
pub(super) fn tolerance(text: &str) -> Result<f64, String> {
    number(text, 0.25..=16.0, "a number of display steps from 0.25 to 16 is needed")
}

/// Reads a moment in seconds.
pub(super) fn time(text: &str) -> Result<f64, String> {
    number(text, -1e9..=1e9, "a number of seconds from -1e9 to 1e9 is needed")
}

/// The numbers of frames, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    /// The first.
    pub first: u32,
    /// The last, not before the first.
    pub last: u32,
}

/// No frame has a larger number.
const MAX_FRAME: u32 = 9_999_999;
/// Nor are there more in one run.
const MAX_FRAMES: u32 = 100_000;

/// Reads `A..B`, or one number alone.
pub(super) fn frames(text: &str) -> Result<Frames, String> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let number = |part: &str| part.trim().parse::<u32>().ok().filter(|n| *n <= MAX_FRAME);
    match (number(first), number(last)) {
        (Some(first), Some(last)) if first <= last && last - first >= MAX_FRAMES => {
            Err(format!("at most {MAX_FRAMES} frames can be rendered in one run"))
        }
        (Some(first), Some(last)) if first <= last => Ok(Frames { first, last }),
        (Some(first), Some(last)) => Err(format!("the last frame, {last}, comes before the first, {first}")),
        _ => Err(format!("two whole numbers A..B from 0 to {MAX_FRAME} are needed, as 0..47; both are rendered")),
    }
}

/// A part of the pictures of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1 on.
    pub index: u64,
    /// Of how many.
    pub count: u64,
}

impl Shard {
    /// Whether the picture of that number, counted from 0, is one of its.
    pub fn has(self, picture: u64) -> bool {
        picture % self.count == self.index - 1
    }
}

/// Reads `I/N`.
pub(super) fn shard(text: &str) -> Result<Shard, String> {
    let number = |part: &str| part.trim().parse::<u64>().ok();
    match text.split_once('/').and_then(|(index, count)| number(index).zip(number(count))) {
        Some((index, count)) if (1..=count).contains(&index) => Ok(Shard { index, count }),
        Some((0, 1..)) => Err("shards count from 1: the first of four is 1/4".into()),
        Some((index, count)) if count > 0 => {
            Err(format!("there is no shard {index} of {count}: they are 1 to {count}"))
        }
        _ => Err("two whole numbers I/N are needed, as 1/4 for the first of four".into()),
    }
}

/// Reads how long a picture may take.
pub(super) fn limit_of_time(text: &str) -> Result<f64, String> {
    number(text, 1e-3..=1e9, "a number of seconds from 0.001 to 1e9 is needed")
}

/// Reads the largest difference that is allowed.
pub(super) fn limit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(limit) if limit >= 0.0 && limit.is_finite() => Ok(limit),
        _ => Err("a number of at least 0 is needed".into()),
    }
}

/// Reads a number from 0 to 1.
pub(super) fn part(text: &str) -> Result<f64, String> {
    number(text, 0.0..=1.0, "a number from 0 to 1 is needed")
}

/// Reads how many pixels there are in a degree.
pub(super) fn pixels_per_degree(text: &str) -> Result<f64, String> {
    number(text, 1.0..=1000.0, "a number of pixels from 1 to 1000 is needed")
}

/// Reads `X,Y,WIDTH,HEIGHT`. Whether the film is that large is seen once the scene is known.
pub(super) fn crop(text: &str) -> Result<Window, String> {
    let wanted = "four whole numbers X,Y,WIDTH,HEIGHT are needed, in pixels, WIDTH and HEIGHT at least 1";
    let numbers: Vec<u32> = text.split(',').map(|n| n.trim().parse()).collect::<Result<_, _>>().map_err(|_| wanted)?;
    match numbers[..] {
        [x, y, width, height] if width > 0 && height > 0 => Ok(Window { x, y, width, height }),
        _ => Err(wanted.into()),
    }
}

/// `--size`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Pixels along the longer side.
    Longer(u32),
    /// Pixels across and down.
    Both(u32, u32),
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Size::Longer(side) => write!(f, "{side}"),
            Size::Both(width, height) => write!(f, "{width}x{height}"),
        }
    }
}

/// Reads `PIXELS`, or `WIDTHxHEIGHT`.
pub(super) fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| whole::<u32>(1, 65536)(text).ok();
    let read = match text.split_once(['x', 'X']) {
        Some((width, height)) => side(width).zip(side(height)).map(|(width, height)| Size::Both(width, height)),
        None => side(text).map(Size::Longer),
    };
    read.ok_or_else(|| "one whole number, as 256, or two, as 256x512, are needed, from 1 to 65536".into())
}

/// Reads numbers with commas between, all of them finite.
pub(super) fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text.split(',').map(|n| n.trim().parse()).collect::<Result<_, _>>().ok()?;
    <[f64; N]>::try_from(numbers).ok().filter(|numbers| numbers.iter().all(|n| n.is_finite()))
}

/// Reads a colour.
pub fn color(text: &str) -> Result<ColorDesc, String> {
    let linear = || numbers::<3>(text).filter(|rgb| rgb.iter().all(|c| (0.0..=1e6).contains(c))).map(ColorDesc::from);
    ColorDesc::from_css(text).or_else(linear).ok_or_else(|| {
        let is_word = text.chars().all(|c| c.is_ascii_alphabetic());
        let near = ColorDesc::nearest_css_name(text).filter(|_| is_word);
        let near = near.map(|near| format!("did you mean {near}? ")).unwrap_or_default();
        format!(
            "{near}a colour is '#336699' or '#369' (hexadecimal digits, sRGB), a name of CSS such as orange, or three \
             numbers R,G,B from 0 to 1e6 (linear)"
        )
    })
}

/// A view by its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedView {
    /// As it was written.
    pub name: &'static str,
    /// What it means.
    pub view: View,
}

/// Reads the name of a view.
pub(super) fn named_view(text: &str) -> Result<NamedView, String> {
    let named = View::NAMED.iter().find(|(name, _)| *name == text);
    named.map(|(name, view)| NamedView { name, view: *view }).ok_or_else(|| {
        let names: Vec<&str> = View::NAMED.iter().map(|(name, _)| *name).collect();
        format!("names are needed, with commas between: {}; a view of two angles is a --view", names.join(", "))
    })
}

/// Reads where an automatic camera looks from.
pub(super) fn view(text: &str) -> Result<View, String> {
    let angles = || numbers::<2>(text).filter(|[azimuth, elevation]| azimuth.abs() <= 360.0 && elevation.abs() <= 90.0);
    View::from_name(text).or_else(|| angles().map(|[azimuth, elevation]| View::new(azimuth, elevation))).ok_or_else(
        || {
            let names: Vec<&str> = View::NAMED.iter().map(|(name, _)| *name).collect();
            format!(
                "one of {}, or two angles AZIMUTH,ELEVATION from -360 to 360 and from -90 to 90 degrees are needed",
                names.join(", ")
            )
        },
    )
}

/// Reads a part of the picture's shorter side.
pub(super) fn margin(text: &str) -> Result<f64, String> {
    number(text, 0.0..=Framing::MAX_MARGIN, "a part of the picture's shorter side is needed, from 0 to 0.45")
}

/// Reads the name of a SIMD level; completions and help list them all, whatever this machine has.
#[derive(Clone)]
pub(super) struct SimdParser;

impl clap::builder::TypedValueParser for SimdParser {
    type Value = SimdLevel;

    fn parse_ref(
        &self,
        cmd: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<SimdLevel, clap::Error> {
        let names = clap::builder::PossibleValuesParser::new(SimdLevel::ALL.iter().map(|level| level.name()));
        let name = names.parse_ref(cmd, arg, value)?;
        SimdLevel::from_name(&name).ok_or_else(|| clap::Error::new(clap::error::ErrorKind::InvalidValue))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = clap::builder::PossibleValue> + '_>> {
        Some(Box::new(SimdLevel::ALL.iter().map(|level| clap::builder::PossibleValue::new(level.name()))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_is_four_numbers_with_some_pixels() {
        assert_eq!(crop("1,2,3,4"), Ok(Window { x: 1, y: 2, width: 3, height: 4 }));
        for bad in ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,0", "-1,2,3,4", "1,2,3,x", "1.5,0,1,1"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn frames_are_two_numbers_in_their_order() {
        assert_eq!(frames("0..47"), Ok(Frames { first: 0, last: 47 }));
        assert_eq!(frames("7..7"), frames("7"));
        for bad in [
            "",
            "..",
            "1..",
            "..2",
            "2..1",
            "-1..2",
            "1..2..3",
            "1...2",
            "1..=2",
            "0..10000000",
            "0..100000",
            "a..b",
            "1.5..2",
        ] {
            assert!(frames(bad).is_err(), "{bad}");
        }
        assert!(time("-0.5").is_ok() && time("inf").is_err() && time("nan").is_err() && time("2e9").is_err());
    }

    #[test]
    fn shards_are_parts_of_a_whole() {
        assert_eq!(shard("2/3"), Ok(Shard { index: 2, count: 3 }));
        for bad in ["", "1", "/", "1/", "/2", "0/2", "3/2", "0/0", "1/0", "-1/2", "1/2/3", "a/b", "1.5/2"] {
            assert!(shard(bad).is_err(), "{bad}");
        }
        // Every picture is in one of them
        for picture in 0..10 {
            assert_eq!((1..=4).filter(|index| Shard { index: *index, count: 4 }.has(picture)).count(), 1);
        }
        assert!(limit("0").is_ok() && limit("-1").is_err() && limit("nan").is_err() && limit("inf").is_err());
        assert!(part("1").is_ok() && part("1.1").is_err() && part("nan").is_err());
        assert!(pixels_per_degree("67").is_ok() && pixels_per_degree("0.5").is_err());
    }

    #[test]
    fn a_size_is_one_side_or_both() {
        assert_eq!((size("256"), size("256x512")), (Ok(Size::Longer(256)), Ok(Size::Both(256, 512))));
        for bad in ["", "0", "65537", "x", "1x", "x1", "1x2x3", "1x0", "-1", "1.5", "256 512"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_colour_is_srgb_or_linear() {
        assert_eq!((color("#ffffff"), color("0, 0.5,2")), (Ok(ColorDesc::WHITE), Ok(ColorDesc::linear(0.0, 0.5, 2.0))));
        for white in ["#fff", "white", "White"] {
            assert_eq!(color(white), Ok(ColorDesc::WHITE), "{white}");
        }
        for bad in [
            "",
            "whites",
            "transparent",
            "#ff",
            "ffffff",
            "#gggggg",
            "1,2",
            "1,2,3,4",
            "-1,0,0",
            "nan,0,0",
            "1e7,0,0",
            "0.5",
        ] {
            assert!(color(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_view_is_a_name_or_two_angles() {
        assert_eq!((view("left"), view("-30,15.5")), (Ok(View::new(-90.0, 0.0)), Ok(View::new(-30.0, 15.5))));
        assert_eq!((view("side"), view("three-quarter")), (view("right"), Ok(View::default())));
        assert_eq!(named_view("side"), Ok(NamedView { name: "side", view: View::new(90.0, 0.0) }));
        assert!(named_view("30,15").is_err() && named_view("Left").is_err());
        for bad in ["", "Left", "above", "30", "1,2,3", "0,91", "361,0", "nan,0", "inf,0"] {
            assert!(view(bad).is_err(), "{bad}");
        }
        assert!(margin("0").is_ok() && margin("0.45").is_ok() && margin("0.5").is_err() && margin("-0.1").is_err());
    }

    #[test]
    fn an_exposure_is_finite_and_in_range() {
        assert_eq!(exposure("-1.5"), Ok(-1.5));
        for bad in ["", "nan", "inf", "65", "-64.1", "1,5"] {
            assert!(exposure(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_tolerance_is_in_range() {
        assert_eq!((tolerance("4"), tolerance("0.25")), (Ok(4.0), Ok(0.25)));
        for bad in ["", "nan", "inf", "0", "0.2", "16.1", "-1", "1/4"] {
            assert!(tolerance(bad).is_err(), "{bad}");
        }
    }
}

//! The values a field of the scene text can have, beyond plain numbers, words and arrays.

use crate::color::{CSS_COLORS, Encoding, Rgb, css_color};
use serde_json::{Value as Json, json};

use super::node::{Data, Node, quoted};
use super::read::{Reader, Value, nearest};
use super::write::TextValue;

/// A colour: linear Rec. 709. In text `[r, g, b]` is linear; `"#rrggbb"`, `"#rgb"` and the names of CSS, such as
/// `"orange"`, are sRGB; and a number is that much gray (linear).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorDesc {
    /// Red, green, blue; linear, 0 or more.
    pub linear: [f64; 3],
}

impl ColorDesc {
    /// No light.
    pub const BLACK: ColorDesc = ColorDesc::gray(0.0);
    /// 1 in every channel.
    pub const WHITE: ColorDesc = ColorDesc::gray(1.0);

    /// From linear channels.
    pub const fn linear(r: f64, g: f64, b: f64) -> Self {
        Self { linear: [r, g, b] }
    }

    /// The colour that CSS has for `#rrggbb`, `#rgb` or one of its 148 names, in any case: all of them are sRGB. `None`
    /// for all else, `transparent` among it.
    pub fn from_css(text: &str) -> Option<Self> {
        let rgb = match text.strip_prefix('#') {
            Some(digits) => hex_bytes(digits.as_bytes())?,
            None => css_color(text)?,
        };
        Some(rgb.map(|byte| Encoding::Srgb.decode(f64::from(byte) / 255.0)).into())
    }

    /// The name of CSS nearest to `text`, if one is near enough to have been meant.
    pub fn nearest_css_name(text: &str) -> Option<&'static str> {
        nearest(text, &CSS_COLORS.map(|(name, _)| name))
    }

    /// The same linear value in all channels.
    pub const fn gray(v: f64) -> Self {
        Self::linear(v, v, v)
    }
}

/// The bytes of `rrggbb`, or of `rgb`, in which each digit stands for two.
fn hex_bytes(digits: &[u8]) -> Option<[u8; 3]> {
    let digit = |at: usize| char::from(digits[at]).to_digit(16).map(|digit| digit as u8);
    let byte = |high: usize, low: usize| Some(16 * digit(high)? + digit(low)?);
    match digits.len() {
        3 => Some([byte(0, 0)?, byte(1, 1)?, byte(2, 2)?]),
        6 => Some([byte(0, 1)?, byte(2, 3)?, byte(4, 5)?]),
        _ => None,
    }
}

impl From<[f64; 3]> for ColorDesc {
    /// Linear red, green, blue.
    fn from([r, g, b]: [f64; 3]) -> Self {
        Self::linear(r, g, b)
    }
}

impl From<ColorDesc> for Rgb {
    fn from(color: ColorDesc) -> Self {
        let [r, g, b] = color.linear.map(|x| x as f32);
        Rgb::new(r, g, b)
    }
}

impl From<f64> for ColorDesc {
    /// Linear gray.
    fn from(v: f64) -> Self {
        Self::gray(v)
    }
}

/// The forms of a colour, as messages list them.
pub(crate) const COLOR_FORMS: &str = " ([r, g, b], \"#rrggbb\", \"#rgb\", a name of CSS or a gray)";

/// The JSON Schema of a colour, which that of every field refers to as `color`.
pub(crate) fn color_schema() -> Json {
    json!({
        "description": "Linear [r, g, b], \"#rrggbb\", \"#rgb\" or a name of CSS in sRGB, or a linear gray.",
        "anyOf": [
            { "type": "array", "items": { "type": "number", "minimum": 0 }, "minItems": 3, "maxItems": 3 },
            { "type": "string", "pattern": "^#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})$" },
            { "enum": CSS_COLORS.map(|(name, _)| name).as_slice() },
            { "type": "number", "minimum": 0 },
        ],
    })
}

impl Value for ColorDesc {
    fn words() -> String {
        format!("a colour{COLOR_FORMS}")
    }

    fn plural() -> String {
        format!("colours{COLOR_FORMS}")
    }

    fn schema() -> Json {
        json!({ "$ref": "#/$defs/color" })
    }

    fn placeholder() -> Self {
        Self::BLACK
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        match &node.data {
            _ if node.len() == Some(3) => <[f64; 3]>::read(node, reader).map(Self::from),
            Data::Number(_) => f64::read(node, reader).map(Self::gray),
            Data::String(text) => {
                let color = Self::from_css(text);
                if color.is_none() {
                    let message = format!("{} is not a colour", quoted(text));
                    let near = match text.strip_prefix('#') {
                        None => Self::nearest_css_name(text).map(|near| format!("did you mean \"{near}\"? ")),
                        Some(_) => None,
                    };
                    let hint = format!(
                        "{}a string colour is \"#rrggbb\" or \"#rgb\" with hexadecimal digits, as \"#ff8000\", or a \
                         name of CSS, as \"orange\"; a linear one is [r, g, b]",
                        near.unwrap_or_default()
                    );
                    reader.error(node.span, message, Some(hint));
                }
                color
            }
            _ => {
                reader.wrong_type(node, &Self::words(), None);
                None
            }
        }
    }

    fn write(&self) -> TextValue {
        let [r, g, b] = self.linear;
        if r == g && g == b { r.write() } else { self.linear.write() }
    }
}

/// A scale along the three axes. In text `[x, y, z]`, or one number for all three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleDesc {
    /// Along x, y and z; a negative one mirrors.
    pub xyz: [f64; 3],
}

impl ScaleDesc {
    /// As large as before.
    pub const ONE: ScaleDesc = ScaleDesc { xyz: [1.0; 3] };
}

impl From<f64> for ScaleDesc {
    /// The same along all three axes.
    fn from(scale: f64) -> Self {
        Self { xyz: [scale; 3] }
    }
}

impl From<[f64; 3]> for ScaleDesc {
    /// Along x, y and z.
    fn from(xyz: [f64; 3]) -> Self {
        Self { xyz }
    }
}

impl Value for ScaleDesc {
    fn words() -> String {
        "a number or [x, y, z]".into()
    }

    fn plural() -> String {
        "numbers or [x, y, z]".into()
    }

    fn schema() -> Json {
        json!({ "anyOf": [f64::schema(), <[f64; 3]>::schema()] })
    }

    fn placeholder() -> Self {
        Self::ONE
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        match &node.data {
            Data::Number(_) => f64::read(node, reader).map(Self::from),
            _ if node.len() == Some(3) => <[f64; 3]>::read(node, reader).map(Self::from),
            _ => {
                reader.wrong_type(node, &Self::words(), None);
                None
            }
        }
    }

    fn write(&self) -> TextValue {
        let [x, y, z] = self.xyz;
        // By their bits: -0 is 0, but is written differently
        let same = x.to_bits() == y.to_bits() && y.to_bits() == z.to_bits();
        if same { x.write() } else { self.xyz.write() }
    }
}

/// How area lights are sampled. In text a whole number, or `"exact"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SamplesDesc {
    /// They are integrated, not sampled.
    Exact,
    /// A fixed set of so many points.
    Count(u32),
}

/// The word for [`SamplesDesc::Exact`] in scene text.
const EXACT: &str = "exact";

impl From<u32> for SamplesDesc {
    /// So many points.
    fn from(count: u32) -> Self {
        Self::Count(count)
    }
}

impl std::fmt::Display for SamplesDesc {
    /// As scene text says it, without quotes.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Exact => f.write_str(EXACT),
            Self::Count(count) => count.fmt(f),
        }
    }
}

impl Value for SamplesDesc {
    fn words() -> String {
        format!("a whole number or \"{EXACT}\"")
    }

    fn plural() -> String {
        format!("whole numbers or \"{EXACT}\"")
    }

    fn schema() -> Json {
        json!({ "anyOf": [u32::schema(), { "enum": [EXACT] }] })
    }

    fn placeholder() -> Self {
        Self::Count(1)
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        match &node.data {
            Data::Number(_) => u32::read(node, reader).map(Self::Count),
            Data::String(word) if word == EXACT => Some(Self::Exact),
            Data::String(word) => {
                let hint = if word.parse::<u32>().is_ok() {
                    Some("leave the quotes out".into())
                } else {
                    nearest(word, &[EXACT]).map(|near| format!("did you mean \"{near}\"?"))
                };
                reader.error(node.span, format!("{} is not {}", quoted(word), Self::words()), hint);
                None
            }
            _ => {
                reader.wrong_type(node, &Self::words(), None);
                None
            }
        }
    }

    fn write(&self) -> TextValue {
        match self {
            Self::Exact => TextValue::Text(EXACT.to_owned()),
            Self::Count(count) => count.write(),
        }
    }
}

super::words! {
    /// The number that a parameter takes from the four of a texture.
    pub enum Channel {
        /// Red: of a gray picture, its gray.
        R = "r",
        /// Green.
        G = "g",
        /// Blue.
        B = "b",
        /// Alpha, as it is stored: 0 to 1.
        A = "a",
        /// 0.2126 red + 0.7152 green + 0.0722 blue: the luminance of Rec. 709.
        Luminance = "luminance",
    }
}

/// A parameter that a texture can drive: a constant, or `{ texture = "NAME", factor = ... }`, the texture times a
/// factor. A number also takes `channel` and `bias`: channel x factor + bias.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamDesc<T> {
    /// The texture's name, if a texture drives it.
    pub texture: Option<String>,
    /// The constant, or the factor of the texture (1 unless said).
    pub factor: T,
    /// Which number of the texture a number is; `r` unless said. Of colours nothing.
    pub channel: Channel,
    /// Added to a number after the factor, from -1e6 to 1e6; 0 unless said. Of colours nothing.
    pub bias: f64,
}

/// A colour that a texture can drive.
pub type ColorParam = ParamDesc<ColorDesc>;
/// A number that a texture can drive.
pub type NumberParam = ParamDesc<f64>;

impl<T> ParamDesc<T> {
    /// The same everywhere.
    pub const fn constant(value: T) -> Self {
        Self { texture: None, factor: value, channel: Channel::R, bias: 0.0 }
    }
}

impl ColorParam {
    /// The same linear gray everywhere.
    pub const fn gray(v: f64) -> Self {
        Self::constant(ColorDesc::gray(v))
    }

    /// The texture `name`, as it is.
    pub fn texture(name: impl Into<String>) -> Self {
        Self { texture: Some(name.into()), ..Self::constant(ColorDesc::WHITE) }
    }
}

impl NumberParam {
    /// The texture `name`, as it is.
    pub fn texture(name: impl Into<String>) -> Self {
        Self { texture: Some(name.into()), ..Self::constant(1.0) }
    }

    /// One channel of the texture `name`, as it is.
    pub fn channel(name: impl Into<String>, channel: Channel) -> Self {
        Self { channel, ..Self::texture(name) }
    }
}

impl<T> From<T> for ParamDesc<T> {
    fn from(value: T) -> Self {
        Self::constant(value)
    }
}

impl From<[f64; 3]> for ColorParam {
    /// Linear red, green, blue, the same everywhere.
    fn from(linear: [f64; 3]) -> Self {
        Self::constant(linear.into())
    }
}

/// What a texture can drive, and the factor that leaves a texture as it is.
trait Factor: Value {
    const ONE: Self;
    /// The keys of its table.
    const KEYS: &'static [&'static str];
}

impl Factor for f64 {
    const ONE: Self = 1.0;
    const KEYS: &'static [&'static str] = &["texture", "channel", "factor", "bias"];
}

impl Factor for ColorDesc {
    const ONE: Self = ColorDesc::WHITE;
    const KEYS: &'static [&'static str] = &["texture", "factor"];
}

impl<T: Factor> Value for ParamDesc<T> {
    fn words() -> String {
        format!("{} or {{ texture = \"NAME\", factor = ... }}", T::words())
    }

    fn plural() -> String {
        format!("{} or {{ texture = \"NAME\", factor = ... }}", T::plural())
    }

    fn schema() -> Json {
        let mut properties = json!({ "texture": { "type": "string" }, "factor": T::schema() });
        if T::KEYS.contains(&"channel") {
            (properties["channel"], properties["bias"]) = (Channel::schema(), f64::schema());
        }
        let textured = json!({
            "type": "object",
            "properties": properties,
            "required": ["texture"],
            "additionalProperties": false,
        });
        json!({ "anyOf": [T::schema(), textured] })
    }

    fn placeholder() -> Self {
        Self::constant(T::placeholder())
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Some(entries) = node.entries() else {
            return T::read(node, reader).map(Self::constant);
        };
        let meant = reader.unknown_keys(entries, T::KEYS, "a textured value");
        let texture = match node.get("texture") {
            Some(name) => reader.within("texture", |r| String::read(name, r)),
            None if meant.contains(&"texture") => None,
            None => {
                let hint = "write `texture = \"NAME\"`, or the value without a table";
                reader.error(node.span, "\"texture\" is missing", Some(hint.into()));
                None
            }
        };
        let found = ["factor", "channel", "bias"]
            .map(|key| node.get(key).filter(|_| T::KEYS.contains(&key)).map(|node| (node, key)));
        fn value<V: Value>(found: Option<(&Node, &str)>, reader: &mut Reader<'_>, default: V) -> Option<V> {
            found.map_or(Some(default), |(node, key)| reader.within(key, |r| V::read(node, r)))
        }
        let factor = value(found[0], reader, T::ONE);
        let channel = value(found[1], reader, Channel::R);
        let bias = value(found[2], reader, 0.0);
        Some(Self { texture: Some(texture?), factor: factor?, channel: channel?, bias: bias? })
    }

    fn write(&self) -> TextValue {
        let Some(name) = &self.texture else {
            return self.factor.write();
        };
        let mut fields = vec![("texture", name.write())];
        let mut add = |is_default: bool, key: &'static str, value: TextValue| {
            if !is_default && T::KEYS.contains(&key) {
                fields.push((key, value));
            }
        };
        add(self.channel == Channel::R, "channel", self.channel.write());
        add(self.factor == T::ONE, "factor", self.factor.write());
        add(self.bias == 0.0, "bias", self.bias.write());
        TextValue::Table(fields)
    }
}

/// A file a scene names: with `/` between folders, relative to the scene's folder. In an included text it is written
/// relative to that text's own folder.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct FilePath(pub String);

impl From<&str> for FilePath {
    fn from(path: &str) -> Self {
        Self(path.to_owned())
    }
}

impl From<String> for FilePath {
    fn from(path: String) -> Self {
        Self(path)
    }
}

/// A path written in a text of `folder`, relative to the folder that `folder` is relative to; by its words alone, so
/// that `a/../b` is `b` even where `a` is a link.
pub(crate) fn join_path(folder: &str, path: &str) -> String {
    if folder.is_empty() || std::path::Path::new(path).has_root() {
        return path.to_owned();
    }
    normalized(&format!("{folder}/{path}"))
}

/// Without `.`, and without `..` after a folder.
pub(crate) fn normalized(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "." => {}
            "" if !parts.is_empty() => {}
            ".." if parts.last().is_some_and(|last| !matches!(*last, ".." | "")) => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts.join("/")
}

impl Value for FilePath {
    fn words() -> String {
        "a file (a string)".into()
    }

    fn plural() -> String {
        "files (strings)".into()
    }

    fn schema() -> Json {
        json!({ "type": "string" })
    }

    fn placeholder() -> Self {
        Self(String::new())
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let path = String::read(node, reader)?;
        Some(Self(join_path(reader.folder(), &path)))
    }

    fn write(&self) -> TextValue {
        self.0.write()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_css_are_srgb() {
        let of = ColorDesc::from_css;
        assert_eq!(["#ffffff", "#fff", "white"].map(of), [Some(ColorDesc::WHITE); 3]);
        assert_eq!(["#000000", "#000", "Black"].map(of), [Some(ColorDesc::BLACK); 3]);
        // Each digit of three stands for two
        assert_eq!(of("#18f"), of("#1188ff"));
        assert_eq!(of("RebeccaPurple"), of("#639"));
        // 188 of 255 is half of the light, the well-known middle of black and white
        let half = of("#bcbcbc").expect("is a colour").linear[0];
        assert!((half - 0.502886).abs() < 1e-6, "{half}");
        assert_eq!(of("#0a0A0a").expect("is a colour").linear[0], 10.0 / 255.0 / 12.92);
        for bad in
            ["", "#", "ffffff", "#ggg", "#ggffff", "#ffff", "#fffffff", "#\u{e4}\u{e4}\u{e4}", "#red", "transparent"]
        {
            assert_eq!(of(bad), None, "{bad}");
        }
        assert_eq!(ColorDesc::nearest_css_name("grene"), Some("green"));
    }

    #[test]
    fn included_paths_start_at_the_scene() {
        assert_eq!(join_path("", "a/../b.png"), "a/../b.png");
        assert_eq!(join_path("parts", "b.png"), "parts/b.png");
        assert_eq!(join_path("parts", "../b.png"), "b.png");
        assert_eq!(join_path("parts", "../../b.png"), "../b.png");
        assert_eq!(join_path("parts/x", "./y//b.png"), "parts/x/y/b.png");
        assert_eq!(join_path("parts", "/etc/b.png"), "/etc/b.png");
    }
}

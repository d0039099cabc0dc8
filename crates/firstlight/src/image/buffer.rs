//! What can be asked for of each pixel: a plane that every scene has, what one of its lights sends, or how much of it
//! one of its objects covers.

use serde_json::{Value as Json, json};

use super::Plane;
use crate::describe::node::{Data, Node, quoted};
use crate::describe::read::Reader;
use crate::describe::{Choice, TextValue, Value, Words, nearest, words};
use crate::ids::{LightGroupId, LightId, SurfaceId};

words! {
    /// A part of what a light sends, as the picture shows it, or what becomes of it.
    pub enum LightPart {
        /// What the diffuse reflection of surfaces makes of it.
        Diffuse = "diffuse",
        /// What highlights make of it.
        Specular = "specular",
        /// What it would send if nothing cast shadows.
        Unshadowed = "unshadowed",
        /// The share of that which arrives, 0 to 1; 0 where nothing would.
        Visibility = "visibility",
        /// What the diffuse reflection makes of it before the light's own scale, its colour and strength.
        UnscaledDiffuse = "unscaled-diffuse",
        /// What highlights make of it before that.
        UnscaledSpecular = "unscaled-specular",
    }
}

impl LightPart {
    /// Of parts that are of one moment of the light: which.
    pub(crate) fn moment(self) -> Option<usize> {
        match self {
            LightPart::Diffuse | LightPart::UnscaledDiffuse => Some(0),
            LightPart::Specular | LightPart::UnscaledSpecular => Some(1),
            LightPart::Unshadowed | LightPart::Visibility => None,
        }
    }

    /// Whether the light's scale is left out.
    pub(crate) fn is_unscaled(self) -> bool {
        matches!(self, LightPart::UnscaledDiffuse | LightPart::UnscaledSpecular)
    }
}

/// A buffer: what a plane of the film says of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Buffer {
    /// One that every scene has.
    Plane(Plane),
    /// What of the picture one light sends, its own sight left out: all of it or a part.
    Light(LightId, Option<LightPart>),
    /// The same of a group of lights.
    Group(LightGroupId, Option<LightPart>),
    /// The share of the pixel's camera rays that meet one object first: a shape or a light.
    Coverage(SurfaceId),
}

/// A buffer as a scene may ask for it: the name of a [`Plane`]; or `light:NAME`, what one light sends, with `light:#3`
/// for the third in scene order and `light:*` for all of them, each apart. `light:NAME:diffuse` is a part of it, see
/// [`LightPart`]. `group:NAME` is what the lights of a group send together. `coverage:NAME` is the share of the pixel
/// that an object covers: a shape, one that an instance places, or a light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BufferDesc {
    /// One that every scene has.
    Plane(Plane),
    /// What of the picture a light sends.
    Light {
        /// Which light.
        light: LightChoice,
        /// Which part of it; `None` for all.
        part: Option<LightPart>,
    },
    /// What of it a group of lights sends.
    Group {
        /// Which group.
        group: LightChoice,
        /// Which part of it; `None` for all.
        part: Option<LightPart>,
    },
    /// How much of the pixel an object covers; of all, each that a camera can see.
    Coverage(LightChoice),
    /// All that [`relight`](crate::relight) needs: alpha, background, emission, ambient, of each light what it sends
    /// without its scale, and the coverage of those that a camera can see.
    Relight,
}

/// Which of a scene's lights, of their groups, or of its objects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LightChoice {
    /// Each of them.
    All,
    /// The one of that number in scene order, from 1 on.
    Number(u32),
    /// The one of that name.
    Name(String),
}

/// The plane that is like a part of what lights send.
fn of_lights(part: Option<LightPart>) -> Plane {
    match part {
        Some(LightPart::Specular | LightPart::UnscaledSpecular) => Plane::Specular,
        Some(LightPart::Visibility) => Plane::Shadow,
        _ => Plane::Diffuse,
    }
}

impl Buffer {
    /// The plane that has its channels, its unit and its sampling: itself, or that of all lights together, or of the
    /// background.
    pub fn plane(self) -> Plane {
        match self {
            Buffer::Plane(plane) => plane,
            Buffer::Light(_, part) | Buffer::Group(_, part) => of_lights(part),
            Buffer::Coverage(_) => Plane::BackgroundCoverage,
        }
    }

    /// Which part it is of what lights send.
    pub(crate) fn part(self) -> Option<LightPart> {
        match self {
            Buffer::Plane(_) | Buffer::Coverage(_) => None,
            Buffer::Light(_, part) | Buffer::Group(_, part) => part,
        }
    }

    /// Another part of the same; only what lights send has parts.
    pub(crate) fn with_part(self, part: Option<LightPart>) -> Buffer {
        match self {
            Buffer::Plane(_) | Buffer::Coverage(_) => self,
            Buffer::Light(light, _) => Buffer::Light(light, part),
            Buffer::Group(group, _) => Buffer::Group(group, part),
        }
    }

    /// Whether it is the sum of some of the terms of `color`.
    pub(crate) fn is_of_terms(self) -> bool {
        match self {
            Buffer::Plane(plane) => plane.is_of_terms(),
            Buffer::Coverage(_) => false,
            Buffer::Light(_, part) | Buffer::Group(_, part) => part.is_none_or(|part| part.moment().is_some()),
        }
    }
}

impl From<Plane> for Buffer {
    fn from(plane: Plane) -> Self {
        Buffer::Plane(plane)
    }
}

impl From<Plane> for BufferDesc {
    fn from(plane: Plane) -> Self {
        BufferDesc::Plane(plane)
    }
}

/// What the names of buffers of lights begin with, and of groups of them.
const LIGHT: &str = "light:";
const GROUP: &str = "group:";
/// What stands for all that a picture is lit again from.
const RELIGHT: &str = "relight";
/// What those of objects' coverage begin with.
const COVERAGE: &str = "coverage:";
/// What the names of means over camera rays end with.
const FILTERED: &str = ":filtered";

impl BufferDesc {
    /// The buffer of that name; `Err` says what is wrong with the name, and a hint.
    ///
    /// # Errors
    /// It is none.
    pub fn parse(name: &str) -> Result<Self, (String, Option<String>)> {
        if let Some(plane) = Plane::from_name(name) {
            return Ok(BufferDesc::Plane(plane));
        }
        if name == RELIGHT {
            return Ok(BufferDesc::Relight);
        }
        if let Some(plane) = name.strip_suffix(FILTERED).and_then(Plane::from_name) {
            return Err((format!("{} is no buffer: {}", quoted(name), plane.why_no_mean()), None));
        }
        let prefixed = |prefix: &'static str| Some((prefix, name.strip_prefix(prefix)?));
        let Some((prefix, chosen)) = [LIGHT, GROUP, COVERAGE].into_iter().find_map(prefixed) else {
            let known: Vec<&str> = Plane::CHOICES.iter().map(|choice| choice.word).collect();
            let hint = nearest(name, &known).map(|near| format!("did you mean \"{near}\"?"));
            return Err((format!("{} is not {}", quoted(name), Self::words()), hint));
        };
        let of_part = |part: &LightPart| Some((chosen.strip_suffix(part.name())?.strip_suffix(':')?, Some(*part)));
        let part = if prefix == COVERAGE { None } else { LightPart::ALL.iter().find_map(of_part) };
        let (chosen, part) = part.unwrap_or((chosen, None));
        let choice = match chosen.strip_prefix('#').map(str::parse) {
            _ if chosen.is_empty() => {
                let kind = match prefix {
                    LIGHT => "light",
                    GROUP => "group of lights",
                    _ => "object",
                };
                return Err((format!("{} names no {kind}", quoted(name)), None));
            }
            _ if chosen == "*" => LightChoice::All,
            Some(Ok(number)) if number > 0 => LightChoice::Number(number),
            _ => LightChoice::Name(chosen.to_owned()),
        };
        match (prefix, part) {
            (COVERAGE, _) => Ok(BufferDesc::Coverage(choice)),
            (LIGHT, part) => Ok(BufferDesc::Light { light: choice, part }),
            (_, Some(part)) if part.is_unscaled() => {
                let hint = "each light has a scale of its own: ask for them one by one, with light:NAME".to_owned();
                Err((format!("{} is not a part of a group of lights", quoted(part.name())), Some(hint)))
            }
            (_, part) => Ok(BufferDesc::Group { group: choice, part }),
        }
    }

    /// The plane that has its channels, as [`Buffer::plane`]; `None` of what is many planes.
    pub fn plane(&self) -> Option<Plane> {
        match self {
            BufferDesc::Plane(plane) => Some(*plane),
            BufferDesc::Light { part, .. } | BufferDesc::Group { part, .. } => Some(of_lights(*part)),
            BufferDesc::Coverage(_) => Some(Plane::BackgroundCoverage),
            BufferDesc::Relight => None,
        }
    }

    /// Its name, as a scene says it.
    pub fn name(&self) -> String {
        let (prefix, choice, part) = match self {
            BufferDesc::Plane(plane) => return plane.name().to_owned(),
            BufferDesc::Relight => return RELIGHT.to_owned(),
            BufferDesc::Light { light, part } => (LIGHT, light, *part),
            BufferDesc::Group { group, part } => (GROUP, group, *part),
            BufferDesc::Coverage(object) => (COVERAGE, object, None),
        };
        let choice = match choice {
            LightChoice::All => "*".to_owned(),
            LightChoice::Number(number) => format!("#{number}"),
            LightChoice::Name(name) => name.clone(),
        };
        let part = part.map(|part| format!(":{}", part.name())).unwrap_or_default();
        format!("{prefix}{choice}{part}")
    }
}

impl Value for BufferDesc {
    fn words() -> String {
        let planes = Plane::words().replace(" or ", ", ");
        format!("{planes}, \"{RELIGHT}\", \"{LIGHT}NAME\", \"{GROUP}NAME\" or \"{COVERAGE}NAME\"")
    }

    fn plural() -> String {
        format!("buffers ({})", Self::words())
    }

    fn schema() -> Json {
        let named = format!("^({RELIGHT}|({LIGHT}|{GROUP}|{COVERAGE}).+)$");
        json!({ "anyOf": [Plane::schema(), { "type": "string", "pattern": named }] })
    }

    fn choices() -> &'static [Choice] {
        Plane::CHOICES
    }

    fn placeholder() -> Self {
        BufferDesc::Plane(Plane::Color)
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        let Data::String(name) = &node.data else {
            reader.wrong_type(node, &Self::words(), None);
            return None;
        };
        match Self::parse(name) {
            Ok(buffer) => Some(buffer),
            Err((fault, hint)) => {
                reader.error(node.span, fault, hint);
                None
            }
        }
    }

    fn write(&self) -> TextValue {
        TextValue::Text(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        let light = |light, part| BufferDesc::Light { light, part };
        for (name, buffer) in [
            ("depth", BufferDesc::Plane(Plane::Depth)),
            ("light:*", light(LightChoice::All, None)),
            ("light:#12:specular", light(LightChoice::Number(12), Some(LightPart::Specular))),
            ("light:key:unscaled-diffuse", light(LightChoice::Name("key".into()), Some(LightPart::UnscaledDiffuse))),
            ("group:*:visibility", BufferDesc::Group { group: LightChoice::All, part: Some(LightPart::Visibility) }),
            ("group:sky", BufferDesc::Group { group: LightChoice::Name("sky".into()), part: None }),
            ("light:a:b", light(LightChoice::Name("a:b".into()), None)),
            ("light:a:b:diffuse", light(LightChoice::Name("a:b".into()), Some(LightPart::Diffuse))),
            ("light:#x", light(LightChoice::Name("#x".into()), None)),
            ("light:#0", light(LightChoice::Name("#0".into()), None)),
            ("coverage:background", BufferDesc::Plane(Plane::BackgroundCoverage)),
            ("coverage:*", BufferDesc::Coverage(LightChoice::All)),
            ("coverage:#7", BufferDesc::Coverage(LightChoice::Number(7))),
            ("coverage:one/ring:diffuse", BufferDesc::Coverage(LightChoice::Name("one/ring:diffuse".into()))),
            ("depth:filtered", BufferDesc::Plane(Plane::FilteredDepth)),
            ("relight", BufferDesc::Relight),
        ] {
            assert_eq!(BufferDesc::parse(name), Ok(buffer.clone()));
            assert_eq!(buffer.name(), name);
        }
        for (name, fault) in [
            ("light:", "names no light"),
            ("light::diffuse", "names no light"),
            ("group:", "names no group of lights"),
            ("coverage:", "names no object"),
            ("object-id:filtered", "an id has no mean"),
            ("color:filtered", "is a mean over the pixel as it is"),
            ("depth:filtered:filtered", "is a mean over the pixel as it is"),
            ("rays:filtered", "counted"),
            ("barycentric:filtered", "of each object's own"),
            ("group:sky:unscaled-specular", "is not a part of a group of lights"),
            ("dept", "is not \"color\""),
            ("", "is not \"color\""),
        ] {
            assert!(BufferDesc::parse(name).unwrap_err().0.contains(fault), "{name}");
        }
        assert_eq!(BufferDesc::parse("dept").unwrap_err().1.unwrap(), "did you mean \"depth\"?");
    }
}

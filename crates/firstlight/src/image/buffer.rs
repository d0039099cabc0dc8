//! What can be asked for of each pixel: a plane that every scene has, or what one of its lights sends.

use serde_json::{Value as Json, json};

use super::Plane;
use crate::describe::node::{Data, Node, quoted};
use crate::describe::read::Reader;
use crate::describe::{Choice, TextValue, Value, Words, nearest, words};
use crate::ids::LightId;

words! {
    /// A part of what a light sends, as the picture shows it.
    pub enum LightPart {
        /// What the diffuse reflection of surfaces makes of it.
        Diffuse = "diffuse",
        /// What highlights make of it.
        Specular = "specular",
    }
}

/// A buffer: what a plane of the film says of each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Buffer {
    /// One that every scene has.
    Plane(Plane),
    /// What of the picture one light sends, its own sight left out: all of it or a part.
    Light(LightId, Option<LightPart>),
}

/// A buffer as a scene may ask for it: the name of a [`Plane`]; or `light:NAME`, what one light sends, with `light:#3`
/// for the third in scene order and `light:*` for all of them, each apart. `light:NAME:diffuse` and
/// `light:NAME:specular` are its parts, see [`LightPart`].
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
}

/// Which of a scene's lights.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LightChoice {
    /// Each of them.
    All,
    /// The one of that number in scene order, from 1 on.
    Number(u32),
    /// The one of that name.
    Name(String),
}

impl Buffer {
    /// The plane that has its channels, its unit and its sampling: itself, or that of all lights together.
    pub fn plane(self) -> Plane {
        match self {
            Buffer::Plane(plane) => plane,
            Buffer::Light(_, Some(LightPart::Specular)) => Plane::Specular,
            Buffer::Light(..) => Plane::Diffuse,
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

/// What the names of buffers of lights begin with.
const LIGHT: &str = "light:";

impl BufferDesc {
    /// The buffer of that name; `Err` says what is wrong with the name, and a hint.
    ///
    /// # Errors
    /// It is none.
    pub fn parse(name: &str) -> Result<Self, (String, Option<String>)> {
        if let Some(plane) = Plane::from_name(name) {
            return Ok(BufferDesc::Plane(plane));
        }
        let Some(light) = name.strip_prefix(LIGHT) else {
            let known: Vec<&str> = Plane::CHOICES.iter().map(|choice| choice.word).collect();
            let hint = nearest(name, &known).map(|near| format!("did you mean \"{near}\"?"));
            return Err((format!("{} is not {}", quoted(name), Self::words()), hint));
        };
        let of_part = |part: &LightPart| Some((light.strip_suffix(part.name())?.strip_suffix(':')?, Some(*part)));
        let (light, part) = LightPart::ALL.iter().find_map(of_part).unwrap_or((light, None));
        let light = match light.strip_prefix('#').map(str::parse) {
            _ if light.is_empty() => return Err((format!("{} names no light", quoted(name)), None)),
            _ if light == "*" => LightChoice::All,
            Some(Ok(number)) if number > 0 => LightChoice::Number(number),
            _ => LightChoice::Name(light.to_owned()),
        };
        Ok(BufferDesc::Light { light, part })
    }

    /// Its name, as a scene says it.
    pub fn name(&self) -> String {
        match self {
            BufferDesc::Plane(plane) => plane.name().to_owned(),
            BufferDesc::Light { light, part } => {
                let light = match light {
                    LightChoice::All => "*".to_owned(),
                    LightChoice::Number(number) => format!("#{number}"),
                    LightChoice::Name(name) => name.clone(),
                };
                let part = part.map(|part| format!(":{}", part.name())).unwrap_or_default();
                format!("{LIGHT}{light}{part}")
            }
        }
    }
}

impl Value for BufferDesc {
    fn words() -> String {
        format!("{}, or \"{LIGHT}NAME\"", Plane::words().replace(" or ", ", "))
    }

    fn plural() -> String {
        format!("buffers ({})", Self::words())
    }

    fn schema() -> Json {
        json!({ "anyOf": [Plane::schema(), { "type": "string", "pattern": format!("^{LIGHT}.+$") }] })
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
            ("light:a:b", light(LightChoice::Name("a:b".into()), None)),
            ("light:a:b:diffuse", light(LightChoice::Name("a:b".into()), Some(LightPart::Diffuse))),
            ("light:#x", light(LightChoice::Name("#x".into()), None)),
            ("light:#0", light(LightChoice::Name("#0".into()), None)),
        ] {
            assert_eq!(BufferDesc::parse(name), Ok(buffer.clone()));
            assert_eq!(buffer.name(), name);
        }
        for (name, fault) in [
            ("light:", "names no light"),
            ("light::diffuse", "names no light"),
            ("dept", "is not \"color\""),
            ("", "is not \"color\""),
        ] {
            assert!(BufferDesc::parse(name).unwrap_err().0.contains(fault), "{name}");
        }
        assert_eq!(BufferDesc::parse("dept").unwrap_err().1.unwrap(), "did you mean \"depth\"?");
    }
}

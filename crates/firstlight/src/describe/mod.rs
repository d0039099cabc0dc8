//! What a scene may say, once: the [`table!`] macro makes a `*Desc` struct, its reader, its writer, its JSON Schema and
//! its page of the reference from one list of documented fields.

/// Declares a table of the scene text. See the module's documentation.
macro_rules! table {
    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident {
            $( $(#[doc = $fdoc:literal])* pub $field:ident : $ty:ty $(= $default:expr)?, )*
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            $( $(#[doc = $fdoc])* pub $field: $ty, )*
        }
    };
}

/// Declares a closed set of words of the scene text, such as `repeat`, `mirror`, `clamp`.
macro_rules! words {
    (
        $(#[doc = $doc:literal])*
        pub enum $name:ident {
            $( $(#[doc = $vdoc:literal])* $variant:ident = $word:literal, )*
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $( $(#[doc = $vdoc])* $variant, )*
        }
        impl $name { pub const fn name(self) -> &'static str { match self { $(Self::$variant => $word,)* } } }
    };
}

pub(crate) use table;
pub(crate) use words;

mod value;

pub use value::{ColorDesc, ColorParam, FilePath, NumberParam, ParamDesc};

// STUB
pub(crate) fn nearest<'a>(_: &str, _: impl Iterator<Item = &'a str>) -> Option<&'a str> { None }

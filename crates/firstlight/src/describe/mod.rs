//! What a scene may say, once: the [`table!`] macro makes a `*Desc` struct, its reader, its writer, its JSON Schema and
//! its page of the reference from one list of documented fields.
//!
//! A field with `= default` may be left out of the text, and is left out by the writer while it has that value; a field
//! without is required, and is an argument of `new`. A table whose fields all have defaults implements `Default`.
//!
//! A table is itself a value: `transform: Option<TransformDesc> = None` is a field that holds a table, `keys:
//! Vec<KeyDesc>` one that holds any number of them.
//!
//! - [`node`]: TOML and JSON as one tree that knows where everything stands; [`scan`] and [`toml`](mod@toml) help it;
//! - [`read`]: from the tree to values, collecting every fault;
//! - [`write`](mod@write): from values to text;
//! - [`family!`]: the enum of all kinds of a family, lights say;
//! - [`info`]: what the fields are, for the schema and the reference.

/// Declares a table of the scene text. See the module's documentation.
macro_rules! table {
    // A field's value: read from the text, or what stands for it
    (@read $fields:ident, $field:ident) => { $fields.required(stringify!($field)) };
    (@read $fields:ident, $field:ident, $default:expr) => { $fields.optional(stringify!($field), || $default) };

    (@is_default $table:ident, $field:ident: $ty:ty) => { false };
    (@is_default $table:ident, $field:ident: $ty:ty, $default:expr) => {{
        let default: $ty = $default;
        $table.$field == default
    }};

    (@default $ty:ty) => { None };
    (@default $ty:ty, $default:expr) => {{
        let default: $ty = $default;
        Some($crate::describe::Value::write(&default))
    }};

    // Sort the fields into the arguments of `new` and the ones with a default
    (@new $name:ident [$($args:tt)*] [$($inits:tt)*] $field:ident : $ty:ty = $default:expr, $($rest:tt)*) => {
        $crate::describe::table!(@new $name [$($args)*] [$($inits)* $field: $default,] $($rest)*);
    };
    (@new $name:ident [$($args:tt)*] [$($inits:tt)*] $field:ident : $ty:ty, $($rest:tt)*) => {
        $crate::describe::table!(@new $name [$($args)* $field: $ty,] [$($inits)* $field: $field,] $($rest)*);
    };
    (@new $name:ident [] [$($field:ident : $value:expr,)*]) => {
        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $value,)* }
            }
        }
    };
    (@new $name:ident [$($arg:ident : $ty:ty,)+] [$($field:ident : $value:expr,)*]) => {
        impl $name {
            /// With its required fields; all others have their defaults.
            #[allow(clippy::redundant_field_names, reason = "one macro writes arguments and defaults alike")]
            pub fn new($($arg: $ty),+) -> Self {
                Self { $($field: $value,)* }
            }
        }
    };

    (
        $(#[doc = $doc:literal])*
        pub struct $name:ident {
            $( $(#[doc = $fdoc:literal])* pub $field:ident : $ty:ty $(= $default:expr)?, )*
            // Fields of another table that stand in this one
            $( ..$flat:ident : $flat_ty:ident, )?
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            $( $(#[doc = $fdoc])* pub $field: $ty, )*
            $(
                #[doc = concat!("The fields of [`", stringify!($flat_ty), "`], in this table.")]
                pub $flat: $flat_ty,
            )?
        }

        $crate::describe::table!(
            @new $name [] [$( $flat: <$flat_ty>::default(), )?] $( $field : $ty $(= $default)?, )*
        );

        impl $crate::describe::Table for $name {
            const NAME: &'static str = stringify!($name);
            const DOC: &'static [&'static str] = &[$($doc),*];

            fn fields() -> Vec<&'static str> {
                #[allow(unused_mut, reason = "few tables hold the fields of another")]
                let mut fields = vec![$(stringify!($field)),*];
                $( fields.extend(<$flat_ty as $crate::describe::Table>::fields()); )?
                fields
            }

            fn read(fields: &mut $crate::describe::Fields<'_, '_, '_>) -> Self {
                Self {
                    $( $field: $crate::describe::table!(@read fields, $field $(, $default)?), )*
                    $( $flat: <$flat_ty as $crate::describe::Table>::read(fields), )?
                }
            }

            fn write(&self) -> Vec<(&'static str, $crate::describe::TextValue)> {
                let mut written = Vec::new();
                $(
                    if !($crate::describe::table!(@is_default self, $field: $ty $(, $default)?)) {
                        written.push((stringify!($field), $crate::describe::Value::write(&self.$field)));
                    }
                )*
                $( written.extend($crate::describe::Table::write(&self.$flat)); )?
                written
            }

            fn info() -> Vec<$crate::describe::FieldInfo> {
                #[allow(unused_mut, reason = "few tables hold the fields of another")]
                let mut info = vec![$(
                    $crate::describe::FieldInfo::of::<$ty>(
                        stringify!($field),
                        &[$($fdoc),*],
                        $crate::describe::table!(@default $ty $(, $default)?),
                    ),
                )*];
                $( info.extend(<$flat_ty as $crate::describe::Table>::info()); )?
                info
            }
        }

        impl $crate::describe::Value for $name {
            fn words() -> String {
                "a table".into()
            }

            fn plural() -> String {
                "tables".into()
            }

            fn schema() -> serde_json::Value {
                $crate::describe::info::link_to::<Self>()
            }

            fn tables() -> Vec<$crate::describe::TableInfo> {
                $crate::describe::info::tables_of::<Self>()
            }

            fn placeholder() -> Self {
                $crate::describe::read::stand_in()
            }

            fn read(
                node: &$crate::describe::node::Node,
                reader: &mut $crate::describe::read::Reader<'_>,
            ) -> Option<Self> {
                reader.inner_table(node)
            }

            fn write(&self) -> $crate::describe::TextValue {
                $crate::describe::TextValue::Table($crate::describe::Table::write(self))
            }
        }

        // For fields of large tables that few have: `Option<Box<TransformDesc>>`
        impl $crate::describe::Value for Box<$name> {
            fn words() -> String {
                <$name as $crate::describe::Value>::words()
            }

            fn plural() -> String {
                <$name as $crate::describe::Value>::plural()
            }

            fn schema() -> serde_json::Value {
                <$name as $crate::describe::Value>::schema()
            }

            fn tables() -> Vec<$crate::describe::TableInfo> {
                <$name as $crate::describe::Value>::tables()
            }

            fn placeholder() -> Self {
                Box::new($crate::describe::read::stand_in())
            }

            fn read(
                node: &$crate::describe::node::Node,
                reader: &mut $crate::describe::read::Reader<'_>,
            ) -> Option<Self> {
                reader.inner_table(node).map(Box::new)
            }

            fn write(&self) -> $crate::describe::TextValue {
                $crate::describe::Value::write(&**self)
            }
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

        impl $name {
            /// Every one of them, in the order of the reference.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The word for it in scene text.
            pub fn name(self) -> &'static str {
                match self {
                    $( Self::$variant => $word, )*
                }
            }

            /// The one of that name, `None` if there is none.
            pub fn from_name(name: &str) -> Option<Self> {
                match name {
                    $( $word => Some(Self::$variant), )*
                    _ => None,
                }
            }
        }

        impl $crate::describe::Words for $name {
            const CHOICES: &'static [$crate::describe::Choice] =
                &[$( $crate::describe::Choice { word: $word, doc: &[$($vdoc),*] } ),*];

            fn of_word(word: &str) -> Option<Self> {
                Self::from_name(word)
            }

            fn word(&self) -> &'static str {
                self.name()
            }
        }
    };
}

pub(crate) use table;
pub(crate) use words;

pub(crate) mod family;
pub(crate) mod info;
mod name_map;
pub(crate) mod node;
pub(crate) mod read;
mod scan;
pub(crate) mod synonyms;
mod toml;
pub(crate) mod value;
pub(crate) mod write;

pub(crate) use family::{Family, TableInfo, family};
pub(crate) use info::{Choice, FieldInfo};
pub use name_map::NameMap;
pub use read::nearest_name;
pub(crate) use read::{Fields, Table, Value, Words, nearest};
pub use value::{Channel, ColorDesc, ColorParam, FilePath, NumberParam, ParamDesc, SamplesDesc, ScaleDesc};
pub(crate) use write::TextValue;

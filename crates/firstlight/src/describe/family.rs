//! Closed families of descriptions: shapes, lights, materials, textures. One table of the text for each variant.

use super::node::Node;
use super::read::Reader;
use super::{FieldInfo, Table, TextValue, info};

/// A table as the schema and the reference show it.
#[derive(Clone, Debug)]
pub(crate) struct TableInfo {
    pub kind: String,
    /// The lines of its doc comment.
    pub doc: &'static [&'static str],
    pub fields: Vec<FieldInfo>,
    pub schema: serde_json::Value,
}

impl TableInfo {
    pub(crate) fn of<T: Table>(kind: impl Into<String>) -> Self {
        Self { kind: kind.into(), doc: T::DOC, fields: T::info(), schema: info::table_schema::<T>() }
    }
}

/// A closed enum of descriptions with one table of the text for each variant. Made by [`family!`].
pub(crate) trait Family: Sized {
    /// What one of them is called.
    const WORD: &'static str;
    /// The names of the variants in text, in scene order.
    const KINDS: &'static [&'static str];
    /// The index of its kind.
    fn kind_index(&self) -> usize;
    /// Reads one of the kind of that index.
    fn read(kind: usize, node: &Node, reader: &mut Reader<'_>) -> Self;
    /// The fields that differ from their defaults.
    fn write(&self) -> Vec<(&'static str, TextValue)>;
    /// All kinds.
    fn tables() -> Vec<TableInfo>;
}

/// Declares the enum of a family, each variant with the name of its table. The order is scene order: that of ids.
macro_rules! family {
    (
        $(#[doc = $doc:literal])*
        pub enum $family:ident: $word:literal {
            $(#[doc = $doc0:literal])*
            $variant0:ident($desc0:ident) = $first:literal,
            $( $(#[doc = $vdoc:literal])* $variant:ident($desc:ident) = $kind:literal, )*
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant, reason = "descriptions are few, and read once")]
        pub enum $family {
            $(#[doc = $doc0])*
            $variant0($desc0),
            $( $(#[doc = $vdoc])* $variant($desc), )*
        }

        impl $family {
            /// The kinds as scene text names them, in scene order.
            pub const KINDS: &'static [&'static str] = &[$first $(, $kind)*];

            /// Its kind, one of [`KINDS`](Self::KINDS).
            pub fn kind(&self) -> &'static str {
                match self {
                    $family::$variant0(_) => $first,
                    $( $family::$variant(_) => $kind, )*
                }
            }
        }

        impl $crate::describe::Family for $family {
            const WORD: &'static str = $word;
            const KINDS: &'static [&'static str] = $family::KINDS;

            fn kind_index(&self) -> usize {
                Self::KINDS.iter().position(|k| *k == self.kind()).expect("every variant has its kind")
            }

            fn read(
                kind: usize,
                node: &$crate::describe::node::Node,
                reader: &mut $crate::describe::read::Reader<'_>,
            ) -> Self {
                match Self::KINDS[kind] {
                    $( $kind => $family::$variant(reader.table::<$desc>(node, concat!("`", $kind, "`"))), )*
                    _ => $family::$variant0(reader.table::<$desc0>(node, concat!("`", $first, "`"))),
                }
            }

            fn write(&self) -> Vec<(&'static str, $crate::describe::TextValue)> {
                use $crate::describe::Table;
                match self {
                    $family::$variant0(desc) => desc.write(),
                    $( $family::$variant(desc) => desc.write(), )*
                }
            }

            fn tables() -> Vec<$crate::describe::TableInfo> {
                use $crate::describe::TableInfo;
                vec![TableInfo::of::<$desc0>($first) $(, TableInfo::of::<$desc>($kind))*]
            }
        }
    };
}

pub(crate) use family;

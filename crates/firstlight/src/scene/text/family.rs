//! The kinds of shapes, lights, materials and textures: which table of the text belongs to which variant.

use crate::describe::node::Node;
use crate::describe::read::Reader;
use crate::describe::{FieldInfo, Table, Written, info};
use crate::light::{DirectionalDesc, LightDesc, PointDesc, RectangleDesc, SpotDesc};
use crate::material::{BlinnPhongDesc, MaterialDesc, PhongDesc};
use crate::shape::{ParallelogramDesc, ShapeDesc, SphereDesc};
use crate::texture::{CheckerboardDesc, ImageTextureDesc, TextureDesc};

/// A table as the schema and the reference show it.
pub(super) struct TableInfo {
    pub kind: &'static str,
    /// The lines of its doc comment.
    pub doc: &'static [&'static str],
    pub fields: Vec<FieldInfo>,
    pub schema: serde_json::Value,
}

impl TableInfo {
    pub(super) fn of<T: Table>(kind: &'static str) -> Self {
        Self { kind, doc: T::DOC, fields: T::info(), schema: info::table_schema::<T>() }
    }
}

/// A closed enum of descriptions with one table of the text for each variant.
pub(super) trait Family: Sized {
    /// What one of them is called.
    const WORD: &'static str;
    /// The names of the variants in text, in scene order.
    const KINDS: &'static [&'static str];
    /// The index of its kind.
    fn kind(&self) -> usize;
    /// Reads one of the kind of that index.
    fn read(kind: usize, node: &Node, reader: &mut Reader<'_>) -> Self;
    /// The fields that differ from their defaults.
    fn write(&self) -> Vec<(&'static str, Written)>;
    /// All kinds.
    fn tables() -> Vec<TableInfo>;
}

macro_rules! family {
    ($family:ident, $word:literal: $first:literal $variant0:ident($desc0:ident) $(, $kind:literal $variant:ident($desc:ident))* $(,)?) => {
        impl Family for $family {
            const WORD: &'static str = $word;
            const KINDS: &'static [&'static str] = &[$first $(, $kind)*];

            fn kind(&self) -> usize {
                let name = match self {
                    $family::$variant0(_) => $first,
                    $( $family::$variant(_) => $kind, )*
                };
                Self::KINDS.iter().position(|k| *k == name).expect("every variant has its kind")
            }

            fn read(kind: usize, node: &Node, reader: &mut Reader<'_>) -> Self {
                match Self::KINDS[kind] {
                    $( $kind => $family::$variant(reader.table::<$desc>(node, concat!("`", $kind, "`"))), )*
                    _ => $family::$variant0(reader.table::<$desc0>(node, concat!("`", $first, "`"))),
                }
            }

            fn write(&self) -> Vec<(&'static str, Written)> {
                match self {
                    $family::$variant0(desc) => desc.write(),
                    $( $family::$variant(desc) => desc.write(), )*
                }
            }

            fn tables() -> Vec<TableInfo> {
                vec![TableInfo::of::<$desc0>($first) $(, TableInfo::of::<$desc>($kind))*]
            }
        }
    };
}

family!(ShapeDesc, "shape": "sphere" Sphere(SphereDesc), "parallelogram" Parallelogram(ParallelogramDesc));
family!(LightDesc, "light":
    "point" Point(PointDesc),
    "directional" Directional(DirectionalDesc),
    "spot" Spot(SpotDesc),
    "rectangle" Rectangle(RectangleDesc),
);
family!(MaterialDesc, "material": "phong" Phong(PhongDesc), "blinn-phong" BlinnPhong(BlinnPhongDesc));
family!(TextureDesc, "texture": "checkerboard" Checkerboard(CheckerboardDesc), "image" Image(ImageTextureDesc));

//! What is read of a PLY file: which property of which element is what.

use super::super::error::{WRITE_ANEW, shown};
use super::super::{ImportFault, MAX_COUNT, linear_of_fraction};
use super::header::{DataEncoding, Element, Header, PropertyKind, Scalar};
use crate::color::Encoding;
use crate::parallel;

/// The attributes of a vertex, as places in a row.
pub(super) const SLOTS: usize = 13;
pub(super) const X: usize = 0;
pub(super) const NX: usize = 3;
pub(super) const U: usize = 6;
pub(super) const RED: usize = 8;
pub(super) const ALPHA: usize = 11;
pub(super) const RADIUS: usize = 12;

/// Names of each attribute, the preferred first.
const NAMES: [&[&str]; SLOTS] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u", "u1", "texture_s"],
    &["v", "t", "texture_v", "v1", "texture_t"],
    &["red", "diffuse_red", "r"],
    &["green", "diffuse_green", "g"],
    &["blue", "diffuse_blue", "b"],
    &["alpha", "diffuse_alpha", "a"],
    &["radius"],
];

/// The property of an element that holds an attribute.
pub(super) fn find(element: &Element, slot: usize) -> Option<(usize, Scalar)> {
    let scalar = |name: &&str| {
        let position = element.properties.iter().position(|p| p.name == name.as_bytes())?;
        match element.properties[position].kind {
            PropertyKind::Scalar(scalar) => Some((position, scalar)),
            PropertyKind::List { .. } => None,
        }
    };
    NAMES[slot].iter().find_map(scalar)
}

/// What a property of a vertex or face is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    None,
    Slot(usize),
    Indices,
    Coordinates,
}

/// What an element is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    Vertices,
    Faces,
    Strips,
    Skip,
}

/// How colours become linear.
#[derive(Clone, Debug)]
pub(super) struct ColorScale {
    /// Linear values of whole numbers; empty if the file has fractions.
    table: Vec<f32>,
}

impl ColorScale {
    pub fn new(scalar: Scalar) -> Self {
        let largest = match scalar {
            Scalar::F32 | Scalar::F64 => return Self { table: Vec::new() },
            Scalar::U16 => 65535,
            _ => 255,
        };
        let decode = |i: usize| Encoding::Srgb.decode(i as f64 / largest as f64) as f32;
        Self { table: parallel::map(largest + 1, 256, decode) }
    }

    pub fn linear(&self, raw: [f32; 4]) -> [f32; 4] {
        let [r, g, b, a] = raw;
        if self.table.is_empty() {
            return [linear_of_fraction(r), linear_of_fraction(g), linear_of_fraction(b), a];
        }
        let largest = self.table.len() - 1;
        // Casting clamps below
        let of = |value: f32| self.table[(value as usize).min(largest)];
        [of(r), of(g), of(b), (a / largest as f32).clamp(0.0, 1.0)]
    }

    /// The raw value of full opacity.
    pub fn opaque(&self) -> f32 {
        if self.table.is_empty() { 1.0 } else { (self.table.len() - 1) as f32 }
    }
}

/// What is read of a file.
pub(super) struct Plan {
    pub purposes: Vec<Purpose>,
    /// Per element and property.
    pub uses: Vec<Vec<Use>>,
    pub vertices: u64,
    pub normals: bool,
    pub uvs: bool,
    pub colors: Option<ColorScale>,
    pub radii: bool,
    /// Faces have texture coordinates of their own.
    pub wedges: bool,
    /// Faces have colours of their own.
    pub face_colors: bool,
    /// What is taken off the number in each slot.
    pub offsets: [f64; SLOTS],
}

impl Plan {
    pub fn new(header: &Header, file: usize) -> Result<Self, ImportFault> {
        // No element can have more rows than there are bytes for; the last row of a text needs nothing after it
        let left = (file - header.body) as u64;
        let mut room = left + u64::from(header.encoding == DataEncoding::Ascii);
        for element in &header.elements {
            let least = element.least_row(header.encoding);
            match element.count.checked_mul(least).and_then(|bytes| room.checked_sub(bytes)) {
                Some(rest) => room = rest,
                None => {
                    let message = format!(
                        "element {}: {} are claimed, but the {left} bytes after the header have room for {} at most",
                        shown(element.name),
                        element.count,
                        room / least
                    );
                    return Err(ImportFault::text(element.at, message, WRITE_ANEW));
                }
            }
        }
        let Some(at) = header.elements.iter().position(|e| e.name == b"vertex") else {
            let hint = "firstlight reads the elements vertex, face and tristrips";
            return Err(ImportFault::text(0, "the header has no element vertex", hint));
        };
        let vertex = &header.elements[at];
        for (slot, name) in ["x", "y", "z"].into_iter().enumerate() {
            if find(vertex, slot).is_none() {
                let message = format!("element vertex has no property {name}");
                return Err(ImportFault::text(vertex.at, message, "a vertex has x, y and z, each a number"));
            }
        }
        if vertex.count > MAX_COUNT {
            return Err(ImportFault::TooMany { what: "vertices", count: vertex.count, limit: MAX_COUNT });
        }
        let has = |slots: std::ops::Range<usize>| slots.clone().all(|s| find(vertex, s).is_some());
        let (normals, uvs, colors) = (has(NX..U), has(U..RED), has(RED..ALPHA));
        let color_type = find(vertex, RED).map(|c| c.1).filter(|_| colors);
        let mut plan = Self {
            purposes: Vec::new(),
            uses: Vec::new(),
            vertices: vertex.count,
            normals,
            uvs,
            colors: color_type.map(ColorScale::new),
            radii: has(RADIUS..SLOTS),
            offsets: [0.0; SLOTS],
            wedges: false,
            face_colors: false,
        };
        for element in &header.elements {
            plan.add(element);
        }
        Ok(plan)
    }

    fn add(&mut self, element: &Element) {
        let mut uses = vec![Use::None; element.properties.len()];
        let list = |names: &[&str]| {
            let of = |name: &&str| {
                element
                    .properties
                    .iter()
                    .position(|p| p.name == name.as_bytes() && matches!(p.kind, PropertyKind::List { .. }))
            };
            names.iter().find_map(of)
        };
        let indices = list(&["vertex_indices", "vertex_index"]);
        let purpose = match element.name {
            b"vertex" => {
                let wanted = [(X, true), (NX, self.normals), (U, self.uvs), (RED, self.colors.is_some())];
                let widths = [3, 3, 2, 4];
                for ((start, wanted), width) in wanted.into_iter().zip(widths) {
                    for slot in (start..start + width).filter(|_| wanted) {
                        if let Some((i, _)) = find(element, slot) {
                            uses[i] = Use::Slot(slot);
                        }
                    }
                }
                if let Some((i, _)) = find(element, RADIUS) {
                    uses[i] = Use::Slot(RADIUS);
                }
                Purpose::Vertices
            }
            b"face" if indices.is_some() => {
                if let Some(i) = list(&["texcoord"]) {
                    uses[i] = Use::Coordinates;
                    self.wedges = true;
                }
                let bytes = |slot| find(element, slot).filter(|c| c.1 == Scalar::U8).map(|c| (slot, c.0));
                if let (true, Some(r), Some(g), Some(b)) =
                    (self.colors.is_none(), bytes(RED), bytes(RED + 1), bytes(RED + 2))
                {
                    self.face_colors = true;
                    for (slot, i) in [Some(r), Some(g), Some(b), bytes(ALPHA)].into_iter().flatten() {
                        uses[i] = Use::Slot(slot);
                    }
                }
                Purpose::Faces
            }
            b"tristrips" if indices.is_some() => Purpose::Strips,
            _ => Purpose::Skip,
        };
        if let (Some(i), true) = (indices, matches!(purpose, Purpose::Faces | Purpose::Strips)) {
            uses[i] = Use::Indices;
        }
        self.purposes.push(purpose);
        self.uses.push(uses);
    }
}

//! PLY: the polygon file format, in ASCII and in binary data of both byte orders.
//!
//! What is read, by name, in any order and of any type:
//!
//! - `vertex`: `x y z`; `nx ny nz`; texture coordinates `u v`, `s t`, `texture_u texture_v`, `u1 v1` or `texture_s texture_t`;
//!   colours `red green blue alpha`, `diffuse_red ...` or `r g b a`; `radius`;
//! - `face`: the list `vertex_indices` or `vertex_index`; the list `texcoord` (two numbers for each corner, as MeshLab
//!   writes); `red green blue alpha` in bytes, where vertices have no colours. The last two part vertices;
//! - `tristrips`: the list `vertex_indices`, with -1 between strips.
//!
//! All else is skipped. Lines end with LF, CR LF or CR; what stands after the last element is ignored with a note. Rows of
//! text stand on lines of their own; where they do not, the numbers are read wherever lines end, as many programs do.
//!
//! Text is read on all threads, a piece of lines each. Binary rows of one length, which vertices nearly always and faces
//! often are, are converted in place on all threads; others one after another.
//!
//! Source: G. Turk 1994, "The PLY Polygon File Format".

mod header;
mod source;

use rayon::prelude::*;

use super::error::{WRITE_ANEW, shown};
use super::polygon::{self, Counts};
use super::text::{Cursor, is_blank, is_line_end, pieces};
use super::weld::weld;
use super::{Fault, MAX_COUNT, MeshData, Progress, all};
use crate::color::Encoding as ColorEncoding;
use header::{Element, Encoding, Header, Kind, Scalar};
use source::{Binary, Source, Text, binary_value};

/// Bytes of text that one thread reads at a time.
const PIECE: usize = 1 << 20;
/// Binary rows that one thread converts at a time.
const ROWS: usize = 1 << 14;

/// Reads a PLY file.
pub(super) fn read(file: &[u8], progress: &Progress) -> Result<MeshData, Fault> {
    let header = Header::read(file)?;
    let plan = Plan::new(&header, file.len())?;
    let mut body = match header.encoding {
        Encoding::Ascii => read_text(file, &header, &plan, progress)?,
        encoding => read_binary(file, &header, &plan, encoding, progress)?,
    };
    let mut mesh = MeshData::default();
    let rest = &file[body.end..];
    if !rest.trim_ascii().is_empty() {
        mesh.notes.push(format!("{} bytes after the last element are ignored", rest.len()));
    }
    body.vertices.into_mesh(&plan, &mut mesh);
    body.faces.retain(|part| part.count() > 0);
    assemble(body.faces, &plan, &mut mesh)?;
    Ok(mesh)
}

/// The attributes of a vertex, as places in a row.
const SLOTS: usize = 13;
const X: usize = 0;
const NX: usize = 3;
const U: usize = 6;
const RED: usize = 8;
const ALPHA: usize = 11;
const RADIUS: usize = 12;

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
fn find(element: &Element, slot: usize) -> Option<(usize, Scalar)> {
    let scalar = |name: &&str| {
        let position = element.properties.iter().position(|p| p.name == name.as_bytes())?;
        match element.properties[position].kind {
            Kind::Scalar(scalar) => Some((position, scalar)),
            Kind::List { .. } => None,
        }
    };
    NAMES[slot].iter().find_map(scalar)
}

/// What a property of a vertex or face is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    None,
    Slot(usize),
    Indices,
    Coordinates,
}

/// What an element is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Vertices,
    Faces,
    Strips,
    Skip,
}

/// How colours become linear.
#[derive(Clone, Debug)]
struct Colors {
    /// Linear values of whole numbers; empty if the file has fractions.
    table: Vec<f32>,
}

impl Colors {
    fn new(scalar: Scalar) -> Self {
        let largest = match scalar {
            Scalar::F32 | Scalar::F64 => return Self { table: Vec::new() },
            Scalar::U16 => 65535,
            _ => 255,
        };
        let decode = |i: i32| ColorEncoding::Srgb.decode(f64::from(i) / f64::from(largest)) as f32;
        Self { table: (0..=largest).into_par_iter().map(decode).collect() }
    }

    fn linear(&self, raw: [f32; 4]) -> [f32; 4] {
        let [r, g, b, a] = raw;
        if self.table.is_empty() {
            return raw;
        }
        let largest = self.table.len() - 1;
        // Casting clamps below
        let of = |value: f32| self.table[(value as usize).min(largest)];
        [of(r), of(g), of(b), (a / largest as f32).clamp(0.0, 1.0)]
    }

    /// The raw value of full opacity.
    fn opaque(&self) -> f32 {
        if self.table.is_empty() { 1.0 } else { (self.table.len() - 1) as f32 }
    }
}

/// What is read of a file.
struct Plan {
    purposes: Vec<Purpose>,
    /// Per element and property.
    uses: Vec<Vec<Use>>,
    vertices: u64,
    normals: bool,
    uvs: bool,
    colors: Option<Colors>,
    radii: bool,
    /// Faces have texture coordinates of their own.
    wedges: bool,
    /// Faces have colours of their own.
    face_colors: bool,
}

impl Plan {
    fn new(header: &Header, file: usize) -> Result<Self, Fault> {
        // No element can have more rows than there are bytes for; the last row of a text needs nothing after it
        let left = (file - header.body) as u64;
        let mut room = left + u64::from(header.encoding == Encoding::Ascii);
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
                    return Err(Fault::text(element.at, message, WRITE_ANEW));
                }
            }
        }
        let Some(at) = header.elements.iter().position(|e| e.name == b"vertex") else {
            let hint = "firstlight reads the elements vertex, face and tristrips";
            return Err(Fault::text(0, "the header has no element vertex", hint));
        };
        let vertex = &header.elements[at];
        for (slot, name) in ["x", "y", "z"].into_iter().enumerate() {
            if find(vertex, slot).is_none() {
                let message = format!("element vertex has no property {name}");
                return Err(Fault::text(vertex.at, message, "a vertex has x, y and z, each a number"));
            }
        }
        if vertex.count > MAX_COUNT {
            return Err(Fault::TooMany { what: "vertices", count: vertex.count, limit: MAX_COUNT });
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
            colors: color_type.map(Colors::new),
            radii: has(RADIUS..SLOTS),
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
                element.properties.iter().position(|p| p.name == name.as_bytes() && matches!(p.kind, Kind::List { .. }))
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

/// Vertices as they are read, attribute by attribute; colours not yet linear.
#[derive(Default)]
struct Vertices {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
    radii: Vec<f32>,
}

impl Vertices {
    #[inline(always)]
    fn push(&mut self, plan: &Plan, row: &[f32; SLOTS]) {
        self.positions.push([row[X], row[X + 1], row[X + 2]]);
        if plan.normals {
            self.normals.push([row[NX], row[NX + 1], row[NX + 2]]);
        }
        if plan.uvs {
            self.uvs.push([row[U], row[U + 1]]);
        }
        if let Some(colors) = &plan.colors {
            self.colors.push(colors.linear([row[RED], row[RED + 1], row[RED + 2], row[ALPHA]]));
        }
        if plan.radii {
            self.radii.push(row[RADIUS]);
        }
    }

    fn append(&mut self, mut other: Self) {
        self.positions.append(&mut other.positions);
        self.normals.append(&mut other.normals);
        self.uvs.append(&mut other.uvs);
        self.colors.append(&mut other.colors);
        self.radii.append(&mut other.radii);
    }

    fn into_mesh(self, plan: &Plan, mesh: &mut MeshData) {
        mesh.positions = self.positions;
        mesh.normals = self.normals;
        mesh.colors = self.colors;
        mesh.radii = self.radii;
        if plan.uvs {
            mesh.uvs.push(self.uvs);
        }
    }
}

/// Faces as they are read: triangles while there is nothing else, then corners and the sizes of faces.
#[derive(Default)]
struct Faces {
    triangles: Vec<[u32; 3]>,
    corners: Vec<u32>,
    /// Empty while all are triangles.
    sizes: Vec<u32>,
    /// Per corner, in files that have them.
    wedges: Vec<[f32; 2]>,
    /// Per face, as red, green, blue, alpha from the lowest byte; in files that have them.
    colors: Vec<u32>,
}

impl Faces {
    fn count(&self) -> usize {
        if self.sizes.is_empty() { self.triangles.len() } else { self.sizes.len() }
    }

    #[inline(always)]
    fn push(&mut self, face: &[u32]) {
        if self.sizes.is_empty() {
            if let &[a, b, c] = face {
                self.triangles.push([a, b, c]);
                return;
            }
            self.sizes = vec![3; self.triangles.len()];
            self.corners = std::mem::take(&mut self.triangles).into_flattened();
        }
        self.corners.extend_from_slice(face);
        self.sizes.push(face.len() as u32);
    }
}

/// All that a file holds.
#[derive(Default)]
struct Body {
    vertices: Vertices,
    faces: Vec<Faces>,
    /// The first byte after it.
    end: usize,
}

/// Room for a row.
struct Row {
    slots: [f32; SLOTS],
    indices: Vec<u32>,
    coordinates: Vec<f32>,
    strip: Vec<i64>,
}

impl Row {
    fn new(plan: &Plan) -> Self {
        let mut slots = [0.0; SLOTS];
        slots[ALPHA] = plan.colors.as_ref().map_or(255.0, Colors::opaque);
        Self { slots, indices: Vec::new(), coordinates: Vec::new(), strip: Vec::new() }
    }

    /// Reads row number `number` of an element and adds it to vertices or faces.
    #[inline(always)]
    fn read(
        &mut self,
        source: &mut impl Source,
        plan: &Plan,
        elements: &[Element],
        element: usize,
        vertices: &mut Vertices,
        faces: &mut Faces,
    ) -> Result<(), Fault> {
        let purpose = plan.purposes[element];
        self.indices.clear();
        self.coordinates.clear();
        for (property, &what) in elements[element].properties.iter().zip(&plan.uses[element]) {
            match (property.kind, what) {
                (Kind::Scalar(scalar), Use::Slot(slot)) => self.slots[slot] = source.value(scalar)? as f32,
                (Kind::Scalar(scalar), _) => source.skip(scalar, 1)?,
                (Kind::List { count, item }, _) => {
                    let at = source.offset();
                    let length = source.whole(count)?;
                    let Ok(length) = u64::try_from(length) else {
                        return Err(source.fault(at, format!("a list of {length} values"), WRITE_ANEW));
                    };
                    match what {
                        Use::Indices if purpose == Purpose::Strips => self.read_strip(source, item, length, plan)?,
                        Use::Indices => {
                            for _ in 0..length {
                                let at = source.offset();
                                let index = source.whole(item)?;
                                if !(0..plan.vertices as i64).contains(&index) {
                                    return Err(outside(source, at, index, plan.vertices));
                                }
                                self.indices.push(index as u32);
                            }
                        }
                        Use::Coordinates => {
                            for _ in 0..length {
                                self.coordinates.push(source.value(item)? as f32);
                            }
                        }
                        _ => source.skip(item, length)?,
                    }
                }
            }
        }
        source.end_row()?;
        match purpose {
            Purpose::Vertices => vertices.push(plan, &self.slots),
            Purpose::Faces => self.add_face(plan, faces),
            Purpose::Strips => self.add_strip(plan, faces),
            Purpose::Skip => {}
        }
        Ok(())
    }

    fn read_strip(&mut self, source: &mut impl Source, item: Scalar, length: u64, plan: &Plan) -> Result<(), Fault> {
        self.strip.clear();
        for _ in 0..length {
            let at = source.offset();
            let index = source.whole(item)?;
            if !(-1..plan.vertices as i64).contains(&index) {
                return Err(outside(source, at, index, plan.vertices));
            }
            self.strip.push(index);
        }
        Ok(())
    }

    #[inline(always)]
    fn add_face(&mut self, plan: &Plan, faces: &mut Faces) {
        faces.push(&self.indices);
        if plan.wedges {
            // A face without coordinates, or with too few, has zeros
            for i in 0..self.indices.len() {
                let of = |j: usize| self.coordinates.get(j).copied().unwrap_or(0.0);
                faces.wedges.push([of(2 * i), of(2 * i + 1)]);
            }
        }
        if plan.face_colors {
            let byte = |slot: usize| self.slots[slot] as u8;
            faces.colors.push(u32::from_le_bytes([byte(RED), byte(RED + 1), byte(RED + 2), byte(ALPHA)]));
        }
    }

    /// Triangles of strips: every second one is turned round, so that all face the same way.
    fn add_strip(&mut self, plan: &Plan, faces: &mut Faces) {
        let strip = std::mem::take(&mut self.strip);
        for strip in strip.split(|&index| index < 0) {
            for (i, window) in strip.windows(3).enumerate() {
                let [a, b, c] = [window[0] as u32, window[1] as u32, window[2] as u32];
                // Repeated corners join strips
                if a != b && b != c && c != a {
                    self.indices.clear();
                    self.indices.extend(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
                    self.add_face(plan, faces);
                }
            }
        }
        self.strip = strip;
    }
}

#[cold]
fn outside(source: &impl Source, at: usize, index: i64, vertices: u64) -> Fault {
    let message = match vertices {
        0 => format!("vertex {index}, but the file has no vertices"),
        n => format!("vertex {index} is outside 0 to {}", n - 1),
    };
    source.fault(at, message, WRITE_ANEW)
}

/// Reads text: on all threads where each row has a line, otherwise as one stream of numbers.
fn read_text(file: &[u8], header: &Header, plan: &Plan, progress: &Progress) -> Result<Body, Fault> {
    match read_lines(file, header, plan, progress) {
        Ok(body) => Ok(body),
        Err(Fault::Stopped) => Err(Fault::Stopped),
        Err(lines) => {
            // An empty line alone is no fault
            let empty = lines.offset().is_none_or(|at| is_empty_line(file, at));
            match read_stream(file, header, plan) {
                // Numbers left over: a row had too few or too many
                Ok(body) if !empty && !file[body.end..].trim_ascii().is_empty() => Err(lines),
                // The earlier fault is the likelier cause
                Err(stream) if !empty && lines.offset() < stream.offset() => Err(lines),
                other => other,
            }
        }
    }
}

/// Whether nothing but blanks stands on the line up to a byte, and there is its end.
fn is_empty_line(file: &[u8], at: usize) -> bool {
    let before = file[..at].iter().rev().find(|&&b| !is_blank(b));
    file.get(at).is_none_or(|&b| is_line_end(b)) && before.is_none_or(|&b| is_line_end(b))
}

/// Reads text with one row to a line, on all threads.
fn read_lines(file: &[u8], header: &Header, plan: &Plan, progress: &Progress) -> Result<Body, Fault> {
    // The number of the first row after each element
    let mut ends = Vec::new();
    let mut rows = 0u64;
    for element in &header.elements {
        rows += if element.properties.is_empty() { 0 } else { element.count };
        ends.push(rows);
    }
    // The number of the first row of each piece
    let pieces = pieces(file, header.body, PIECE, |_| true);
    let counts: Vec<u64> =
        pieces.par_iter().map(|p| file[p.clone()].iter().filter(|&&b| b == b'\n').count() as u64).collect();
    let mut start = 0;
    let starts: Vec<u64> = counts.iter().map(|count| (start, start += count).0).collect();
    let read = |(piece, &start): (&std::ops::Range<usize>, &u64)| {
        let mut vertices = Vertices::default();
        let mut faces = Faces::default();
        let mut row = Row::new(plan);
        let mut text = Text { cursor: Cursor { bytes: &file[..piece.end], at: piece.start }, free: false };
        let mut number = start;
        while number < rows && !text.cursor.at_end() {
            // All rows of an element that are in this piece
            let element = ends.partition_point(|&end| end <= number);
            while number < ends[element] && !text.cursor.at_end() {
                row.read(&mut text, plan, &header.elements, element, &mut vertices, &mut faces)?;
                number += 1;
            }
        }
        progress.advance(piece.len())?;
        Ok((vertices, faces, number, text.cursor.at))
    };
    let parts = all(pieces.par_iter().zip(&starts).map(read).collect())?;
    // Join the pieces
    let mut body = Body { end: header.body, ..Body::default() };
    let mut done = 0;
    if let Some(vertices) = usize::try_from(plan.vertices).ok().filter(|_| parts.len() > 1) {
        body.vertices.positions.reserve_exact(vertices);
    }
    for (vertices, faces, number, end) in parts {
        if done < rows {
            body.end = end;
        }
        done = done.max(number);
        body.vertices.append(vertices);
        body.faces.push(faces);
    }
    if done < rows {
        return Err(Fault::text(file.len(), "the file ends before its last row", WRITE_ANEW));
    }
    Ok(body)
}

/// Reads text as one stream of numbers.
fn read_stream(file: &[u8], header: &Header, plan: &Plan) -> Result<Body, Fault> {
    let mut body = Body::default();
    let mut faces = Faces::default();
    let mut row = Row::new(plan);
    let mut text = Text { cursor: Cursor { bytes: file, at: header.body }, free: true };
    for (i, element) in header.elements.iter().enumerate().filter(|(_, e)| !e.properties.is_empty()) {
        for _ in 0..element.count {
            row.read(&mut text, plan, &header.elements, i, &mut body.vertices, &mut faces)?;
        }
    }
    body.faces.push(faces);
    body.end = text.cursor.at;
    Ok(body)
}

fn read_binary(
    file: &[u8],
    header: &Header,
    plan: &Plan,
    encoding: Encoding,
    progress: &Progress,
) -> Result<Body, Fault> {
    let mut body = Body::default();
    let mut source = Binary::new(file, header.body, encoding);
    progress.advance(header.body)?;
    for (i, element) in header.elements.iter().enumerate().filter(|(_, e)| !e.properties.is_empty() && e.count > 0) {
        let start = source.at;
        if !read_uniform(&mut source, plan, element, i, &mut body, progress)? {
            let mut faces = Faces::default();
            let mut row = Row::new(plan);
            let mut told = source.at;
            for _ in 0..element.count {
                row.read(&mut source, plan, &header.elements, i, &mut body.vertices, &mut faces)?;
                if source.at - told >= PIECE {
                    progress.advance(source.at - told)?;
                    told = source.at;
                }
            }
            body.faces.push(faces);
            progress.advance(source.at - told)?;
        }
        debug_assert!(source.at >= start);
    }
    body.end = source.at;
    Ok(body)
}

/// Reads an element whose rows are all as long as the first one, on all threads. `false`, with nothing read, if they are not,
/// or if a value is not what it must be: then reading one by one finds out where.
fn read_uniform(
    source: &mut Binary,
    plan: &Plan,
    element: &Element,
    number: usize,
    body: &mut Body,
    progress: &Progress,
) -> Result<bool, Fault> {
    // The layout of the first row
    let mut lists: Vec<(usize, Scalar, u64)> = Vec::new();
    let mut slots: [Option<(usize, Scalar)>; SLOTS] = [None; SLOTS];
    let mut indices = None;
    let mut first = Binary { bytes: source.bytes, at: source.at, big: source.big };
    for (property, &what) in element.properties.iter().zip(&plan.uses[number]) {
        let offset = first.at - source.at;
        match property.kind {
            Kind::Scalar(scalar) => {
                if let Use::Slot(slot) = what {
                    slots[slot] = Some((offset, scalar));
                }
                first.skip(scalar, 1)?;
            }
            Kind::List { count, item } => {
                let Ok(length) = u64::try_from(first.whole(count)?) else { return Ok(false) };
                lists.push((offset, count, length));
                match what {
                    Use::Indices => indices = Some((first.at - source.at, item, length as usize)),
                    Use::Coordinates => return Ok(false),
                    _ => {}
                }
                first.skip(item, length)?;
            }
        }
    }
    let purpose = plan.purposes[number];
    let stride = first.at - source.at;
    let left = (source.bytes.len() - source.at) as u64;
    let Some(size) = element.count.checked_mul(stride as u64).filter(|&size| size <= left) else { return Ok(false) };
    let rows = &source.bytes[source.at..source.at + size as usize];
    let big = source.big;
    let uniform = |row: &[u8]| {
        lists.iter().all(|&(offset, count, length)| binary_value(&row[offset..], count, big) == length as f64)
    };
    let read = |row: &[u8], slot: usize, missing: f32| match slots[slot] {
        Some((offset, scalar)) => binary_value(&row[offset..], scalar, big) as f32,
        None => missing,
    };
    match purpose {
        _ if purpose == Purpose::Strips || (purpose == Purpose::Faces && plan.face_colors) => return Ok(false),
        // Without lists every row is as long as the first
        _ if !lists.is_empty()
            && purpose != Purpose::Faces
            && !rows.par_chunks(stride * ROWS).all(|block| block.chunks_exact(stride).all(uniform)) =>
        {
            return Ok(false);
        }
        Purpose::Vertices => {
            let rows = || rows.par_chunks_exact(stride).with_min_len(ROWS);
            let vertices = &mut body.vertices;
            vertices.positions = rows().map(|r| [0, 1, 2].map(|i| read(r, X + i, 0.0))).collect();
            if plan.normals {
                vertices.normals = rows().map(|r| [0, 1, 2].map(|i| read(r, NX + i, 0.0))).collect();
            }
            if plan.uvs {
                vertices.uvs = rows().map(|r| [0, 1].map(|i| read(r, U + i, 0.0))).collect();
            }
            if let Some(colors) = &plan.colors {
                let raw = |r: &[u8]| [0, 1, 2, 3].map(|i| read(r, RED + i, colors.opaque()));
                vertices.colors = rows().map(|r| colors.linear(raw(r))).collect();
            }
            if plan.radii {
                vertices.radii = rows().map(|r| read(r, RADIUS, 0.0)).collect();
            }
        }
        Purpose::Faces => {
            let Some((offset, item, length)) = indices else { return Ok(false) };
            if length > 16 {
                return Ok(false);
            }
            let Some(faces) = uniform_faces(rows, stride, &uniform, (offset, item, length), big, plan.vertices) else {
                return Ok(false);
            };
            body.faces.push(faces);
        }
        Purpose::Strips | Purpose::Skip => {}
    }
    source.at += size as usize;
    progress.advance(size as usize)?;
    Ok(true)
}

/// Faces of rows that are all alike; `None` if they are not, or an index is out of range.
fn uniform_faces(
    rows: &[u8],
    stride: usize,
    uniform: &(impl Fn(&[u8]) -> bool + Sync),
    (offset, item, length): (usize, Scalar, usize),
    big: bool,
    vertices: u64,
) -> Option<Faces> {
    let count = rows.len() / stride;
    let index = |row: &[u8], i: usize| {
        let at = &row[offset + i * item.size()..];
        // The two usual types, without a way through f64
        match item {
            Scalar::I32 | Scalar::U32 => {
                let bytes: [u8; 4] = at[..4].try_into().expect("four bytes");
                let value = if big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
                let negative = item == Scalar::I32 && value > i32::MAX as u32;
                (!negative && u64::from(value) < vertices).then_some(value)
            }
            _ => {
                let value = binary_value(at, item, big);
                (value >= 0.0 && value < vertices as f64 && value.fract() == 0.0).then_some(value as u32)
            }
        }
    };
    let mut faces = Faces::default();
    let fine = if length == 3 {
        faces.triangles = vec![[0; 3]; count];
        faces.triangles.par_chunks_mut(ROWS).zip(rows.par_chunks(stride * ROWS)).all(|(triangles, rows)| {
            triangles.iter_mut().zip(rows.chunks_exact(stride)).all(|(triangle, row)| {
                let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|i| index(row, i)) else { return false };
                *triangle = [a, b, c];
                uniform(row)
            })
        })
    } else {
        faces.sizes = vec![length as u32; count];
        faces.corners = vec![0; count * length];
        let each = length.max(1) * ROWS;
        faces.corners.par_chunks_mut(each).zip(rows.par_chunks(stride * ROWS)).all(|(corners, rows)| {
            corners.chunks_exact_mut(length.max(1)).zip(rows.chunks_exact(stride)).all(|(face, row)| {
                let read = face.iter_mut().enumerate().all(|(i, corner)| match index(row, i) {
                    Some(index) => {
                        *corner = index;
                        true
                    }
                    None => false,
                });
                read && uniform(row)
            })
        }) && length > 0
    };
    fine.then_some(faces)
}

/// Makes triangles of the faces, and parts vertices where faces have texture coordinates or colours of their own.
fn assemble(mut parts: Vec<Faces>, plan: &Plan, mesh: &mut MeshData) -> Result<(), Fault> {
    let parted = plan.wedges || plan.face_colors;
    let mut counts = Counts::default();
    let positions = std::mem::take(&mut mesh.positions);
    // Triangles of a part, as numbers of its corners where it is not triangles already
    let mut split = |part: &Faces| {
        let (triangles, part_counts) = polygon::triangulate(&part.sizes, |i| positions[part.corners[i] as usize]);
        counts.add(part_counts);
        triangles
    };
    if !parted {
        if parts.len() == 1 && parts[0].sizes.is_empty() {
            mesh.triangles = std::mem::take(&mut parts[0].triangles);
        } else {
            let size = |p: &Faces| {
                if p.sizes.is_empty() {
                    p.triangles.len()
                } else {
                    p.corners.len() - 2 * p.sizes.len().min(p.corners.len() / 2)
                }
            };
            mesh.triangles.reserve_exact(parts.iter().map(size).sum());
            for part in parts {
                if part.sizes.is_empty() {
                    mesh.triangles.extend_from_slice(&part.triangles);
                } else {
                    let of = |t: [u32; 3]| t.map(|i| part.corners[i as usize]);
                    mesh.triangles.extend(split(&part).into_iter().map(of));
                }
            }
        }
        counts.notes(&mut mesh.notes);
        mesh.positions = positions;
        return check_count(mesh.triangles.len());
    }
    // All corners in one row, with what makes them different
    let mut corners: Vec<u32> = Vec::new();
    let mut wedges: Vec<[f32; 2]> = Vec::new();
    let mut colors: Vec<u32> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for mut part in parts {
        let base = corners.len() as u32;
        let from_base = |t: [u32; 3]| t.map(|i| base + i);
        if part.sizes.is_empty() {
            triangles.extend((0..part.triangles.len() as u32).map(|i| from_base([3 * i, 3 * i + 1, 3 * i + 2])));
            if plan.face_colors {
                colors.extend(part.colors.iter().flat_map(|&color| [color; 3]));
            }
            corners.extend(part.triangles.into_flattened());
        } else {
            triangles.extend(split(&part).into_iter().map(from_base));
            if plan.face_colors {
                let each = part.colors.iter().zip(&part.sizes);
                colors.extend(each.flat_map(|(&color, &size)| std::iter::repeat_n(color, size as usize)));
            }
            corners.append(&mut part.corners);
        }
        wedges.append(&mut part.wedges);
        check_count(corners.len())?;
    }
    counts.notes(&mut mesh.notes);
    let bits = |x: f32| (x + 0.0).to_bits();
    let welded = weld(corners.len(), |i| {
        let uv = wedges.get(i).map_or([0; 2], |uv| uv.map(bits));
        [corners[i], uv[0], uv[1], colors.get(i).copied().unwrap_or(0)]
    });
    // Vertices of the file, in the order of the faces
    mesh.positions = positions;
    let vertex = |i: &u32| corners[*i as usize] as usize;
    pick(&mut mesh.positions, &welded.first, vertex);
    pick(&mut mesh.normals, &welded.first, vertex);
    pick(&mut mesh.radii, &welded.first, vertex);
    pick(&mut mesh.colors, &welded.first, vertex);
    for set in &mut mesh.uvs {
        pick(set, &welded.first, vertex);
    }
    if plan.wedges {
        mesh.uvs.insert(0, welded.first.iter().map(|&i| wedges[i as usize]).collect());
    }
    if plan.face_colors {
        let table = Colors::new(Scalar::U8);
        let linear = |&i: &u32| table.linear(colors[i as usize].to_le_bytes().map(f32::from));
        mesh.colors = welded.first.iter().map(linear).collect();
    }
    mesh.triangles = triangles;
    mesh.triangles.par_iter_mut().for_each(|t| *t = t.map(|i| welded.vertex[i as usize]));
    Ok(())
}

/// What is left of a list per vertex, for vertices made of corners.
fn pick<T: Copy>(list: &mut Vec<T>, first: &[u32], vertex: impl Fn(&u32) -> usize) {
    if !list.is_empty() {
        *list = first.iter().map(|i| list[vertex(i)]).collect();
    }
}

fn check_count(triangles: usize) -> Result<(), Fault> {
    match triangles as u64 {
        count if count > MAX_COUNT => Err(Fault::TooMany { what: "triangles", count, limit: MAX_COUNT }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::{ImportError, MeshData, MeshFormat};

    fn read(text: &[u8]) -> Result<MeshData, ImportError> {
        MeshFormat::Ply.read("a.ply", text, &|_, _| ControlFlow::Continue(()))
    }

    const SQUARE: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    const CORNERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

    fn square(more: &str, rows: &str) -> MeshData {
        read(format!("ply\nformat ascii 1.0\n{SQUARE}{more}end_header\n{CORNERS}{rows}").as_bytes()).unwrap()
    }

    #[test]
    fn texture_coordinates_of_corners_part_vertices() {
        let mesh = square(
            "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n",
            "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 .5 .5 1 1 0 1\n",
        );
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 2, 4]]);
        assert_eq!(mesh.uvs, [vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.5], [0.0, 1.0]]]);
        assert_eq!(mesh.positions[0], mesh.positions[3]);
    }

    #[test]
    fn colors_of_faces_part_vertices_and_are_decoded() {
        let mesh = square(
            "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
            "3 0 1 2 255 0 0\n3 0 2 3 0 0 188\n",
        );
        assert_eq!(mesh.positions.len(), 6);
        assert_eq!(mesh.colors[mesh.triangles[0][0] as usize], [1.0, 0.0, 0.0, 1.0]);
        let blue = mesh.colors[mesh.triangles[1][0] as usize];
        assert!((blue[2] - 0.5028865).abs() < 1e-6 && blue[3] == 1.0, "{blue:?}");
    }

    #[test]
    fn colors_in_fractions_are_linear() {
        let mut text = "ply\nformat ascii 1.0\nelement vertex 1\n".to_string();
        for name in ["x", "y", "z", "red", "green", "blue", "alpha"] {
            text += &format!("property float {name}\n");
        }
        let mesh = read((text + "end_header\n1 2 3 0.5 2 0 0.25").as_bytes()).unwrap();
        assert_eq!(mesh.colors, [[0.5, 2.0, 0.0, 0.25]]);
        assert_eq!(mesh.positions, [[1.0, 2.0, 3.0]]);
        assert!(mesh.triangles.is_empty());
    }

    #[test]
    fn strips_turn_every_second_triangle() {
        let mesh = square("element tristrips 1\nproperty list int int vertex_indices\n", "8 0 1 3 2 -1 0 1 2\n");
        assert_eq!(mesh.triangles, [[0, 1, 3], [3, 1, 2], [0, 1, 2]]);
    }

    #[test]
    fn large_polygons_of_one_size_and_small_faces() {
        let faces = "element face 3\nproperty list uchar int vertex_indices\n";
        let mesh = square(faces, "4 0 1 2 3\n2 0 1\n4 3 2 1 0\n");
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]]);
        assert_eq!(mesh.notes, ["1 faces of less than 3 corners are left out"]);
    }

    #[test]
    fn what_follows_is_ignored_with_a_note_and_numbers_may_be_infinite() {
        let mesh = square("", "and more\n");
        assert_eq!(mesh.notes, ["9 bytes after the last element are ignored"]);
        let text = format!("ply\nformat ascii 1.0\n{SQUARE}end_header\n{}", CORNERS.replace("1 1 0", "nan -inf 1e99"));
        let p = read(text.as_bytes()).unwrap().positions[2];
        assert!(p[0].is_nan() && p[1] == f32::NEG_INFINITY && p[2] == f32::INFINITY);
    }

    #[test]
    fn a_binary_body_may_begin_like_a_line_end() {
        for end in ["\n", "\r\n", "\r"] {
            let header = format!("ply\nformat binary_little_endian 1.0\n{}end_header\n", SQUARE.replace('4', "1"));
            let mut bytes = header.replace('\n', end).into_bytes();
            let x = f32::from_le_bytes(*b"\n\r\n?");
            bytes.extend([x, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
            assert_eq!(read(&bytes).unwrap().positions, [[x, 0.0, 0.0]], "{end:?}");
        }
    }
}

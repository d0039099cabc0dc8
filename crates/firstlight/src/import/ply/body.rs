//! The rows of a PLY file, one after another: vertices and faces as they stand there, and text on all threads.

use super::super::error::WRITE_ANEW;
use super::super::text::{Cursor, is_blank, is_line_end, pieces};
use super::super::{ImportFault, MeshData, Progress, all};
use super::header::{Element, Header, PropertyKind, Scalar};
use super::plan::{ALPHA, ColorScale, NX, Plan, Purpose, RADIUS, RED, SLOTS, U, Use, X};
use super::source::{Source, Text};
use crate::parallel;

/// Bytes of a file that one thread reads at a time.
pub(super) const PIECE: usize = 1 << 20;

/// Vertices as they are read, attribute by attribute; colours not yet linear.
#[derive(Default)]
pub(super) struct Vertices {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub colors: Vec<[f32; 4]>,
    pub radii: Vec<f32>,
}

impl Vertices {
    #[inline(always)]
    pub fn push(&mut self, plan: &Plan, row: &[f32; SLOTS]) {
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

    pub fn append(&mut self, mut other: Self) {
        self.positions.append(&mut other.positions);
        self.normals.append(&mut other.normals);
        self.uvs.append(&mut other.uvs);
        self.colors.append(&mut other.colors);
        self.radii.append(&mut other.radii);
    }

    pub fn into_mesh(self, plan: &Plan, mesh: &mut MeshData) {
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
pub(super) struct Faces {
    pub triangles: Vec<[u32; 3]>,
    pub corners: Vec<u32>,
    /// Empty while all are triangles.
    pub sizes: Vec<u32>,
    /// Per corner, in files that have them.
    pub wedges: Vec<[f32; 2]>,
    /// Per face, as red, green, blue, alpha from the lowest byte; in files that have them.
    pub colors: Vec<u32>,
}

impl Faces {
    pub fn count(&self) -> usize {
        if self.sizes.is_empty() { self.triangles.len() } else { self.sizes.len() }
    }

    #[inline(always)]
    pub fn push(&mut self, face: &[u32]) {
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
pub(super) struct Body {
    pub vertices: Vertices,
    pub faces: Vec<Faces>,
    /// The first byte after it.
    pub end: usize,
}

/// Room for a row.
pub(super) struct Row {
    slots: [f32; SLOTS],
    indices: Vec<u32>,
    coordinates: Vec<f32>,
    strip: Vec<i64>,
}

impl Row {
    pub fn new(plan: &Plan) -> Self {
        let mut slots = [0.0; SLOTS];
        slots[ALPHA] = plan.colors.as_ref().map_or(255.0, ColorScale::opaque);
        Self { slots, indices: Vec::new(), coordinates: Vec::new(), strip: Vec::new() }
    }

    /// Reads row number `number` of an element and adds it to vertices or faces.
    #[inline(always)]
    pub fn read(
        &mut self,
        source: &mut impl Source,
        plan: &Plan,
        elements: &[Element],
        element: usize,
        vertices: &mut Vertices,
        faces: &mut Faces,
    ) -> Result<(), ImportFault> {
        let purpose = plan.purposes[element];
        self.indices.clear();
        self.coordinates.clear();
        for (property, &what) in elements[element].properties.iter().zip(&plan.uses[element]) {
            match (property.kind, what) {
                (PropertyKind::Scalar(scalar), Use::Slot(slot)) => {
                    self.slots[slot] = (source.value(scalar)? - plan.offsets[slot]) as f32;
                }
                (PropertyKind::Scalar(scalar), _) => source.skip(scalar, 1)?,
                (PropertyKind::List { count, item }, _) => {
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

    fn read_strip(
        &mut self,
        source: &mut impl Source,
        item: Scalar,
        length: u64,
        plan: &Plan,
    ) -> Result<(), ImportFault> {
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
fn outside(source: &impl Source, at: usize, index: i64, vertices: u64) -> ImportFault {
    let message = match vertices {
        0 => format!("vertex {index}, but the file has no vertices"),
        n => format!("vertex {index} is outside 0 to {}", n - 1),
    };
    source.fault(at, message, WRITE_ANEW)
}

/// Reads text: on all threads where each row has a line, otherwise as one stream of numbers.
pub(super) fn read_text(file: &[u8], header: &Header, plan: &Plan, progress: &Progress) -> Result<Body, ImportFault> {
    match read_lines(file, header, plan, progress) {
        Ok(body) => Ok(body),
        Err(ImportFault::Stopped) => Err(ImportFault::Stopped),
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
fn read_lines(file: &[u8], header: &Header, plan: &Plan, progress: &Progress) -> Result<Body, ImportFault> {
    // The number of the first row after each element
    let mut ends = Vec::new();
    let mut rows = 0u64;
    for element in &header.elements {
        rows += if element.properties.is_empty() { 0 } else { element.count };
        ends.push(rows);
    }
    // The number of the first row of each piece
    let pieces = pieces(file, header.body, PIECE, |_| true);
    let lines = |i: usize| file[pieces[i].clone()].iter().filter(|&&b| b == b'\n').count() as u64;
    let counts = parallel::collect(pieces.len(), lines);
    let mut start = 0;
    let starts: Vec<u64> = counts.iter().map(|count| (start, start += count).0).collect();
    let read = |i: usize| {
        let piece = &pieces[i];
        let mut vertices = Vertices::default();
        let mut faces = Faces::default();
        let mut row = Row::new(plan);
        let mut text = Text { cursor: Cursor { bytes: &file[..piece.end], at: piece.start }, free: false };
        let mut number = starts[i];
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
    let parts = all(parallel::collect(pieces.len(), read))?;
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
        return Err(ImportFault::text(file.len(), "the file ends before its last row", WRITE_ANEW));
    }
    Ok(body)
}

/// Reads text as one stream of numbers.
fn read_stream(file: &[u8], header: &Header, plan: &Plan) -> Result<Body, ImportFault> {
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

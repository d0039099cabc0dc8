//! Binary rows of a PLY file: converted in place on all threads where they are all of one length, one after another
//! elsewhere.

use std::sync::atomic::{AtomicBool, Ordering};

use super::super::{ImportFault, Progress};
use super::body::{Body, Faces, PIECE, Row};
use super::header::{DataEncoding, Element, Header, PropertyKind, Scalar};
use super::plan::{NX, Plan, Purpose, RADIUS, RED, SLOTS, U, Use, X};
use super::source::{Binary, Source, binary_value};
use crate::parallel::{self, CHUNK};

/// Reads what follows the header.
pub(super) fn read_binary(
    file: &[u8],
    header: &Header,
    plan: &Plan,
    encoding: DataEncoding,
    progress: &Progress,
) -> Result<Body, ImportFault> {
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

/// Reads an element whose rows are all as long as the first one, on all threads. `false`, with nothing read, if they
/// are not, or if a value is not what it must be: then reading one by one finds out where.
fn read_uniform(
    source: &mut Binary,
    plan: &Plan,
    element: &Element,
    number: usize,
    body: &mut Body,
    progress: &Progress,
) -> Result<bool, ImportFault> {
    // The layout of the first row
    let mut lists: Vec<(usize, Scalar, u64)> = Vec::new();
    let mut slots: [Option<(usize, Scalar)>; SLOTS] = [None; SLOTS];
    let mut indices = None;
    let mut first = Binary { bytes: source.bytes, at: source.at, big: source.big };
    for (property, &what) in element.properties.iter().zip(&plan.uses[number]) {
        let offset = first.at - source.at;
        match property.kind {
            PropertyKind::Scalar(scalar) => {
                if let Use::Slot(slot) = what {
                    slots[slot] = Some((offset, scalar));
                }
                first.skip(scalar, 1)?;
            }
            PropertyKind::List { count, item } => {
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
    let row = |k: usize| &rows[k * stride..(k + 1) * stride];
    let big = source.big;
    let uniform = |row: &[u8]| {
        lists.iter().all(|&(offset, count, length)| binary_value(&row[offset..], count, big) == length as f64)
    };
    let read = |row: &[u8], slot: usize, missing: f32| match slots[slot] {
        Some((offset, scalar)) => (binary_value(&row[offset..], scalar, big) - plan.offsets[slot]) as f32,
        None => missing,
    };
    match purpose {
        _ if purpose == Purpose::Strips || (purpose == Purpose::Faces && plan.face_colors) => return Ok(false),
        // Without lists every row is as long as the first
        _ if !lists.is_empty()
            && purpose != Purpose::Faces
            && !parallel::all(size as usize / stride, CHUNK, |i| uniform(row(i))) =>
        {
            return Ok(false);
        }
        Purpose::Vertices => {
            let count = rows.len() / stride;
            let vertices = &mut body.vertices;
            vertices.positions = parallel::map(count, CHUNK, |k| [0, 1, 2].map(|i| read(row(k), X + i, 0.0)));
            if plan.normals {
                vertices.normals = parallel::map(count, CHUNK, |k| [0, 1, 2].map(|i| read(row(k), NX + i, 0.0)));
            }
            if plan.uvs {
                vertices.uvs = parallel::map(count, CHUNK, |k| [0, 1].map(|i| read(row(k), U + i, 0.0)));
            }
            if let Some(colors) = &plan.colors {
                let raw = |k: usize| [0, 1, 2, 3].map(|i| read(row(k), RED + i, colors.opaque()));
                vertices.colors = parallel::map(count, CHUNK, |k| colors.linear(raw(k)));
            }
            if plan.radii {
                vertices.radii = parallel::map(count, CHUNK, |k| read(row(k), RADIUS, 0.0));
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
    let row = |k: usize| &rows[k * stride..(k + 1) * stride];
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
        fill(&mut faces.triangles, 1, |triangle, k| {
            let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|i| index(row(k), i)) else { return false };
            triangle[0] = [a, b, c];
            uniform(row(k))
        })
    } else {
        faces.sizes = vec![length as u32; count];
        faces.corners = vec![0; count * length];
        length > 0
            && fill(&mut faces.corners, length, |face, k| {
                let read = face.iter_mut().enumerate().all(|(i, corner)| match index(row(k), i) {
                    Some(index) => {
                        *corner = index;
                        true
                    }
                    None => false,
                });
                read && uniform(row(k))
            })
    };
    fine.then_some(faces)
}

/// Has `read` fill a list, `each` elements for each row, whose number it is told; whether it could.
fn fill<T: Send>(list: &mut [T], each: usize, read: impl Fn(&mut [T], usize) -> bool + Sync) -> bool {
    let fine = AtomicBool::new(true);
    parallel::for_each_chunk(list, each * CHUNK, |chunk, list| {
        if !list.chunks_exact_mut(each).zip(chunk * CHUNK..).all(|(face, row)| read(face, row)) {
            fine.store(false, Ordering::Relaxed);
        }
    });
    fine.into_inner()
}

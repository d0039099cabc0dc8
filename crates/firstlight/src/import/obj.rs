//! Wavefront OBJ: polygons, with their texture coordinates, normals, materials, groups and smoothing.
//!
//! Read: `v` (three numbers; red, green, blue after them, sRGB from 0 to 1; a single weight is ignored), `vt`, `vn`,
//! `f` in all forms with indices from 1 or, negative, from the last (those of texture coordinates or normals are left
//! out if the file has none at all), `o`, `g`, `s`, `usemtl`, the names of `mtllib`; `\` at the end of a line goes
//! on with the next, `#` begins a comment. An index may point to what comes later. `l` and `p` are left out; free-form
//! curves and surfaces and all other statements are not understood. Notes count them.
//!
//! Different corners (position, texture coordinates, normal) become vertices in the order of their first use; where the
//! faces use nothing but positions, or the same index for all, vertices are those of the file.
//!
//! Text is read on all threads, a piece of lines each: an index from the last is kept relative to its piece until the
//! pieces before it are counted.
//!
//! Source: Wavefront, "Advanced Visualizer Manual", appendix B1.

mod piece;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Mutex;

use super::error::{WRITE_ANEW, shown};
use super::polygon::{self, PolygonCounts, triangles_of};
use super::text::{Cursor, decoded, pieces};
use super::weld::weld;
use super::{ImportFault, MAX_COUNT, MeshData, MeshPart, Progress, all, linear_of_fraction};
use crate::parallel::{self, CHUNK};
use piece::{Event, MAX_INDEX, NONE, Piece, RELATIVE, corner, skip_blanks, skip_line, word};

/// Bytes of text that one thread reads at a time.
const PIECE: usize = 1 << 20;

/// Reads an OBJ file; positions less `origin`.
pub(super) fn read(file: &[u8], origin: [f64; 3], progress: &Progress) -> Result<MeshData, ImportFault> {
    let start = if file.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    // A piece does not begin with a line that goes on from the one before
    let pieces = pieces(file, start, PIECE, |at| {
        let line = file[..at].strip_suffix(b"\n").unwrap_or(&file[..at]);
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        line.last() != Some(&b'\\')
    });
    let read = |i: usize| {
        let range = &pieces[i];
        let mut piece = Piece { origin, ..Piece::default() };
        piece.read(&file[..range.end], range.start)?;
        progress.advance(range.len())?;
        Ok(piece)
    };
    let mut parts = all(parallel::collect(pieces.len(), read))?;
    let known = join(&mut parts)?;
    resolve(file, &pieces, &mut parts, &known.counts)?;
    build(parts, known)
}

/// Whether a file of unknown name is OBJ: its first statement is one, and no `v = 1` of another language.
pub(super) fn looks_like(file: &[u8]) -> bool {
    let mut text = Cursor { bytes: &file[..file.len().min(1 << 16)], at: 0 };
    loop {
        text.skip_space();
        match text.word() {
            b"v" | b"vt" | b"vn" | b"mtllib" | b"o" | b"g" | b"s" | b"usemtl" => {
                text.skip_blanks();
                return !text.at_line_end() && text.peek() != Some(b'=');
            }
            word if word.starts_with(b"#") => {
                text.rest_of_line();
            }
            _ => return false,
        }
    }
}

/// What belongs to the whole file.
#[derive(Default)]
struct Known {
    positions: Vec<[f32; 3]>,
    colors: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// How many positions, texture coordinates and normals stand before each piece; and, last, in all.
    counts: Vec<[usize; 3]>,
}

/// Moves the lists of all pieces together.
fn join(parts: &mut [Piece]) -> Result<Known, ImportFault> {
    let mut known = Known::default();
    let colored = parts.iter().any(|p| !p.colors.is_empty());
    for part in parts {
        known.counts.push([known.positions.len(), known.uvs.len(), known.normals.len()]);
        if colored {
            part.colors.resize(part.positions.len(), [1.0; 3]);
            known.colors.append(&mut part.colors);
        }
        known.positions.append(&mut part.positions);
        known.uvs.append(&mut part.uvs);
        known.normals.append(&mut part.normals);
    }
    known.counts.push([known.positions.len(), known.uvs.len(), known.normals.len()]);
    let count = known.positions.len().max(known.uvs.len()).max(known.normals.len()) as u64;
    if count > MAX_INDEX as u64 {
        return Err(ImportFault::TooMany { what: "vertices", count, limit: MAX_INDEX as u64 });
    }
    Ok(known)
}

/// Makes all indices count from 1 in the whole file, and checks that they are in range.
/// Texture coordinates and normals of files that have none are left out.
fn resolve(
    file: &[u8],
    pieces: &[Range<usize>],
    parts: &mut [Piece],
    counts: &[[usize; 3]],
) -> Result<(), ImportFault> {
    let all_counts = counts.last().copied().unwrap_or_default();
    let resolve = |(n, corner): (usize, &mut [i32; 3]), before: &[usize; 3]| {
        for (kind, index) in corner.iter_mut().enumerate().filter(|(_, index)| **index != NONE) {
            let value = i64::from(*index);
            // A list that is not there at all: as if the corner did not name it
            if all_counts[kind] == 0 && kind > 0 {
                *index = NONE;
                continue;
            }
            let absolute = if value < 0 { value - RELATIVE + before[kind] as i64 + 1 } else { value };
            if absolute < 1 || absolute > all_counts[kind] as i64 {
                return Some((n, kind, absolute));
            }
            *index = absolute as i32;
        }
        None
    };
    let faults = Mutex::new(Vec::new());
    parallel::for_each_mut(parts, 1, |i, part| {
        if let Some(fault) = part.corners.iter_mut().enumerate().find_map(|corner| resolve(corner, &counts[i])) {
            faults.lock().expect("no thread panics while it holds the faults").push((i, fault));
        }
    });
    let faults = faults.into_inner().expect("no thread panics while it holds the faults");
    let Some((part, (corner, kind, absolute))) = faults.into_iter().min() else { return Ok(()) };
    // Read the piece once more, to find the line
    let at = place_of(&file[..pieces[part].end], pieces[part].start, corner);
    let word = Cursor { bytes: file, at }.word();
    let what = ["positions (v)", "texture coordinates (vt)", "normals (vn)"][kind];
    let points = if absolute < 1 { "before the first" } else { "beyond the last" };
    let message = format!("corner {} points {points} of {} {what}", shown(word), all_counts[kind]);
    Err(ImportFault::text(at, message, WRITE_ANEW))
}

/// Where corner number `wanted` of a piece stands.
fn place_of(bytes: &[u8], start: usize, wanted: usize) -> usize {
    let mut text = Cursor { bytes, at: start };
    let mut seen = 0;
    while !text.at_end() {
        skip_blanks(&mut text);
        let word = word(&mut text);
        if word.starts_with(b"#") {
            text.rest_of_line();
            text.pass_line_end();
            continue;
        }
        if let b"f" | b"fo" = word {
            loop {
                skip_blanks(&mut text);
                if text.at_line_end() || text.peek() == Some(b'#') {
                    break;
                }
                let at = text.at;
                if seen == wanted || corner(&mut text, [0; 3]).is_err() {
                    return at;
                }
                seen += 1;
            }
        }
        skip_line(&mut text);
    }
    start
}

/// Makes a mesh of the pieces, whose indices are all right.
fn build(mut parts: Vec<Piece>, known: Known) -> Result<MeshData, ImportFault> {
    let mut mesh = MeshData::default();
    let corners: usize = parts.iter().map(|p| p.corners.len()).sum();
    if corners as u64 > MAX_COUNT {
        return Err(ImportFault::TooMany { what: "corners of faces", count: corners as u64, limit: MAX_COUNT });
    }
    // Something else altogether
    let known_statements = corners > 0 || !known.positions.is_empty() || parts.iter().any(|p| !p.events.is_empty());
    if let (false, Some(part)) = (known_statements, parts.iter().find(|p| !p.unknown.is_empty())) {
        let word = part.unknown.keys().next().expect("not empty");
        let message = format!("{} and no statement of an OBJ file", shown(word));
        return Err(ImportFault::text(0, message, "an OBJ file has lines that begin with v and f"));
    }
    // Names, materials and groups
    attributes(&parts, &mut mesh);
    statements(&parts, &mut mesh);
    // Triangles, as numbers of corners
    let mut counts = PolygonCounts::default();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut keys: Vec<[i32; 3]> = Vec::with_capacity(corners);
    for part in &mut parts {
        let base = keys.len() as u32;
        if part.sizes.is_empty() {
            triangles.extend((0..part.faces as u32).map(|i| [0, 1, 2].map(|k| base + 3 * i + k)));
        } else {
            let position = |i: usize| known.positions[part.corners[i][0] as usize - 1];
            let (split, split_counts) = polygon::triangulate(&part.sizes, position);
            counts.add(split_counts);
            triangles.extend(split.into_iter().map(|t| t.map(|i| base + i)));
        }
        keys.append(&mut part.corners);
    }
    counts.notes(&mut mesh.notes);
    vertices(&keys, known, &mut mesh, &mut triangles);
    mesh.triangles = triangles;
    Ok(mesh)
}

/// Makes vertices of corners, and lets triangles point to them.
fn vertices(keys: &[[i32; 3]], known: Known, mesh: &mut MeshData, triangles: &mut [[u32; 3]]) {
    let Known { positions, colors, uvs, normals, .. } = known;
    let linear = |c: &[f32; 3]| {
        let [r, g, b] = c.map(linear_of_fraction);
        [r, g, b, 1.0]
    };
    let with = |kind: usize| parallel::count(keys.len(), CHUNK, |i| keys[i][kind] != NONE);
    let (with_uvs, with_normals) = (with(1), with(2));
    for (with, what) in [(with_uvs, "texture coordinates are 0 0"), (with_normals, "normals are 0 0 0")] {
        if with > 0 && with < keys.len() {
            mesh.notes.push(format!("{} of {} corners say none: their {what}", keys.len() - with, keys.len()));
        }
    }
    // The same index for all that there is: vertices are those of the file
    let same = |i: usize, with: usize, list: usize| {
        with == 0
            || (with == keys.len()
                && list == positions.len()
                && parallel::all(keys.len(), CHUNK, |k| keys[k][i] == keys[k][0]))
    };
    if same(1, with_uvs, uvs.len()) && same(2, with_normals, normals.len()) {
        let vertex = |i: u32| keys[i as usize][0] as u32 - 1;
        parallel::for_each_mut(triangles, CHUNK, |_, t| *t = t.map(vertex));
        mesh.colors = parallel::map(colors.len(), CHUNK, |i| linear(&colors[i]));
        mesh.positions = positions;
        mesh.uvs = if with_uvs > 0 { vec![uvs] } else { Vec::new() };
        mesh.normals = if with_normals > 0 { normals } else { Vec::new() };
        return;
    }
    let welded = weld(keys.len(), |i| {
        let [v, vt, vn] = keys[i].map(|index| index as u32);
        [v, vt, vn, 0]
    });
    welded.renumber(triangles);
    let at = |i: usize, kind: usize| (keys[welded.first[i] as usize][kind] as usize).checked_sub(1);
    let used = |i: usize| at(i, 0).expect("every corner has a position");
    let count = welded.first.len();
    mesh.positions = parallel::map(count, CHUNK, |i| positions[used(i)]);
    if !colors.is_empty() {
        mesh.colors = parallel::map(count, CHUNK, |i| linear(&colors[used(i)]));
    }
    if with_uvs > 0 {
        mesh.uvs = vec![parallel::map(count, CHUNK, |i| at(i, 1).map_or([0.0; 2], |n| uvs[n]))];
    }
    if with_normals > 0 {
        mesh.normals = parallel::map(count, CHUNK, |i| at(i, 2).map_or([0.0; 3], |n| normals[n]));
    }
}

/// What was not understood, in words.
fn statements(parts: &[Piece], mesh: &mut MeshData) {
    let mut unknown = Piece::default();
    for part in parts {
        for (word, &times) in &part.unknown {
            unknown.count_unknown(word, times);
        }
        unknown.more_unknown += part.more_unknown;
        unknown.lines_and_points += part.lines_and_points;
        for &names in &part.material_files {
            mesh.material_files.push(text_of(names));
        }
    }
    if unknown.lines_and_points > 0 {
        mesh.notes.push(format!("{} lines and points (l, p) are left out", unknown.lines_and_points));
    }
    const FREE_FORM: [&[u8]; 16] = [
        b"vp", b"cstype", b"deg", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"scrv",
        b"sp", b"end", b"con", b"bzp",
    ];
    if unknown.unknown.keys().any(|word| FREE_FORM.contains(word)) {
        mesh.notes.push("free-form curves and surfaces are not read".into());
    }
    if !unknown.unknown.is_empty() {
        let mut list: Vec<String> =
            unknown.unknown.iter().map(|(word, times)| format!("{} ({times})", shown(word))).collect();
        if unknown.more_unknown > 0 {
            list.push(format!("others ({})", unknown.more_unknown));
        }
        mesh.notes.push(format!("statements that are not understood: {}", list.join(", ")));
    }
}

fn text_of(name: &[u8]) -> String {
    decoded(name).0
}

/// Materials, groups and smoothing of the triangles.
fn attributes(parts: &[Piece], mesh: &mut MeshData) {
    let events = || parts.iter().flat_map(|p| &p.events);
    let with_materials = events().any(|(_, e)| matches!(e, Event::Material(_)));
    let with_parts = events().any(|(_, e)| matches!(e, Event::Object(_) | Event::Group(_)));
    let with_smoothing = events().any(|(_, e)| matches!(e, Event::Smoothing(_)));
    let mut materials: HashMap<&[u8], u32> = HashMap::new();
    let (mut material, mut object, mut group, mut smoothing) = (&b""[..], &b""[..], &b""[..], 0u32);
    let (mut triangles, mut begin) = (0usize, 0usize);
    for part in parts {
        let mut events = part.events.iter().peekable();
        let mut face = 0;
        loop {
            // The triangles up to the next event
            let until = events.peek().map_or(part.faces, |&&(face, _)| face);
            let count = match part.sizes.get(face..until) {
                Some(sizes) => sizes.iter().map(|&s| triangles_of(s)).sum(),
                None => until - face,
            };
            if with_materials && count > 0 {
                let next = materials.len() as u32;
                let id = *materials.entry(material).or_insert_with(|| {
                    mesh.materials.push(text_of(material));
                    next
                });
                mesh.face_materials.resize(triangles + count, id);
            }
            if with_smoothing {
                mesh.smoothing.resize(triangles + count, smoothing);
            }
            triangles += count;
            face = until;
            let Some(&(_, event)) = events.next() else { break };
            let (was_object, was_group) = (object, group);
            match event {
                Event::Material(name) => material = name,
                Event::Smoothing(group) => smoothing = group,
                Event::Object(name) => (object, group) = (name, b""),
                Event::Group(name) => group = name,
            }
            // A part ends where its name does
            if (was_object, was_group) != (object, group) && triangles > begin {
                mesh.parts.push(named(was_object, was_group, begin..triangles));
                begin = triangles;
            }
        }
        debug_assert!((0..part.faces).map(|f| part.size(f)).all(|s| s < u32::MAX));
    }
    if with_parts && triangles > begin {
        mesh.parts.push(named(object, group, begin..triangles));
    }
}

fn named(object: &[u8], group: &[u8], triangles: Range<usize>) -> MeshPart {
    let triangles = triangles.start as u32..triangles.end as u32;
    MeshPart { object: text_of(object), group: text_of(group), triangles }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::MeshFormat;
    use super::*;

    fn read(text: &str) -> MeshData {
        MeshFormat::Obj.read("a.obj", text.as_bytes(), &|_, _| ControlFlow::Continue(())).unwrap()
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn corners_of_all_forms() {
        let mesh = read(&format!("{SQUARE}vt 0 0\nvt 1\nvn 0 0 1\nf 1/1/1 2/2/1 -2/1/-1\nf 1/1/1 -2/-2/1 4/2/1\n"));
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.uvs, [[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]]);
        assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 4]);
        // Some corners say none
        let mesh = read(&format!("{SQUARE}vt 5 6\nvn 0 0 1\nf 1//1 2//1 3/1\n"));
        assert_eq!(mesh.uvs, [[[0.0; 2], [0.0; 2], [5.0, 6.0]]]);
        assert_eq!(mesh.normals[2], [0.0; 3]);
        assert_eq!(mesh.notes.len(), 2);
        // 0 where there is none, and a group that is none
        let zeros = read(&format!("{SQUARE}vt 5 6\nvn 0 0 1\ns null\nf 1/0/1 2/0/0 3/1/1\ns -1\nf 1 2 3\n"));
        assert_eq!((zeros.uvs[0][0], zeros.uvs[0][2]), ([0.0; 2], [5.0, 6.0]));
        assert_eq!(zeros.smoothing, [0, 0]);
        // An index may come before what it points to
        assert_eq!(read(&format!("f 1 2 3\n{SQUARE}")).triangles, [[0, 1, 2]]);
    }

    #[test]
    fn corners_with_the_same_index_for_all_are_the_vertices_of_the_file() {
        let mesh = read(&format!("{SQUARE}v 9 9 9\nf 4 3 2 1\n"));
        assert_eq!((mesh.positions.len(), mesh.triangles), (5, vec![[3, 2, 1], [3, 1, 0]]));
        let mesh = read(&format!("{SQUARE}vn 0 0 1\nvn 0 0 2\nvn 0 0 3\nvn 0 0 4\nf 4//4 3//3 2//2\n"));
        assert_eq!((mesh.positions.len(), mesh.normals[3]), (4, [0.0, 0.0, 4.0]));
    }

    #[test]
    fn colors_weights_and_lines_that_go_on() {
        let mesh = read("v 0 0 0 1 0.5 0\nv 1 0 0 2\nv 1 \\\n 1 \\\r\n 0\nf 1 2 \\\n3 # 4 5\n# a path\\\nf 3 2 1\n");
        // 0.5 is sRGB, of which 0.214 is the light
        let half = 0.214_041_14;
        assert_eq!(mesh.colors, [[1.0, half, 0.0, 1.0], [1.0; 4], [1.0; 4]]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 0]]);
        // Directly after a word or a number, within names, and where the file ends
        let text = "v\\\n0 0 0\nv 1\\\r\n0 0\nvt 1\\\n2\nv 1 1 0\\\n0.5\\\n0.25 1\ng one\\\ntwo\nf\\\n1 2\\\n3\ns\\\n";
        for end in ["off\nf 3 2 1", "off\nf\\\r3 2 1\\", "off\nf 3 2 1 \\", "\\\noff\nf 3 2 1\n\\"] {
            let mesh = read(&format!("{text}{end}"));
            assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 0]], "{end:?}");
            assert_eq!(mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], "{end:?}");
            assert_eq!((mesh.colors[2], mesh.parts[0].group.as_str()), ([half, 0.050_876_09, 1.0, 1.0], "one"));
            assert_eq!((&mesh.smoothing[..], mesh.notes.len()), (&[0, 0][..], 0));
        }
    }

    #[test]
    fn materials_parts_and_smoothing() {
        let text =
            "mtllib a.mtl b c.mtl\nf 1 2 3\no cup\ng inside top\nusemtl gold\ns 3\nf 1 2 3 4\ng\ns off\nf 1 2 3\n";
        let mesh = read(&format!("{text}o\nusemtl red\nusemtl gold\nf 1 2 3\n{SQUARE}"));
        assert_eq!(mesh.materials, ["", "gold"]);
        assert_eq!(mesh.face_materials, [0, 1, 1, 1, 1]);
        assert_eq!(mesh.smoothing, [0, 3, 3, 0, 0]);
        assert_eq!(mesh.material_files, ["a.mtl b c.mtl"]);
        let parts: Vec<_> =
            mesh.parts.iter().map(|p| (p.object.as_str(), p.group.as_str(), p.triangles.clone())).collect();
        assert_eq!(parts, [("", "", 0..1), ("cup", "inside top", 1..3), ("cup", "", 3..4), ("", "", 4..5)]);
    }

    #[test]
    fn what_is_not_understood_is_noted() {
        let mesh = read(&format!("{SQUARE}l 1 2\np 1\ncstype bezier\nf 1 2 3\nwhat 1\nf 1 2\nend\n"));
        assert_eq!(
            mesh.notes,
            [
                "2 lines and points (l, p) are left out",
                "free-form curves and surfaces are not read",
                "statements that are not understood: `cstype` (1), `end` (1), `what` (1)",
                "1 faces of less than 3 corners are left out",
            ]
        );
    }
}

//! Mesh files from outside: what is read of PLY, STL and OBJ, and what is said of files that are broken.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use firstlight::{ImportError, MeshData, MeshFormat, read_mesh};
use firstlight_testkit::{Random, hostile_mesh};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../firstlight/tests/models")
}

fn try_read(name: &str, bytes: &[u8]) -> Result<MeshData, ImportError> {
    read_mesh(name, bytes, &|_, _| ControlFlow::Continue(()))
}

fn read(name: &str, bytes: &[u8]) -> MeshData {
    try_read(name, bytes).unwrap_or_else(|error| panic!("{error}"))
}

fn read_file(path: &str) -> MeshData {
    read(path, &std::fs::read(folder().join(path)).unwrap())
}

/// The positions of all triangles' corners.
fn corners(mesh: &MeshData) -> Vec<[[f32; 3]; 3]> {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect()
}

#[test]
fn files_of_others_have_the_right_counts() {
    // File, vertices, triangles, normals, sets of texture coordinates, parts, materials
    let table: [(&str, usize, usize, bool, usize, usize, usize); 20] = [
        ("ply/cube.ply", 8, 12, false, 0, 0, 0),
        ("ply/cube_binary.ply", 8, 12, false, 0, 0, 0),
        ("ply/cube_uv.ply", 24, 12, true, 1, 0, 0),
        ("ply/platonic_shelf_ascii.ply", 50, 80, false, 0, 0, 0),
        ("ply/platonic_shelf_big_endian.ply", 50, 80, false, 0, 0, 0),
        ("stl/stl_ascii_Moon.stl", 60, 116, false, 0, 1, 0),
        ("stl/stl_binary_Moon.stl", 60, 116, false, 0, 0, 0),
        ("stl/stl_ascii_Star.stl", 36, 68, false, 0, 1, 0),
        ("stl/stl_binary_Star.stl", 36, 68, false, 0, 0, 0),
        ("stl/stl_binary_HalfDonut.stl", 144, 288, false, 0, 0, 0),
        ("obj/cube.obj", 8, 12, false, 0, 6, 3),
        ("obj/cornell_box.obj", 76, 36, false, 0, 8, 4),
        ("obj/cornell_box_multimaterial.obj", 76, 36, false, 0, 8, 4),
        ("obj/smoothing-group-two-squares.obj", 6, 3, false, 0, 1, 0),
        ("obj/spot.obj", 3225, 5856, false, 1, 0, 0),
        ("obj/teapot.obj", 3644, 6320, false, 0, 0, 0),
        ("obj/texture-options-issue-85.obj", 3, 1, false, 0, 1, 1),
        ("obj/pbr-mat-ext.obj", 4, 2, false, 0, 1, 1),
        ("obj/box-textured/box-textured.obj", 24, 12, true, 1, 1, 1),
        ("obj/box-negative-indices/box-negative-indices.obj", 8, 12, false, 0, 1, 1),
    ];
    let mut wrong = String::new();
    for row in table {
        let mesh = read_file(row.0);
        let found = (
            row.0,
            mesh.positions.len(),
            mesh.triangles.len(),
            !mesh.normals.is_empty(),
            mesh.uvs.len(),
            mesh.parts.len(),
            mesh.materials.len(),
        );
        if found != row {
            writeln!(wrong, "{found:?}, not {row:?}; {:?}", mesh.notes).unwrap();
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn text_and_binary_twins_are_the_same_mesh() {
    assert_eq!(read_file("ply/platonic_shelf_ascii.ply"), read_file("ply/platonic_shelf_big_endian.ply"));
    for solid in ["Moon", "Star"] {
        let text = read_file(&format!("stl/stl_ascii_{solid}.stl"));
        let binary = read_file(&format!("stl/stl_binary_{solid}.stl"));
        // Six digits in the text
        for (a, b) in corners(&text).iter().flatten().flatten().zip(corners(&binary).iter().flatten().flatten()) {
            assert!((a - b).abs() <= 2e-6 * b.abs().max(1.0), "{solid}: {a} {b}");
        }
        assert_eq!(text.triangles, binary.triangles, "{solid}");
    }
}

#[test]
fn materials_groups_and_smoothing_of_an_obj() {
    let cube = read_file("obj/cube.obj");
    assert_eq!(cube.materials, ["white", "red", "green"]);
    assert_eq!(cube.face_materials, [0, 0, 0, 0, 1, 1, 0, 0, 2, 2, 0, 0]);
    assert_eq!(cube.material_files, ["cube.mtl"]);
    let names: Vec<&str> = cube.parts.iter().map(|p| p.group.as_str()).collect();
    assert_eq!(names, ["front cube", "back  cube", "right cube", "top cube", "left cube", "bottom cube"]);
    assert_eq!(cube.parts[2].triangles, 4..6);
    let squares = read_file("obj/smoothing-group-two-squares.obj");
    assert_eq!(squares.smoothing.len(), 3);
    let boxes = read_file("obj/box-objects-groups-materials/box-objects-groups-materials.obj");
    assert_eq!(boxes.triangles.len(), 36);
    assert_eq!(boxes.materials.len(), 3);
    assert!(boxes.parts.iter().all(|p| !p.object.is_empty()), "{:?}", boxes.parts);
}

/// A PLY file in one of the three encodings, value by value.
struct PlyWriter {
    kind: u32,
    bytes: Vec<u8>,
    line: Vec<String>,
}

impl PlyWriter {
    fn put<T: ToString, const N: usize>(&mut self, value: T, little: [u8; N], big: [u8; N]) {
        match self.kind {
            0 => self.line.push(value.to_string()),
            1 => self.bytes.extend(little),
            _ => self.bytes.extend(big),
        }
    }

    /// A value of a type.
    fn value(&mut self, of: &str, value: f64) {
        match of {
            "char" | "int8" => self.put(value as i8, (value as i8).to_le_bytes(), (value as i8).to_be_bytes()),
            "uchar" | "uint8" => self.put(value as u8, (value as u8).to_le_bytes(), (value as u8).to_be_bytes()),
            "short" | "int16" => self.put(value as i16, (value as i16).to_le_bytes(), (value as i16).to_be_bytes()),
            "ushort" | "uint16" => self.put(value as u16, (value as u16).to_le_bytes(), (value as u16).to_be_bytes()),
            "int" | "int32" => self.put(value as i32, (value as i32).to_le_bytes(), (value as i32).to_be_bytes()),
            "uint" | "uint32" => self.put(value as u32, (value as u32).to_le_bytes(), (value as u32).to_be_bytes()),
            "float" | "float32" => self.put(value as f32, (value as f32).to_le_bytes(), (value as f32).to_be_bytes()),
            _ => self.put(value, value.to_le_bytes(), value.to_be_bytes()),
        }
    }

    fn end_row(&mut self, line_end: &str) {
        if self.kind == 0 {
            self.bytes.extend(format!("{}{line_end}", self.line.join(" ")).bytes());
            self.line.clear();
        }
    }
}

#[test]
fn ply_of_any_layout_comes_back_in_all_encodings() {
    let mut random = Random::new(1);
    let reals = ["float", "float32", "double", "float64"];
    let wholes = ["char", "int8", "uchar", "uint8", "short", "int16", "ushort", "uint16", "int", "int32", "uint"];
    for round in 0..300 {
        let line_end = ["\n", "\r\n", "\r"][round % 3];
        // Properties of vertices in any order, with unknown ones and lists among them
        let attributes: [(&[&str], u32); 5] = [
            (&["x", "y", "z"], 1),
            (&["nx", "ny", "nz"], random.below(2)),
            (&["s", "t"], random.below(2)),
            (&["red", "green", "blue"], random.below(2)),
            (&["radius"], random.below(2)),
        ];
        let mut properties: Vec<(String, &str, bool)> = Vec::new();
        for (names, present) in attributes {
            for name in names.iter().filter(|_| present == 1) {
                let of = if *name == "red" || *name == "green" || *name == "blue" {
                    "uchar"
                } else {
                    reals[random.below(4) as usize]
                };
                properties.push((name.to_string(), of, false));
            }
        }
        for i in 0..random.below(3) {
            properties.push((format!("unknown{i}"), wholes[random.below(11) as usize], random.below(2) == 1));
        }
        for i in (1..properties.len()).rev() {
            properties.swap(i, random.below(i as u32 + 1) as usize);
        }
        let (vertices, faces) = (3 + random.below(40), random.below(30));
        let index = ["uchar", "int", "uint", "short"][random.below(4) as usize];
        let triangles_only = random.below(2) == 1;
        let faces_first = random.below(2) == 1;
        let values: Vec<Vec<f64>> =
            (0..vertices).map(|_| properties.iter().map(|_| f64::from(random.below(100)) / 4.0).collect()).collect();
        let polygons: Vec<Vec<u32>> = (0..faces)
            .map(|_| {
                let size = if triangles_only { 3 } else { random.below(7) };
                (0..size).map(|_| random.below(vertices)).collect()
            })
            .collect();
        let meshes: Vec<MeshData> = (0..3)
            .map(|kind| {
                let format = ["ascii", "binary_little_endian", "binary_big_endian"][kind as usize];
                let mut lines = vec!["ply".into(), format!("format {format} 1.0"), "comment a b".into()];
                let mut vertex_lines = vec![format!("element vertex {vertices}")];
                for (name, of, list) in &properties {
                    let list = if *list { "list uchar " } else { "" };
                    vertex_lines.push(format!("property {list}{of} {name}"));
                }
                let face_lines =
                    vec![format!("element face {faces}"), format!("property list uchar {index} vertex_indices")];
                let (first, second) = if faces_first { (face_lines, vertex_lines) } else { (vertex_lines, face_lines) };
                lines.extend(first);
                lines.extend(second);
                lines.push("end_header".into());
                let header = lines.iter().map(|l| format!("{l}{line_end}")).collect::<String>();
                let mut out = PlyWriter { kind, bytes: header.into_bytes(), line: Vec::new() };
                for element in 0..2 {
                    if (element == 0) == faces_first {
                        for polygon in &polygons {
                            out.value("uchar", polygon.len() as f64);
                            polygon.iter().for_each(|&v| out.value(index, f64::from(v)));
                            out.end_row(line_end);
                        }
                    } else {
                        for row in &values {
                            for (value, (_, of, list)) in row.iter().zip(&properties) {
                                if *list {
                                    let length = (*value as u32) % 4;
                                    out.value("uchar", f64::from(length));
                                    (0..length).for_each(|_| out.value(of, *value));
                                } else {
                                    out.value(of, *value);
                                }
                            }
                            out.end_row(line_end);
                        }
                    }
                }
                read("a.ply", &out.bytes)
            })
            .collect();
        assert_eq!(meshes[0], meshes[1]);
        assert_eq!(meshes[0], meshes[2]);
        let mesh = &meshes[0];
        assert_eq!(mesh.positions.len(), vertices as usize);
        assert_eq!(mesh.triangles.len(), polygons.iter().map(|p| p.len().saturating_sub(2)).sum::<usize>());
        let column = |name: &str| properties.iter().position(|p| p.0 == name);
        for (v, row) in values.iter().enumerate() {
            let of = |name: &str| column(name).map_or(f32::NAN, |i| row[i] as f32);
            assert_eq!(mesh.positions[v], [of("x"), of("y"), of("z")]);
            if column("nx").is_some() {
                assert_eq!(mesh.normals[v], [of("nx"), of("ny"), of("nz")]);
            }
            if column("s").is_some() {
                assert_eq!(mesh.uvs[0][v], [of("s"), of("t")]);
            }
            if column("radius").is_some() {
                assert_eq!(mesh.radii[v], of("radius"));
            }
            if column("red").is_some() {
                let linear = |name: &str| {
                    let encoded = f64::from(of(name).trunc()) / 255.0;
                    firstlight::Encoding::Srgb.decode(encoded) as f32
                };
                assert_eq!(mesh.colors[v], [linear("red"), linear("green"), linear("blue"), 1.0]);
            }
        }
        assert_eq!(
            (mesh.normals.len(), mesh.colors.len()),
            (column("nx").map_or(0, |_| vertices as usize), column("red").map_or(0, |_| vertices as usize),)
        );
    }
}

/// A large OBJ text with all that depends on where it is cut: relative indices, groups, lines that go on.
fn large_obj(faces: u32) -> String {
    let mut text = String::from("mtllib a.mtl\no first\n");
    for i in 0..faces {
        let x = i as f32 * 0.37;
        write!(text, "v {x} {} 0.5\nv {x} 1 {}\nvt {x} 0\nv 0 {x} 1e-3\nvn 0 {} 1\n", x + 1.0, x * 2.0, i % 3).unwrap();
        match i % 5 {
            0 => writeln!(text, "f -1/-1/-1 -2/-1/-1 \\\n -3/-1/-1").unwrap(),
            1 => writeln!(text, "g group {}\nf {}/1/1 {}/1/1 {}//1 -1//-1", i % 9, 3 * i + 1, 3 * i + 2, 3 * i + 3)
                .unwrap(),
            2 => writeln!(text, "usemtl m{}\nf {} {} {}", i % 7, 3 * i + 1, 3 * i + 2, 3 * i + 3).unwrap(),
            3 => writeln!(text, "s {}\n", i % 4).unwrap(),
            _ => writeln!(text, "l 1 2\n# f 0 0 0\ncurv 0 1 1").unwrap(),
        }
    }
    text
}

/// A large PLY text whose rows are cut anywhere.
fn large_ply(vertices: u32) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {vertices}\n");
    text += "property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
        property uchar blue\n";
    writeln!(text, "element face {vertices}\nproperty list uchar int vertex_indices\nend_header").unwrap();
    for i in 0..vertices {
        writeln!(text, "{} {:.3} {:e} {} 7 255", i, i as f32 * 0.1, i as f32 / 3.0, i % 256).unwrap();
    }
    for i in 0..vertices {
        let v = |n: u32| (i + n) % vertices;
        if i % 10 == 9 {
            writeln!(text, "4 {} {} {} {}", i, v(1), v(2), v(3))
        } else {
            writeln!(text, "3 {} {} {}", i, v(1), v(2))
        }
        .unwrap();
    }
    text
}

fn large_stl(facets: u32) -> String {
    let mut text = String::new();
    for i in 0..facets {
        if i % 10_000 == 0 {
            if i > 0 {
                text += "endsolid\n";
            }
            writeln!(text, "solid part {i}").unwrap();
        }
        let v = |n: u32| format!("vertex {} {} 0\n", (i + n) / 2, (i + n) % 2);
        write!(text, "facet normal 0 0 1\n outer loop\n{}{}{} endloop\nendfacet\n", v(0), v(1), v(2)).unwrap();
    }
    text + "endsolid\n"
}

#[test]
fn the_mesh_does_not_depend_on_the_number_of_threads() {
    let files = [("a.obj", large_obj(60_000)), ("a.ply", large_ply(150_000)), ("a.stl", large_stl(40_000))];
    for (name, text) in files {
        assert!(text.len() > 3 << 20, "{name} has {} bytes", text.len());
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| read(name, text.as_bytes()))
        };
        let mesh = with(1);
        assert!(mesh == with(5), "{name}");
        assert!(mesh.triangles.len() >= 40_000, "{name}");
        if name == "a.stl" {
            assert_eq!((mesh.parts.len(), mesh.positions.len()), (4, 40_002));
            assert_eq!(mesh.parts[3].object, "part 30000");
        }
        // Lines may end otherwise, and rows of PLY may be broken
        let windows = text.replace('\n', "\r\n");
        assert!(mesh == read(name, windows.as_bytes()), "{name}");
        if name == "a.ply" {
            let (header, body) = text.split_once("end_header\n").unwrap();
            let stream = format!("{header}end_header\n{}", body.replace(' ', "\n"));
            assert!(mesh == read(name, stream.as_bytes()));
        }
    }
}

#[test]
fn every_broken_file_is_refused_in_these_words() {
    let mut cases: Vec<PathBuf> =
        std::fs::read_dir(folder().join("hostile")).unwrap().map(|entry| entry.unwrap().path()).collect();
    cases.retain(|path| path.extension().is_some_and(|e| e != "expected"));
    cases.sort();
    assert!(cases.len() >= 40, "{} cases", cases.len());
    let mut wrong = String::new();
    for case in cases {
        let name = case.file_name().unwrap().to_str().unwrap();
        let expectation = case.with_file_name(format!("{name}.expected"));
        let start = Instant::now();
        let actual = match try_read(name, &std::fs::read(&case).unwrap()) {
            Err(error) => format!("{error}\n"),
            Ok(_) => String::new(),
        };
        assert!(start.elapsed() < Duration::from_secs(5), "{name} took {:?}", start.elapsed());
        let expected = std::fs::read_to_string(&expectation).unwrap_or_default();
        if actual.is_empty() || actual != expected {
            writeln!(wrong, "== {name}\n-- expected\n{expected}-- actual\n{actual}").unwrap();
            if std::env::var_os("FIRSTLIGHT_BLESS").is_some() && !actual.is_empty() {
                std::fs::write(&expectation, &actual).unwrap();
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}FIRSTLIGHT_BLESS=1 writes what is said now");
}

#[test]
fn large_hostile_files_are_answered_soon() {
    let polygon = |corners: u32| {
        // A comb: concave, and of the worst size
        let mut text = String::new();
        for i in 0..corners {
            writeln!(text, "v {} {} 0", i, if i % 2 == 0 { 0.0 } else { 5.0 + i as f32 }).unwrap();
        }
        text += "f";
        for i in 1..=corners {
            write!(text, " {i}").unwrap();
        }
        text
    };
    // The same one many times
    let polygons = |corners: u32, times: usize| {
        let text = polygon(corners);
        let face = text.rfind('f').unwrap();
        (text.clone() + &format!("\n{}", &text[face..]).repeat(times)).into_bytes()
    };
    let files: Vec<(&str, Vec<u8>)> = vec![
        ("polygon.obj", polygon(1_000_000).into_bytes()),
        ("polygons.obj", polygons(4096, 300)),
        ("small-polygons.obj", polygons(64, 20_000)),
        ("line.obj", [b"v ".to_vec(), vec![b'1'; 20_000_000]].concat()),
        ("continued.obj", b"f \\\n".repeat(5_000_000)),
        ("words.obj", (0..2_000_000).flat_map(|i| format!("w{i}\n").into_bytes()).collect()),
        (
            "materials.obj",
            (0..1_000_000).flat_map(|i| format!("usemtl {i}\nf 1 1 1\n").into_bytes()).chain(*b"v 0 0 0").collect(),
        ),
        (
            "corner.obj",
            [
                b"v 0 0 0\n".to_vec(),
                b"vt 0\n".repeat(500_000),
                (0..500_000).flat_map(|i| format!("f 1/{} 1/1 1/1\n", i + 1).into_bytes()).collect(),
            ]
            .concat(),
        ),
        ("header.ply", [b"ply\nformat ascii 1.0\n".to_vec(), b"comment\n".repeat(5_000_000)].concat()),
        ("properties.ply", [b"ply\nelement vertex 1\n".to_vec(), b"property float x\n".repeat(1_000_000)].concat()),
        ("cr.ply", [b"ply\n".to_vec(), vec![b'\r'; 20_000_000]].concat()),
        ("solid.stl", [b"solid facet".to_vec(), vec![b' '; 20_000_000]].concat()),
        ("words.stl", [b"solid\n facet".to_vec(), b" normal".repeat(3_000_000)].concat()),
        ("lines.stl", [b"solid\n".to_vec(), b"facet normal\n".repeat(2_000_000)].concat()),
        ("zeros.stl", vec![0; 20_000_000]),
    ];
    for (name, bytes) in files {
        let start = Instant::now();
        let _ = try_read(name, &bytes);
        println!("{name}: {} bytes in {:?}", bytes.len(), start.elapsed());
        assert!(start.elapsed() < Duration::from_secs(10), "{name} took {:?}", start.elapsed());
    }
}

#[test]
fn reading_can_be_stopped() {
    for (name, text) in [("a.obj", large_obj(1000)), ("a.ply", large_ply(1000)), ("a.stl", large_stl(1000))] {
        let error = read_mesh(name, text.as_bytes(), &|_, _| ControlFlow::Break(())).unwrap_err();
        assert_eq!(error, ImportError::Stopped { file: name.into() });
    }
}

#[test]
fn the_kind_of_a_file_is_found() {
    let of = |name: &str, bytes: &[u8]| MeshFormat::detect(name, bytes);
    assert_eq!(of("a.stl", b"ply\nformat"), Some(MeshFormat::Ply));
    assert_eq!(of("a.STL", b""), Some(MeshFormat::Stl));
    assert_eq!(of("a", b"solid x\nfacet normal 0 0 0"), Some(MeshFormat::Stl));
    assert_eq!(of("a", &[0; 84]), Some(MeshFormat::Stl));
    assert_eq!(of("a", b"# text\n\nv 0 0 0"), Some(MeshFormat::Obj));
    assert_eq!(of("a.bin", b"glTF"), None);
    assert_eq!(
        try_read("a.bin", b"glTF").unwrap_err().to_string(),
        "a.bin: looks like a binary glTF model (GLB), not like a mesh; give it as a model (.glb, .gltf), or name it as \
         the file of a [[model]]"
    );
}

#[test]
fn nothing_in_the_corpora_breaks_the_readers() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    for (kind, format) in [("ply", MeshFormat::Ply), ("stl", MeshFormat::Stl), ("obj", MeshFormat::Obj)] {
        let mut inputs = 0;
        for entry in std::fs::read_dir(corpus.join(kind)).unwrap() {
            hostile_mesh::check(format, &std::fs::read(entry.unwrap().path()).unwrap());
            inputs += 1;
        }
        assert!(inputs >= 5, "{inputs} inputs of {kind}");
    }
}

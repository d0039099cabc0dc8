//! Small files made by hand, one feature each, with the numbers that are known on paper.

use serde_json::{Value, json};

use super::{Gltf, MeshAddress, Pose};
use crate::context::AssetError;
use crate::import::MeshData;
use crate::math::DVec3;

/// Bytes as a data URI.
fn data_uri(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::from("data:application/octet-stream;base64,");
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0u32, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

/// A buffer in the making: each list of it is a buffer view of its own.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, mut accessor: Value, bytes: &[u8]) -> usize {
        accessor["bufferView"] = self.view(bytes).into();
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats(&mut self, kind: &str, width: usize, numbers: &[f32]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(json!({ "componentType": 5126, "type": kind, "count": numbers.len() / width }), &bytes)
    }

    fn shorts(&mut self, kind: &str, width: usize, numbers: &[u16]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(json!({ "componentType": 5123, "type": kind, "count": numbers.len() / width }), &bytes)
    }

    /// The file that holds it and `rest`.
    fn file(&self, rest: Value) -> Gltf {
        open(&self.text(rest)).unwrap_or_else(|fault| panic!("{fault:?}"))
    }

    fn text(&self, rest: Value) -> Value {
        let mut file = json!({
            "asset": { "version": "2.0" },
            "buffers": [{ "uri": data_uri(&self.bytes), "byteLength": self.bytes.len() }],
            "bufferViews": self.views,
            "accessors": self.accessors,
        });
        let rest = rest.as_object().expect("is an object");
        for (key, value) in rest {
            file[key] = value.clone();
        }
        file
    }
}

fn open(file: &Value) -> Result<Gltf, super::GltfFault> {
    Gltf::open("a.gltf", file.to_string().as_bytes(), &|_, _| Err(AssetError::NotFound))
}

/// A triangle with its right angle at 0.
const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn mesh_of(gltf: &Gltf) -> MeshData {
    gltf.mesh(&MeshAddress::Mesh(0)).unwrap_or_else(|fault| panic!("{fault:?}"))
}

fn close(a: &[[f32; 3]], b: &[[f32; 3]]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-6), "{a:?}, not {b:?}");
    }
}

#[test]
fn strips_and_fans_turn_as_triangles_do() {
    let mut buffer = Buffer::default();
    let square = buffer.floats("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let primitive = |mode: usize| json!({ "attributes": { "POSITION": square }, "mode": mode });
    let of = |mode| mesh_of(&buffer.file(json!({ "meshes": [{ "primitives": [primitive(mode)] }] })));
    assert_eq!(of(4).triangles, [[0, 1, 2]]);
    assert_eq!(of(5).triangles, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(of(6).triangles, [[1, 2, 0], [2, 3, 0]]);
    assert_eq!(of(1).triangles, [[0u32; 3]; 0]);
    assert_eq!(of(0).notes, ["/meshes/0/primitives/0: points are left out; triangles are read"]);
}

#[test]
fn numbers_of_every_type_are_read() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    // Bytes with a sign, as parts of 1, with a stride of 4
    let normal = buffer.accessor(
        json!({ "componentType": 5120, "type": "VEC3", "count": 3, "normalized": true }),
        &[0, 0, 127, 9, 129, 0, 0, 9, 128, 0, 0, 9],
    );
    buffer.views[1]["byteStride"] = 4.into();
    let uv = buffer.accessor(
        json!({ "componentType": 5123, "type": "VEC2", "count": 3, "normalized": true }),
        &[0, 0, 255, 255, 255, 255, 0, 0, 0, 128, 0, 0],
    );
    let color = buffer.accessor(
        json!({ "componentType": 5121, "type": "VEC3", "count": 3, "normalized": true }),
        &[255, 0, 51, 0, 0, 0, 102, 204, 255],
    );
    let indices = buffer.accessor(
        json!({ "componentType": 5125, "type": "SCALAR", "count": 3 }),
        &[2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0],
    );
    let attributes = json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color });
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
    let gltf = buffer.file(json!({
        "meshes": [{ "primitives": [primitive] }],
        "materials": [{ "name": "red" }],
    }));
    let mesh = mesh_of(&gltf);
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
    // v runs upwards here
    assert_eq!(mesh.uvs, [[[0.0, 0.0], [1.0, 1.0], [32768.0 / 65535.0, 1.0]]]);
    assert_eq!(mesh.colors, [[1.0, 0.0, 0.2, 1.0], [0.0, 0.0, 0.0, 1.0], [0.4, 0.8, 1.0, 1.0]]);
    assert_eq!((mesh.triangles, mesh.face_materials), (vec![[2, 0, 1]], vec![0]));
    assert_eq!(mesh.materials, ["red"]);
    assert!(mesh.notes.is_empty());
}

#[test]
fn absent_and_sparse_accessors_are_zeros_and_what_replaces_them() {
    let mut buffer = Buffer::default();
    let indices = buffer.view(&[1, 0, 2, 0]);
    let values =
        buffer.view(&[1.0f32, 0.0, 0.0, 0.0, 2.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>());
    buffer.accessors.push(json!({
        "componentType": 5126, "type": "VEC3", "count": 3,
        "sparse": {
            "count": 2,
            "indices": { "bufferView": indices, "componentType": 5123 },
            "values": { "bufferView": values },
        },
    }));
    let file = json!({ "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }] });
    assert_eq!(mesh_of(&buffer.file(file.clone())).positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    // Nothing is made because a file says so: 48 GB of zeros
    buffer.accessors[0] = json!({ "componentType": 5126, "type": "VEC3", "count": 4_000_000_000u64 });
    let fault = buffer.file(file).mesh(&MeshAddress::Mesh(0)).expect_err("is too large");
    assert!(fault.message.starts_with("45776 MiB more are needed"), "{}", fault.message);
    assert_eq!(fault.pointer, "/meshes/0/primitives/0/attributes/POSITION");
}

#[test]
fn what_only_some_primitives_have_is_made_up_for_the_others() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let normal = buffer.floats("VEC3", 3, &[0.0, 0.0, 1.0].repeat(3));
    let uv = buffer.floats("VEC2", 2, &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    let color = buffer.floats("VEC4", 4, &[0.5; 12]);
    let plain = json!({ "attributes": { "POSITION": position } });
    let rich = json!({ "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color } });
    let mesh = mesh_of(&buffer.file(json!({ "meshes": [{ "primitives": [plain, rich, plain] }] })));
    assert_eq!(mesh.fault(), None);
    assert_eq!(mesh.normals[2..7], [[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0; 3]]);
    assert_eq!(mesh.uvs[0][2..5], [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]);
    assert_eq!((mesh.colors[2], mesh.colors[3], mesh.colors[8]), ([1.0; 4], [0.5; 4], [1.0; 4]));
    assert_eq!(mesh.face_materials, [0, 1, 2]);
    let alone = mesh_of(&buffer.file(json!({ "meshes": [{ "primitives": [plain] }] })));
    assert!(alone.normals.is_empty() && alone.colors.is_empty() && alone.uvs.is_empty());
}

#[test]
fn morph_targets_move_by_their_weights() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let up = buffer.floats("VEC3", 3, &[0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0]);
    let right = buffer.floats("VEC3", 3, &[10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let times = buffer.floats("SCALAR", 1, &[0.0, 2.0]);
    let weights = buffer.floats("SCALAR", 1, &[0.0, 0.0, 1.0, 0.5]);
    let primitive = json!({
        "attributes": { "POSITION": position },
        "targets": [{ "POSITION": up }, { "POSITION": right }],
    });
    let gltf = buffer.file(json!({
        "meshes": [{ "primitives": [primitive], "weights": [0.5, 0.0] }],
        "nodes": [{ "mesh": 0 }, { "mesh": 0, "weights": [0.0, 0.1] }],
        "animations": [{
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
            "samplers": [{ "input": times, "output": weights }],
        }],
    }));
    let of = |address| gltf.mesh(&address).unwrap_or_else(|fault| panic!("{fault:?}")).positions;
    close(&of(MeshAddress::Mesh(0)), &[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 2.0]]);
    close(&of(MeshAddress::Node(0, None)), &of(MeshAddress::Mesh(0)));
    close(&of(MeshAddress::Node(1, None)), &[[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    // A quarter of the way from (0, 0) to (1, 0.5); before and after, the ends
    let at = |time| of(MeshAddress::Node(0, Some(Pose { animation: 0, time })));
    close(&at(0.5), &[[1.25, 0.0, 0.5], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]]);
    close(&at(-3.0), &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    close(&at(9.0), &[[5.0, 0.0, 2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 4.0]]);
}

#[test]
fn bones_place_vertices_in_the_scene() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let normal = buffer.floats("VEC3", 3, &[1.0, 0.0, 0.0].repeat(3));
    let joints = buffer.shorts("VEC4", 4, &[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    // The last one half on each bone
    let weights = buffer.floats("VEC4", 4, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
    // Bone 1 was bound at (1, 0, 0)
    let mut bind = [0.0f32; 32];
    for i in 0..4 {
        (bind[5 * i], bind[16 + 5 * i]) = (1.0, 1.0);
    }
    bind[16 + 12] = -1.0;
    let bind = buffer.floats("MAT4", 16, &bind);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let gltf = buffer.file(json!({
        "meshes": [{ "primitives": [{ "attributes": {
            "POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights,
        } }] }],
        "skins": [{ "joints": [1, 2], "inverseBindMatrices": bind }],
        "nodes": [
            // Where the mesh itself is does not matter
            { "mesh": 0, "skin": 0, "translation": [100, 100, 100] },
            { "translation": [0, 0, 5], "children": [2] },
            // A quarter turn about z, at (2, 0, 5)
            { "translation": [2, 0, 0], "rotation": [0, 0, half, half] },
        ],
    }));
    let mesh = gltf.mesh(&MeshAddress::Node(0, None)).unwrap_or_else(|fault| panic!("{fault:?}"));
    // (0, 1, 0): half of (0, 1, 5); half of (-1, 1, 0) turned to (-1, -1, 0) and moved to (1, -1, 5)
    close(&mesh.positions, &[[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [0.5, 0.0, 5.0]]);
    close(&mesh.normals, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [half, half, 0.0]]);
}

#[test]
fn animations_are_sampled_as_they_say() {
    let mut buffer = Buffer::default();
    let times = buffer.floats("SCALAR", 1, &[1.0, 3.0]);
    let moves = buffer.floats("VEC3", 3, &[0.0, 0.0, 0.0, 2.0, 4.0, 6.0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turns = buffer.floats("VEC4", 4, &[0.0, 0.0, 0.0, 1.0, 0.0, -half, 0.0, -half]);
    // Tangent before, value, tangent behind
    let cubic = buffer.floats(
        "VEC3",
        3,
        &[9.0, 9.0, 9.0, 1.0, 1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 4.0, 3.0, 1.0, 1.0, 9.0, 9.0, 9.0],
    );
    let channel = |sampler: usize, path: &str| json!({ "sampler": sampler, "target": { "node": 0, "path": path } });
    let gltf = buffer.file(json!({
        "nodes": [{ "translation": [7, 7, 7], "scale": [1, 1, 1] }],
        "animations": [
            {
                "channels": [channel(0, "translation"), channel(1, "rotation"), channel(2, "scale")],
                "samplers": [
                    { "input": times, "output": moves },
                    { "input": times, "output": turns },
                    { "input": times, "output": cubic, "interpolation": "CUBICSPLINE" },
                ],
            },
            {
                "channels": [channel(0, "translation")],
                "samplers": [{ "input": times, "output": moves, "interpolation": "STEP" }],
            },
        ],
    }));
    let world = |animation, time| gltf.nodes(Some(&Pose { animation, time })).expect("are nodes")[0].world;
    let at_two = world(0, 2.0);
    assert!((at_two.translation - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-6);
    // Half of a quarter turn about y, the short way round though the quaternion is of the other sign
    let scale = at_two.matrix3.x_axis.length();
    let turned = at_two.matrix3.x_axis / scale;
    assert!((turned - DVec3::new(f64::from(half), 0.0, -f64::from(half))).length() < 1e-6, "{turned}");
    // Hermite in the middle: (v0 + v1) / 2 + span (m0 - m1) / 8
    let scales = [at_two.matrix3.x_axis, at_two.matrix3.y_axis, at_two.matrix3.z_axis].map(DVec3::length);
    for (scale, expected) in scales.into_iter().zip([2.0 + 0.5, 1.0, 1.0 - 1.0 + 1e-12]) {
        assert!((scale - expected).abs() < 1e-6, "{scales:?}");
    }
    assert_eq!(world(1, 2.9).translation, DVec3::ZERO);
    assert_eq!(world(1, 3.0).translation, DVec3::new(2.0, 4.0, 6.0));
    let rest = gltf.nodes(None).expect("are nodes")[0].world;
    assert_eq!(rest.translation, DVec3::splat(7.0));
}

#[test]
fn circles_and_second_parents_are_refused() {
    let nodes = |nodes: Value| {
        let gltf = open(&json!({ "asset": { "version": "2.0" }, "nodes": nodes })).expect("opens");
        gltf.nodes(None).map(|nodes| nodes.len()).map_err(|fault| format!("{}: {}", fault.pointer, fault.message))
    };
    assert_eq!(nodes(json!([{ "children": [1] }, {}])), Ok(2));
    assert_eq!(nodes(json!([{ "children": [0] }])), Err("/nodes/0: the node is below itself".into()));
    assert_eq!(
        nodes(json!([{ "children": [1] }, { "children": [2] }, { "children": [1] }])),
        Err("/nodes/2/children/0: node 1 is below two nodes".into())
    );
    assert_eq!(nodes(json!([{ "children": [3] }])), Err("/nodes/0/children/0: there is no node 3; there are 1".into()));
    // Deep trees take no stack
    let deep: Vec<Value> = (0..100_000).map(|i| json!({ "children": [i + 1] })).chain([json!({})]).collect();
    assert_eq!(nodes(Value::Array(deep)), Ok(100_001));
}

#[test]
fn versions_and_wrong_types_are_named() {
    let fault = |file: Value| {
        let fault = open(&file).map(|_| ()).expect_err("has a fault");
        format!("{}: {}; {}", fault.pointer, fault.message, fault.hint)
    };
    assert_eq!(
        fault(json!({ "asset": { "version": "1.0" } })),
        ": is glTF \"1.0\"; 2.0 is read; convert it to glTF 2.0"
    );
    let draft = json!({ "asset": { "version": "2.1", "minVersion": "2.1" } });
    assert_eq!(fault(draft), ": is glTF \"2.1\"; 2.0 is read; convert it to glTF 2.0");
    assert!(open(&json!({ "asset": { "version": "2.1" } })).is_ok());
    assert_eq!(
        fault(json!({ "asset": { "version": "2.0" }, "buffers": 3 })),
        "/buffers: 3 is not an array; the file is damaged or written wrongly: export it anew"
    );
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let mesh = json!({ "meshes": [{ "primitives": [{ "attributes": { "POSITION": position } }] }] });
    let with = |change: &dyn Fn(&mut Value)| {
        let mut file = buffer.text(mesh.clone());
        change(&mut file);
        let fault = open(&file).expect("opens").mesh(&MeshAddress::Mesh(0)).expect_err("has a fault");
        format!("{}: {}", fault.pointer, fault.message)
    };
    assert_eq!(
        with(&|file| file["accessors"][0]["count"] = 4.into()),
        "/accessors/0: 4 elements with a stride of 12 are not in 36 bytes"
    );
    assert_eq!(
        with(&|file| file["bufferViews"][0]["byteLength"] = 37.into()),
        "/bufferViews/0: 37 bytes from 0 on are not in its buffer, which has 36"
    );
    assert_eq!(
        with(&|file| file["accessors"][0]["bufferView"] = 5.into()),
        "/accessors/0/bufferView: there is no number 5 in \"bufferViews\", which has 1"
    );
    assert_eq!(
        with(&|file| file["accessors"][0]["componentType"] = 5124.into()),
        "/accessors/0/componentType: 5124 is none of 5120 to 5123, 5125 and 5126"
    );
    assert_eq!(
        with(&|file| file["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = "x".into()),
        "/meshes/0/primitives/0/attributes/POSITION: \"x\" is not a whole number from 0 on"
    );
    assert_eq!(with(&|file| file["buffers"][0]["uri"] = "a.bin".into()), "/buffers/0: \"a.bin\": no such file");
    assert_eq!(
        with(&|file| file["buffers"][0]["uri"] = "https://host/a.bin".into()),
        "/buffers/0: https: nothing is fetched from a network"
    );
}

/// What each node with a pose reads again is counted, however little the file says of it.
#[test]
fn what_is_read_for_each_pose_is_counted() {
    let crowd = |element: Value, count: usize| std::iter::repeat_n(element, count).collect::<Vec<_>>();
    let of = |skin: Value| {
        open(&json!({
            "asset": { "version": "2.0" },
            "nodes": crowd(json!({ "mesh": 0, "skin": 0 }), 1000),
            "meshes": [{ "primitives": crowd(json!({ "attributes": {} }), 1000) }],
            "skins": [skin],
        }))
        .expect("opens")
    };
    for file in [of(json!({ "joints": [] })), of(json!({ "joints": crowd(json!(0), 200_000) }))] {
        let all = (0..2000).map(|i| file.mesh(&MeshAddress::Node(i % 1000, None)));
        let fault = all.filter_map(Result::err).next().expect("is too much");
        assert!(fault.message.contains("MiB more are needed"), "{fault:?}");
    }
    // A strip has about as many triangles as indices
    let mut strip = json!({
        "asset": { "version": "2.0" },
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "mode": 5 }] }],
        "accessors": [{ "componentType": 5126, "type": "VEC3", "count": 3 },
            { "componentType": 5121, "type": "SCALAR", "count": 40_000_000 }],
    });
    let mesh = |file: &Value| open(file).expect("opens").mesh(&MeshAddress::Mesh(0)).map(|mesh| mesh.triangles.len());
    assert_eq!(mesh(&strip).map_err(|fault| fault.pointer), Err("/meshes/0/primitives/0".into()));
    strip["accessors"][1]["count"] = 40.into();
    assert_eq!(mesh(&strip), Ok(38));
}

#[test]
fn tangents_are_morphed_and_turned_with_the_bones() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let normal = buffer.floats("VEC3", 3, &[0.0, 0.0, 1.0].repeat(3));
    let tangent = buffer.floats("VEC4", 4, &[1.0, 0.0, 0.0, -1.0].repeat(3));
    let moved = buffer.floats("VEC3", 3, &[0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let joints = buffer.shorts("VEC4", 4, &[0; 12]);
    let weights = buffer.floats("VEC4", 4, &[1.0, 0.0, 0.0, 0.0].repeat(3));
    let mut attributes = json!({ "POSITION": position, "NORMAL": normal, "TANGENT": tangent });
    let of = |attributes: &Value| {
        let mut skinned = attributes.clone();
        (skinned["JOINTS_0"], skinned["WEIGHTS_0"]) = (joints.into(), weights.into());
        let gltf = buffer.file(json!({
            "meshes": [
                { "primitives": [{ "attributes": attributes, "targets": [{ "TANGENT": moved }] }], "weights": [0.5] },
                { "primitives": [{ "attributes": skinned }] },
            ],
            "skins": [{ "joints": [1] }],
            "nodes": [{ "mesh": 1, "skin": 0 }, { "scale": [-3, 1, 1] }],
        }));
        let mesh = |address| gltf.mesh(&address).unwrap_or_else(|fault| panic!("{fault:?}"));
        [mesh(MeshAddress::Mesh(0)), mesh(MeshAddress::Node(0, None))].map(|mesh| mesh.tangents)
    };
    let [morphed, mirrored] = of(&attributes);
    assert_eq!(morphed, [[1.0, 1.0, 0.0, -1.0], [1.0, 0.0, 0.0, -1.0], [1.0, 0.0, 0.0, -1.0]]);
    assert_eq!(mirrored, [[-1.0, 0.0, 0.0, 1.0]; 3]);
    // They go with normals
    attributes.as_object_mut().expect("is an object").remove("NORMAL");
    assert_eq!(of(&attributes), [[[0.0; 4]; 0], [[0.0; 4]; 0]]);
}

#[test]
fn the_order_of_corners_says_where_the_front_is() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let of = |buffer: &mut Buffer, normals: [[f32; 3]; 3]| {
        let normal = buffer.floats("VEC3", 3, normals.as_flattened());
        let tangent = buffer.floats("VEC4", 4, &[1.0, 0.0, 0.0, 1.0].repeat(3));
        let attributes = json!({ "POSITION": position, "NORMAL": normal, "TANGENT": tangent });
        mesh_of(&buffer.file(json!({ "meshes": [{ "primitives": [{ "attributes": attributes }] }] })))
    };
    // Inside out
    let mesh = of(&mut buffer, [[0.0, 0.0, -1.0]; 3]);
    assert_eq!((mesh.triangles[0], mesh.positions.len()), ([3, 4, 5], 6));
    close(&mesh.normals[3..], &[[0.0, 0.0, 1.0]; 3]);
    assert_eq!(mesh.tangents[3], [1.0, 0.0, 0.0, -1.0]);
    assert_eq!(mesh.notes.len(), 1);
    // A leaf that is lit like the crown
    let mesh = of(&mut buffer, [[0.0, 1.0, -0.01], [0.0, 1.0, 0.0], [0.0, 1.0, -0.01]]);
    assert_eq!(mesh.triangles[0], [3, 1, 4]);
    close(&mesh.normals, &[[0.0, 1.0, -0.01], [0.0, 1.0, 0.0], [0.0, 1.0, -0.01], [0.0, 1.0, 0.01], [0.0, 1.0, 0.01]]);
    // On the whole in front
    let mesh = of(&mut buffer, [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, -0.1]]);
    assert_eq!((mesh.triangles[0], mesh.positions.len(), mesh.notes.len()), ([0, 1, 2], 3, 0));
}

#[test]
fn bones_that_mirror_turn_the_corners() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let joints = buffer.shorts("VEC4", 4, &[0; 12]);
    let weights = buffer.floats("VEC4", 4, &[1.0, 0.0, 0.0, 0.0].repeat(3));
    let gltf = buffer.file(json!({
        "meshes": [{ "primitives": [{ "attributes": {
            "POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights,
        } }] }],
        "skins": [{ "joints": [1] }],
        "nodes": [{ "mesh": 0, "skin": 0 }, { "scale": [-1, 1, 1] }],
    }));
    let mesh = gltf.mesh(&MeshAddress::Node(0, None)).unwrap_or_else(|fault| panic!("{fault:?}"));
    assert_eq!((mesh.triangles[0], mesh.positions[1]), ([0, 2, 1], [-1.0, 0.0, 0.0]));
}

#[test]
fn sets_of_texture_coordinates_that_materials_name_are_there() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    let uv = buffer.floats("VEC2", 2, &[0.25, 0.75, 0.5, 0.5, 1.0, 0.0]);
    let of = |attributes: Value, material: Value| {
        mesh_of(&buffer.file(json!({
            "meshes": [{ "primitives": [{ "attributes": attributes, "material": 0 }] }],
            "materials": [material],
        })))
    };
    let named = json!({ "occlusionTexture": { "index": 0, "texCoord": 1 } });
    let mesh = of(json!({ "POSITION": position, "TEXCOORD_0": uv }), named.clone());
    assert_eq!((mesh.uvs[0][0], mesh.uvs[1].clone()), ([0.25, 0.25], vec![[0.0, 1.0]; 3]));
    assert_eq!(
        mesh.notes,
        ["/meshes/0/primitives/0: has no TEXCOORD_1, which its material names: all vertices get 0, 0"]
    );
    let mesh = of(json!({ "POSITION": position, "TEXCOORD_1": uv }), named);
    assert_eq!((mesh.uvs[0].clone(), mesh.uvs[1][0]), (vec![[0.0, 1.0]; 3], [0.25, 0.25]));
    let moved = json!({ "index": 0, "extensions": { "KHR_texture_transform": { "texCoord": 2 } } });
    let mesh = of(json!({ "POSITION": position }), json!({ "normalTexture": moved }));
    assert_eq!(mesh.uvs.len(), 3);
    let mesh = of(json!({ "POSITION": position }), json!({}));
    assert_eq!((mesh.uvs.len(), mesh.notes.len()), (0, 0));
}

#[test]
fn a_stride_of_0_is_none() {
    let mut buffer = Buffer::default();
    let position = buffer.floats("VEC3", 3, &CORNERS);
    buffer.views[0]["byteStride"] = 0.into();
    let mesh =
        mesh_of(&buffer.file(json!({ "meshes": [{ "primitives": [{ "attributes": { "POSITION": position } }] }] })));
    close(&mesh.positions, &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
}

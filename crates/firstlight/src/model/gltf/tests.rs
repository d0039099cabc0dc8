//! Small files made by hand, one feature each, and what they are described as.

mod materials;

use serde_json::{Value, json};

use super::{ShownModel, describe};
use crate::camera::{CameraDesc, Projection};
use crate::context::{AssetError, NoAssets};
use crate::import::{Gltf, GltfFault};
use crate::light::LightDesc;
use crate::math::{DAffine3, DVec3};
use crate::model::ModelParts;
use crate::shape::ShapeDesc;

fn with_asset(mut file: Value) -> Value {
    file["asset"] = json!({ "version": "2.0" });
    file
}

/// The file `m/a.gltf`, whose buffers all hold `bytes`.
fn open(file: Value, bytes: &[u8]) -> Gltf {
    let read = |path: &str, _| if path == "m/a.bin" { Ok(bytes.to_vec()) } else { Err(AssetError::NotFound) };
    let opened = Gltf::open("m/a.gltf", with_asset(file).to_string().as_bytes(), &read);
    opened.unwrap_or_else(|fault| panic!("{fault:?}"))
}

const PLAIN: ShownModel<'static> = ShownModel {
    file: "m/a.gltf",
    variant: None,
    scene: None,
    animation: None,
    time: None,
    chosen: &|_| None,
    unlit: false,
    assets: &NoAssets,
};

fn parts_of(file: Value) -> ModelParts {
    describe(&open(file, &[]), &PLAIN).unwrap_or_else(|fault| panic!("{fault:?}"))
}

fn fault_of(file: Value, shown: &ShownModel<'_>) -> String {
    let GltfFault { pointer, message, hint } = describe(&open(file, &[]), shown).expect_err("has a fault");
    format!("{pointer}: {message}; {hint}")
}

fn warnings(parts: &ModelParts) -> Vec<String> {
    parts.warnings.iter().map(|warning| format!("{}; {}", warning.message, warning.hint)).collect()
}

/// What a file with one node with this extension, turned and moved, brings.
fn lights(light: Value) -> ModelParts {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    parts_of(json!({
        "extensions": { "KHR_lights_punctual": { "lights": [light] } },
        "nodes": [{
            "name": "lamp",
            "translation": [0, 3, 4],
            // A quarter turn about x: -z becomes -y... the quaternion says it of +90 degrees
            "rotation": [half, 0, 0, half],
            "extensions": { "KHR_lights_punctual": { "light": 0 } },
        }],
    }))
}

fn near(a: [f64; 3], b: [f64; 3]) {
    assert!((DVec3::from(a) - DVec3::from(b)).length() < 1e-9, "{a:?}, not {b:?}");
}

#[test]
fn lights_shine_along_minus_z_of_their_nodes() {
    // Turned by 90 degrees about x, -z is +y
    let up = [0.0, 1.0, 0.0];
    let parts = lights(json!({ "type": "directional", "color": [1, 0.5, 0], "intensity": 3 }));
    let [LightDesc::Directional(sun)] = &parts.lights[..] else { panic!("{:?}", parts.lights) };
    near(sun.direction, up);
    assert_eq!((sun.name.as_deref(), sun.strength, sun.color.linear), (Some("lamp"), 3.0, [1.0, 0.5, 0.0]));

    let parts = lights(json!({ "type": "point", "range": 5 }));
    let [LightDesc::Point(point)] = &parts.lights[..] else { panic!("{:?}", parts.lights) };
    assert_eq!((point.position, point.strength), ([0.0, 3.0, 4.0], 1.0));

    // Half angles in radians become full angles in degrees
    let cone = json!({ "innerConeAngle": 0.25, "outerConeAngle": 0.5 });
    let parts = lights(json!({ "type": "spot", "spot": cone }));
    let [LightDesc::Spot(spot)] = &parts.lights[..] else { panic!("{:?}", parts.lights) };
    let [inner, outer] = [0.5f64, 1.0].map(f64::to_degrees);
    assert_eq!((spot.cone_deg, spot.inner_cone_deg), (outer, Some(inner)));
    near(spot.look_at, [0.0, 8.0, 4.0]);
    let parts = lights(json!({ "type": "spot", "spot": {} }));
    let [LightDesc::Spot(spot)] = &parts.lights[..] else { panic!("{:?}", parts.lights) };
    assert!((spot.cone_deg - 90.0).abs() < 1e-9 && spot.inner_cone_deg == Some(0.0));

    let parts = lights(json!({ "type": "ies" }));
    assert_eq!(warnings(&parts), ["a light of the kind \"ies\" is left out; point, spot and directional are read"]);
}

#[test]
fn cameras() {
    let camera = |camera: Value| -> Vec<(String, CameraDesc)> {
        parts_of(json!({
            "cameras": [camera],
            "nodes": [{ "camera": 0, "translation": [0, 0, 5] }, { "camera": 0, "name": "node 0" }],
        }))
        .cameras
    };
    let all = camera(json!({ "type": "perspective", "perspective": { "yfov": std::f64::consts::FRAC_PI_3 } }));
    assert_eq!(all.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["node 0", "node 0 2"]);
    let desc = &all[0].1;
    assert!((desc.fov_y_deg.expect("is said") - 60.0).abs() < 1e-9);
    assert_eq!((desc.position, desc.look_at, desc.up), ([0.0, 0.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0]));
    let named = camera(json!({ "name": "front", "type": "perspective", "perspective": { "yfov": 1 } }));
    assert_eq!(named.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["front", "node 0"]);
    let all = camera(json!({ "type": "orthographic", "orthographic": { "xmag": 3, "ymag": 2 } }));
    assert_eq!((all[0].1.projection, all[0].1.height), (Projection::Orthographic, Some(4.0)));
}

#[test]
fn instances_and_shared_meshes_are_placed_groups() {
    let bytes: Vec<u8> = [1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let file = json!({
        "buffers": [{ "uri": "a.bin", "byteLength": bytes.len() }],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 2 }],
        "meshes": [
            { "name": "leaf", "primitives": [{ "attributes": { "POSITION": 0 } }] },
            { "primitives": [{ "attributes": { "POSITION": 0 } }] },
        ],
        "nodes": [
            {
                "mesh": 0, "scale": [2, 2, 2],
                "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0 } } },
            },
            { "mesh": 1, "name": "post" },
            { "mesh": 0, "name": "fallen" },
            { "mesh": 1, "name": "flat", "scale": [1, 0, 1] },
        ],
    });
    let parts = describe(&open(file, &bytes), &PLAIN).unwrap_or_else(|fault| panic!("{fault:?}"));
    let placed: Vec<(&str, DVec3)> = parts
        .shapes
        .iter()
        .map(|part| match &part.shape {
            ShapeDesc::Instance(instance) => {
                (instance.name.as_deref().unwrap_or_default(), part.model_from_shape.translation)
            }
            other => panic!("{other:?}"),
        })
        .collect();
    let expected = [
        ("leaf", DVec3::new(2.0, 4.0, 6.0)),
        ("leaf", DVec3::new(8.0, 10.0, 12.0)),
        ("post", DVec3::ZERO),
        ("fallen", DVec3::ZERO),
    ];
    assert_eq!(placed, expected);
    let groups: Vec<&str> = parts.groups.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(groups, ["m/a.gltf#mesh/0", "m/a.gltf#mesh/1"]);
    assert_eq!(
        warnings(&parts),
        ["1 of \"flat\" are left out: a scale of 0, or numbers that are none; nothing of them could be seen"]
    );
}

#[test]
fn posed_meshes_have_addresses_of_their_own() {
    let file = json!({
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "nodes": [
            { "mesh": 0, "weights": [0.5], "translation": [1, 0, 0] },
            { "mesh": 0, "skin": 0, "translation": [1, 0, 0] },
            { "translation": [0, 7, 0] },
        ],
        "skins": [{ "joints": [2] }],
        "animations": [{ "name": "walk", "channels": [], "samplers": [] }],
    });
    let shapes = |animation, time| -> Vec<(String, DAffine3)> {
        let parts = describe(&open(file.clone(), &[]), &ShownModel { animation, time, ..PLAIN });
        let parts = parts.unwrap_or_else(|fault| panic!("{fault:?}"));
        let address = |shape| match shape {
            ShapeDesc::Mesh(mesh) => mesh.file.map(|file| file.0).unwrap_or_default(),
            other => panic!("{other:?}"),
        };
        parts.shapes.into_iter().map(|part| (address(part.shape), part.model_from_shape)).collect()
    };
    let moved = DAffine3::from_translation(DVec3::X);
    let at_rest = [("m/a.gltf#node/0", moved), ("m/a.gltf#node/1", DAffine3::IDENTITY)];
    assert_eq!(shapes(None, None), at_rest.map(|(name, place)| (name.to_owned(), place)));
    let walking = |shapes: Vec<(String, DAffine3)>| shapes[0].0.clone();
    assert_eq!(walking(shapes(Some("walk"), Some(1.5))), "m/a.gltf#node/0/animation/0/time/1.5");
    assert_eq!(walking(shapes(Some("0"), Some(1.5))), "m/a.gltf#node/0/animation/0/time/1.5");
    assert_eq!(walking(shapes(None, Some(2.0))), "m/a.gltf#node/0/animation/0/time/2");
    assert_eq!(
        fault_of(file, &ShownModel { animation: Some("run"), ..PLAIN }),
        ": there is no animation \"run\"; the file has \"walk\""
    );
}

#[test]
fn points_and_lines_are_left_out_once() {
    let line = json!({ "attributes": { "POSITION": 0 }, "mode": 1 });
    let parts = parts_of(json!({
        "meshes": [{ "primitives": [line] }, { "primitives": [line, { "attributes": { "POSITION": 0 } }] }],
        "nodes": [{ "mesh": 0 }, { "mesh": 0 }, { "mesh": 1 }],
    }));
    assert_eq!(
        warnings(&parts),
        ["/meshes/0: it holds no triangles, and is left out; points and lines of glTF files are not shown"]
    );
    assert_eq!(parts.shapes.len(), 1);
}

#[test]
fn scenes_are_chosen_by_their_numbers() {
    let file = json!({
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "nodes": [{ "mesh": 0, "name": "a" }, { "mesh": 0, "name": "b" }],
        "scene": 1,
        "scenes": [{ "nodes": [0] }, { "nodes": [1] }],
    });
    let named = |scene| {
        let parts = describe(&open(file.clone(), &[]), &ShownModel { scene, ..PLAIN }).expect("is read");
        let ShapeDesc::Mesh(mesh) = &parts.shapes[0].shape else { panic!() };
        mesh.name.clone().unwrap_or_default()
    };
    assert_eq!([named(None), named(Some(0)), named(Some(1))], ["b", "a", "b"]);
    let asked = ShownModel { scene: Some(2), ..PLAIN };
    assert_eq!(fault_of(file, &asked), ": there is no scene 2; the file has 2, counted from 0");
    assert_eq!(fault_of(json!({ "nodes": [] }), &asked), ": there is no scene 2; the file has 0, counted from 0");
}

#[test]
fn extensions_that_are_not_read() {
    let parts = parts_of(json!({ "extensionsUsed": ["KHR_materials_sheen", "KHR_lights_punctual"] }));
    assert_eq!(
        warnings(&parts),
        ["uses the extension KHR_materials_sheen, which is not read; what it adds is not shown"]
    );
    let needs = |name: &str| fault_of(json!({ "extensionsUsed": [name], "extensionsRequired": [name] }), &PLAIN);
    assert_eq!(
        needs("KHR_draco_mesh_compression"),
        ": needs the extension KHR_draco_mesh_compression, which is not read; unpack it: `npx @gltf-transform/cli copy \
         in.glb out.glb`"
    );
    assert_eq!(
        needs("VENDOR_x"),
        ": needs the extension VENDOR_x, which is not read; export it without that extension"
    );
}

/// The same element many times.
fn crowd(element: Value, count: usize) -> Vec<Value> {
    std::iter::repeat_n(element, count).collect()
}

/// Nothing of a file is searched for each of its parts: with that, these would take hours.
#[test]
fn crowds_with_one_name_are_described_soon() {
    const COUNT: usize = 20_000;
    let start = std::time::Instant::now();
    let parts = parts_of(json!({
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1 } }],
        "nodes": crowd(json!({ "name": "a", "camera": 0 }), COUNT),
    }));
    assert_eq!(parts.cameras.len(), COUNT);
    assert_eq!(parts.cameras[COUNT - 1].0, format!("a {COUNT}"));
    let material = |i: usize| {
        let transform = json!({ "KHR_texture_transform": { "offset": [i, 0] } });
        json!({ "name": "a", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": transform } } })
    };
    let primitive = |i: usize| json!({ "attributes": { "POSITION": 0 }, "material": i });
    let parts = parts_of(json!({
        "materials": (0..COUNT).map(material).collect::<Vec<_>>(),
        "textures": [{ "source": 0, "name": "t" }],
        "images": [{ "uri": "t.png" }],
        "meshes": [{ "primitives": (0..COUNT).map(primitive).collect::<Vec<_>>() }],
        "nodes": [{ "mesh": 0 }],
    }));
    assert_eq!((parts.materials.len(), parts.textures.len()), (COUNT, COUNT));
    assert_eq!(parts.materials[COUNT - 1].0, format!("m/a.gltf/a {COUNT}"));
    assert_eq!(parts.textures[COUNT - 1].0, format!("m/a.gltf/t {COUNT}"));
    assert!(start.elapsed() < std::time::Duration::from_secs(20), "{:?}", start.elapsed());
}

/// A short file that claims a crowd is refused before the crowd is made.
#[test]
fn crowds_that_a_file_only_claims_are_refused() {
    let primitive = json!({ "attributes": { "POSITION": 0 } });
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0 } } });
    let of = |mesh: Vec<Value>, nodes: Vec<Value>| {
        let accessors = json!([{ "componentType": 5126, "type": "VEC3", "count": 4_000_000 }]);
        json!({ "meshes": [{ "primitives": mesh }], "nodes": nodes, "accessors": accessors })
    };
    let instances = of(crowd(primitive.clone(), 1), vec![json!({ "mesh": 0, "extensions": instancing })]);
    let places = of(crowd(primitive, 10_000), crowd(json!({ "mesh": 0, "weights": [1] }), 10_000));
    for (file, at) in [(instances, "/nodes/0: "), (places, "/nodes/")] {
        let fault = fault_of(file, &PLAIN);
        assert!(fault.starts_with(at) && fault.contains("the file claims more than it holds"), "{fault}");
    }
}

//! Small whole models of all formats that are read, with a little of everything that files of them may say.

use serde_json::{Value, json};

use super::ModelFiles;
use super::json::container;

/// Pictures: of colours, with alpha, and gray.
const COLORS: &[u8] = include_bytes!("../../../../fuzz/corpus/picture/420.jpg");
const ALPHA: &[u8] = include_bytes!("../../../../fuzz/corpus/picture/basn4a08.png");
const PALETTE: &[u8] = include_bytes!("../../../../fuzz/corpus/picture/basn3p04.png");

/// The models.
pub fn models() -> Vec<ModelFiles> {
    vec![rich_gltf(), rich_glb(), posed_gltf(), obj(), rough_obj(), ply(), binary_ply(), stl(), binary_stl()]
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

    fn accessor(&mut self, (component, kind): (u32, &str), count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let normalized = component == 5121 && kind == "VEC4";
        let mut accessor = json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        if normalized {
            accessor["normalized"] = true.into();
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        self.accessor((5126, kind), rows.len(), &bytes)
    }

    fn shorts(&mut self, numbers: &[u16]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor((5123, "SCALAR"), numbers.len(), &bytes)
    }

    fn bytes<const N: usize>(&mut self, rows: &[[u8; N]]) -> usize {
        self.accessor((5121, if N == 4 { "VEC4" } else { "SCALAR" }), rows.len(), rows.as_flattened())
    }
}

/// A square of 3 x 3 corners, its normals and texture coordinates.
fn square() -> (Vec<[f32; 3]>, Vec<[f32; 2]>, Vec<u16>) {
    let corners = (0..9).map(|i| [(i % 3) as f32 - 1.0, (i / 3) as f32 - 1.0, 0.1 * (i % 2) as f32]).collect();
    let uvs = (0..9).map(|i| [(i % 3) as f32 / 2.0, (i / 3) as f32 / 2.0]).collect();
    let faces = [0u16, 1, 3, 4].iter().flat_map(|i| [*i, i + 1, i + 4, *i, i + 4, i + 3]).collect();
    (corners, uvs, faces)
}

/// Meshes, materials of all kinds, lights, cameras, instances and variants, in a file with a buffer and pictures.
fn rich(buffer: &mut Buffer) -> Value {
    let (corners, uvs, faces) = square();
    let positions = buffer.floats(&corners);
    let normals = buffer.floats(&[[0.0, 0.0, 1.0]; 9]);
    let (first, second) = (buffer.floats(&uvs), buffer.floats(&uvs));
    let colors = buffer.bytes(&std::array::from_fn::<[u8; 4], 9, _>(|i| [255, 28 * i as u8, 90, 255]));
    let faces = buffer.shorts(&faces);
    // Of a fan with two corners moved
    let replaced = (buffer.view(&[0, 0, 2, 0]), buffer.view(&[0; 24]));
    let fan = buffer.floats(&[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]);
    buffer.accessors[fan]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": replaced.0, "componentType": 5123 },
        "values": { "bufferView": replaced.1 },
    });
    let moved = buffer.floats(&[[2.0, 0.0, 0.0], [0.0, 2.0, -1.0], [-2.0, 0.0, 0.0]]);
    let turned = buffer.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5]]);
    let all = json!({ "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": first, "TEXCOORD_1": second,
        "COLOR_0": colors });
    let transform = json!({ "offset": [0.1, 0.2], "rotation": 0.5, "scale": [2, 3], "texCoord": 1 });
    json!({
        "asset": { "version": "2.0", "generator": "by hand" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_variants", "KHR_texture_transform"],
        "scene": 0,
        "scenes": [{ "nodes": [0, 4] }, { "nodes": [2] }],
        "nodes": [
            { "name": "root", "children": [1, 2, 3], "scale": [1, 1.5, 1] },
            { "name": "square", "mesh": 0, "translation": [0.5, 0, 0], "rotation": [0, 0.38, 0, 0.92] },
            { "name": "fan", "mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.5, 0.2, 1] },
            { "mesh": 1, "extensions": { "EXT_mesh_gpu_instancing": {
                "attributes": { "TRANSLATION": moved, "ROTATION": turned, "SCALE": moved } } } },
            { "children": [5, 6], "translation": [0, 2, 3] },
            { "name": "lamp", "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "name": "eye", "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 1 } } },
        ],
        "meshes": [
            { "name": "square", "primitives": [
                { "attributes": all, "indices": faces, "material": 0, "extensions": { "KHR_materials_variants": {
                    "mappings": [{ "variants": [0, 1], "material": 1 }] } } },
                { "attributes": { "POSITION": positions, "TEXCOORD_0": first }, "indices": faces, "material": 2 },
                { "attributes": { "POSITION": positions, "COLOR_0": colors }, "mode": 5, "material": 3 },
            ] },
            { "primitives": [{ "attributes": { "POSITION": fan }, "mode": 6 },
                { "attributes": { "POSITION": fan }, "mode": 1 }] },
        ],
        "materials": [
            { "name": "oak", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.3,
                "pbrMetallicRoughness": { "baseColorFactor": [1, 0.9, 0.8, 0.7], "metallicFactor": 0.2,
                    "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": transform } },
                    "metallicRoughnessTexture": { "index": 1, "texCoord": 1 } },
                "normalTexture": { "index": 1, "scale": 0.5 }, "occlusionTexture": { "index": 2, "strength": 0.5 },
                "emissiveTexture": { "index": 0 }, "emissiveFactor": [0.1, 0.1, 0] ,
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 2 },
                    "KHR_materials_clearcoat": { "clearcoatFactor": 0.5, "clearcoatTexture": { "index": 2 },
                        "clearcoatRoughnessFactor": 0.1, "clearcoatNormalTexture": { "index": 1, "scale": 2 } } } },
            { "name": "glass", "alphaMode": "BLEND", "extensions": { "KHR_materials_ior": { "ior": 1.3 },
                "KHR_materials_transmission": { "transmissionFactor": 0.9, "transmissionTexture": { "index": 2 } },
                "KHR_materials_specular": { "specularFactor": 0.5, "specularTexture": { "index": 0 },
                    "specularColorFactor": [1, 0.5, 2], "specularColorTexture": { "index": 0 } } } },
            { "name": "old", "extensions": { "KHR_materials_pbrSpecularGlossiness": {
                "diffuseFactor": [0.5, 0.4, 0.3, 1], "diffuseTexture": { "index": 0 }, "glossinessFactor": 0.7,
                "specularFactor": [0.2, 0.2, 0.2], "specularGlossinessTexture": { "index": 1 } } } },
            { "extensions": { "KHR_materials_unlit": {} },
                "pbrMetallicRoughness": { "baseColorTexture": { "index": 2 } } },
        ],
        "textures": [{ "source": 0, "sampler": 0 }, { "source": 1, "name": "bumps" },
            { "source": 2, "extensions": { "EXT_texture_webp": { "source": 2 } } }],
        "samplers": [{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } },
            { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 2 } }],
        "extensions": {
            "KHR_lights_punctual": { "lights": [
                { "type": "spot", "intensity": 40, "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.6 } },
                { "type": "directional", "color": [1, 0.9, 0.8], "intensity": 2 }, { "type": "point" }] },
            "KHR_materials_variants": { "variants": [{ "name": "light" }, { "name": "dark" }] },
        },
    })
}

/// With its buffer and its pictures beside it.
fn rich_gltf() -> ModelFiles {
    let mut buffer = Buffer::default();
    let mut file = rich(&mut buffer);
    file["buffers"] = json!([{ "uri": "rich.bin", "byteLength": buffer.bytes.len() }]);
    file["bufferViews"] = buffer.views.into();
    file["accessors"] = buffer.accessors.into();
    file["images"] = json!([{ "uri": "wood.png" }, { "uri": "maps/bumps.png" }, { "uri": "maps/spots%20of%20it.jpg" }]);
    let files = [
        ("rich.gltf", file.to_string().into_bytes()),
        ("rich.bin", buffer.bytes),
        ("wood.png", ALPHA.to_vec()),
        ("maps/bumps.png", PALETTE.to_vec()),
        ("maps/spots of it.jpg", COLORS.to_vec()),
    ];
    ModelFiles::new("rich.gltf", files.map(|(name, bytes)| (name.to_owned(), bytes)))
}

/// All in one file.
fn rich_glb() -> ModelFiles {
    let mut buffer = Buffer::default();
    let mut file = rich(&mut buffer);
    let pictures = [ALPHA, PALETTE, COLORS].map(|picture| buffer.view(picture));
    let pictures = pictures.map(|view| json!({ "bufferView": view, "mimeType": "image/png" }));
    buffer.bytes.resize(buffer.bytes.len().next_multiple_of(4), 0);
    file["buffers"] = json!([{ "byteLength": buffer.bytes.len() }]);
    file["bufferViews"] = buffer.views.into();
    file["accessors"] = buffer.accessors.into();
    file["images"] = json!(pictures);
    let mut binary = (buffer.bytes.len() as u32).to_le_bytes().to_vec();
    binary.extend(b"BIN\0");
    binary.extend(buffer.bytes);
    ModelFiles::new("rich.glb", [("rich.glb".to_owned(), container(file.to_string().into_bytes(), &binary))])
}

/// A skin, morph targets and animations of all kinds.
fn posed_gltf() -> ModelFiles {
    let mut buffer = Buffer::default();
    let (corners, _, faces) = square();
    let positions = buffer.floats(&corners);
    let normals = buffer.floats(&[[0.0, 0.0, 1.0]; 9]);
    let faces = buffer.shorts(&faces);
    let bent = buffer.floats(&corners.iter().map(|[x, _, _]| [0.0, 0.0, x * x]).collect::<Vec<_>>());
    let joints = buffer.bytes(&std::array::from_fn::<[u8; 4], 9, _>(|i| [u8::from(i > 4), 0, 0, 0]));
    let weights = buffer.floats(&[[0.7, 0.3, 0.0, 0.0]; 9]);
    // Byte weights are normalized as they are written here
    let bind = |x: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0];
    let binds = buffer.floats(&[bind(0.0), bind(-1.0)]);
    let times = buffer.floats(&[[0.0], [0.5], [1.0]]);
    let moves = buffer.floats(&[[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    let turns = buffer.floats(&[[0.0, 0.1, 0.0, 1.0]; 9]);
    let bends = buffer.floats(&[[0.0], [1.0], [0.5]]);
    let file = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0, 1, 3] }],
        "nodes": [{ "name": "body", "mesh": 0, "skin": 0 }, { "name": "hip", "children": [2] },
            { "name": "knee", "translation": [1, 0, 0] }, { "name": "flag", "mesh": 1, "weights": [0.5] }],
        "meshes": [
            { "primitives": [{ "attributes": { "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints,
                "WEIGHTS_0": weights }, "indices": faces }] },
            { "weights": [0.2], "primitives": [{ "attributes": { "POSITION": positions, "NORMAL": normals },
                "indices": faces, "targets": [{ "POSITION": bent, "NORMAL": bent }] }] },
        ],
        "skins": [{ "inverseBindMatrices": binds, "joints": [1, 2], "skeleton": 1 }],
        "animations": [{ "name": "walk", "samplers": [{ "input": times, "output": moves },
            { "input": times, "output": turns, "interpolation": "CUBICSPLINE" },
            { "input": times, "output": bends, "interpolation": "STEP" }, { "input": times, "output": turns }],
            "channels": [{ "sampler": 0, "target": { "node": 2, "path": "translation" } },
                { "sampler": 1, "target": { "node": 2, "path": "rotation" } },
                { "sampler": 3, "target": { "node": 1, "path": "rotation" } },
                { "sampler": 0, "target": { "node": 0, "path": "scale" } },
                { "sampler": 2, "target": { "node": 3, "path": "weights" } }] }],
        "buffers": [{ "uri": "posed.bin", "byteLength": buffer.bytes.len() }],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    });
    let files = [("posed.gltf".to_owned(), file.to_string().into_bytes()), ("posed.bin".to_owned(), buffer.bytes)];
    ModelFiles::new("posed.gltf", files)
}

/// A box whose sides have materials, with `extra` of a file of materials.
fn obj_of(name: &str, materials: &str) -> ModelFiles {
    let mut text = format!("# a box\nmtllib {name}.mtl\no box\n");
    for i in 0..8 {
        text += &format!("v {} {} {}\n", i & 1, i >> 1 & 1, i >> 2);
    }
    text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 1 0 0\ng sides\ns 1\nusemtl red\n";
    text += "f 1/1/1 3/2/1 4/3/1 2/4/1\nf 5/1/1 6/2/1 8/3/1 7/4/1\nusemtl blue\ns off\ng top\nf 1/1 2/2 6/3 5/4\n";
    text += "f 3 7 8 4\nusemtl none\nf -8//2 -4//2 -2//2 -6//2\nf 2 4 8 6\nl 1 2\n";
    let files = [
        (format!("{name}.obj"), text.into_bytes()),
        (format!("{name}.mtl"), materials.as_bytes().to_vec()),
        ("wood.png".to_owned(), ALPHA.to_vec()),
        ("maps/bumps.png".to_owned(), PALETTE.to_vec()),
    ];
    ModelFiles::new(&format!("{name}.obj"), files)
}

fn obj() -> ModelFiles {
    let materials = "newmtl red\nKa 0.2 0.2 0.2\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 50\nNi 1.5\nd 0.9\nillum 2\n\
                     map_Kd -s 2 2 1 -o 0.5 0 -clamp on wood.png\nmap_d -imfchan m wood.png\nmap_Ns maps/bumps.png\n\
                     bump -bm 0.5 maps\\bumps.png\n\nnewmtl blue\nKd 0 0 1\nKe 0.1 0 0\nTr 0.3\nillum 0\n\
                     map_Ke -mm 0.1 0.9 wood.png\nTf 1 1 1\nmap_Ka -blendu off -blendv off wood.png\n";
    obj_of("box", materials)
}

fn rough_obj() -> ModelFiles {
    let materials = "newmtl red\nKd 1 1 1\nPr 0.3\nPm 0.8\nPc 0.5\nPcr 0.1\nmap_Pr -imfchan r wood.png\n\
                     map_Pm maps/bumps.png\nnorm -bm 2 maps/bumps.png\nmap_Kd -colorspace linear wood.png\n\
                     newmtl blue\r\nKd 0.1 0.2 0.9\r\nPr 1\r\nKd 0.2 \\\r\n0.2 0.2\r\n";
    obj_of("rough", materials)
}

/// Faces with colours of their vertices.
fn ply() -> ModelFiles {
    let mut text = String::from(
        "ply\nformat ascii 1.0\ncomment coloured\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n",
    );
    text += "0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n1 1 0 0 0 255 255\n0 1 0.5 255 255 255 128\n3 0 1 2\n3 0 2 3\n";
    ModelFiles::new("colours.ply", [("colours.ply".to_owned(), text.into_bytes())])
}

fn binary_ply() -> ModelFiles {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar uint vertex_indices\n\
        end_header\n"
        .to_vec();
    for corner in [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        let numbers = corner.into_iter().chain([0.0, 0.0, 1.0]);
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([200, 100, 50]);
    }
    bytes.push(3);
    bytes.extend([0u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    ModelFiles::new("binary.ply", [("binary.ply".to_owned(), bytes)])
}

fn stl() -> ModelFiles {
    let facet = |a: &str, b: &str, c: &str| {
        format!("facet normal 0 0 1\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
    };
    let text =
        format!("solid a\n{}{}endsolid a\n", facet("0 0 0", "1 0 0", "0 1 0"), facet("1 0 0", "1 1 0.5", "0 1 0"));
    ModelFiles::new("text.stl", [("text.stl".to_owned(), text.into_bytes())])
}

/// With colours, as one of the programs that write them has them.
fn binary_stl() -> ModelFiles {
    let mut bytes = vec![0; 80];
    bytes[..15].copy_from_slice(b"COLOR=\xff\x80\x40\xff end ");
    bytes.extend(2u32.to_le_bytes());
    for (i, z) in [0.0f32, 1.0].into_iter().enumerate() {
        let numbers = [0.0, 0.0, 1.0, 0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z];
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend((0x801fu16 << i).to_le_bytes());
    }
    ModelFiles::new("binary.stl", [("binary.stl".to_owned(), bytes)])
}

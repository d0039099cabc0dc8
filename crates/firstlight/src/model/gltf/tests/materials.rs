//! Materials and textures of small files.

use serde_json::{Value, json};

use super::super::{ShownModel, describe};
use super::{PLAIN, fault_of, open, parts_of, warnings};
use crate::context::MemoryAssets;
use crate::describe::{Channel, ColorDesc, ColorParam, NumberParam};
use crate::material::{AlphaMode, MaterialDesc, MetallicRoughnessDesc};
use crate::model::clay;
use crate::shape::ShapeDesc;
use crate::texture::{Filter, ImageTextureDesc, TextureDesc, Wrap};

/// A file with one mesh of one primitive with this material, and four pictures that textures 0 to 3 show.
fn file_with(material: Value) -> Value {
    json!({
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
        "materials": [material],
        "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }, { "source": 3 }],
        "images": [{ "uri": "t0.png" }, { "uri": "t1.png" }, { "uri": "t2.png" }, { "uri": "t3.jpg" }],
    })
}

/// The material of such a file, which has no more than one.
fn material(material: Value) -> MaterialDesc {
    let mut parts = parts_of(file_with(material));
    assert_eq!((parts.materials.len(), parts.warnings.len()), (1, 0), "{:?}", parts.warnings);
    parts.materials.remove(0).1
}

fn metallic(of: Value) -> MetallicRoughnessDesc {
    match material(of) {
        MaterialDesc::MetallicRoughness(desc) => desc,
        other => panic!("{other:?}"),
    }
}

/// The name of texture `number` of such a file.
fn texture(number: usize) -> String {
    format!("m/a.gltf/texture {number}")
}

fn colored(number: usize, factor: [f64; 3]) -> ColorParam {
    ColorParam { factor: ColorDesc::from(factor), ..ColorParam::texture(texture(number)) }
}

fn channel(number: usize, channel: Channel, factor: f64, bias: f64) -> NumberParam {
    NumberParam { factor, bias, ..NumberParam::channel(texture(number), channel) }
}

#[test]
fn a_material_with_everything() {
    let desc = metallic(json!({
        "name": "paint",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.2, 0.4, 0.6, 0.5],
            "baseColorTexture": { "index": 0 },
            "metallicFactor": 0.25,
            "roughnessFactor": 0.75,
            "metallicRoughnessTexture": { "index": 1 },
        },
        "normalTexture": { "index": 2, "scale": 0.5 },
        "occlusionTexture": { "index": 1, "strength": 0.25 },
        "emissiveTexture": { "index": 3 },
        "emissiveFactor": [1, 0.5, 0],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } },
    }));
    assert_eq!(desc.base_color, colored(0, [0.2, 0.4, 0.6]));
    assert_eq!(desc.metallic, channel(1, Channel::B, 0.25, 0.0));
    assert_eq!(desc.roughness, channel(1, Channel::G, 0.75, 0.0));
    // 1 + strength (texture - 1)
    assert_eq!(desc.occlusion, channel(1, Channel::R, 0.25, 0.75));
    assert_eq!((desc.common.normal_map, desc.common.normal_scale), (Some(texture(2)), 0.5));
    assert_eq!((desc.common.emissive, desc.common.emissive_strength), (colored(3, [1.0, 0.5, 0.0]), 8.0));
    // Alpha does not count where the mode is OPAQUE
    assert_eq!((desc.common.alpha_mode, desc.common.alpha), (AlphaMode::Opaque, NumberParam::constant(1.0)));
    assert!(desc.common.single_sided);
}

#[test]
fn a_material_that_says_nothing() {
    let desc = metallic(json!({}));
    assert_eq!(desc.base_color, ColorParam::gray(1.0));
    assert_eq!([&desc.metallic, &desc.roughness], [&NumberParam::constant(1.0); 2]);
    assert_eq!(desc.ior, 1.5);
    // An emissive texture alone is black: its factor is 0
    let dark = metallic(json!({ "emissiveTexture": { "index": 3 }, "doubleSided": true }));
    assert_eq!(dark.common.emissive, ColorParam::gray(0.0));
    assert!(!dark.common.single_sided);
}

#[test]
fn alpha_is_that_of_pictures_that_have_one() {
    let alpha = |mode: &str, picture: usize| {
        let common = metallic(json!({
            "alphaMode": mode,
            "alphaCutoff": 0.3,
            "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": { "index": picture } },
        }));
        (common.common.alpha_mode, common.common.alpha, common.common.cutoff)
    };
    assert_eq!(alpha("MASK", 0), (AlphaMode::Mask, channel(0, Channel::A, 0.5, 0.0), 0.3));
    assert_eq!(alpha("BLEND", 0), (AlphaMode::Blend, channel(0, Channel::A, 0.5, 0.0), 0.3));
    // JPEG has none
    assert_eq!(alpha("BLEND", 3), (AlphaMode::Blend, NumberParam::constant(0.5), 0.3));
    assert_eq!(
        fault_of(file_with(json!({ "alphaMode": "ADD" })), &PLAIN),
        "/materials/0: \"ADD\" is none of OPAQUE, MASK and BLEND; the file is damaged or written wrongly: export it \
         anew"
    );
}

#[test]
fn pictures_are_looked_at_for_alpha() {
    let png = |kind: png::ColorType, texel: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(kind);
        encoder.write_header().and_then(|mut writer| writer.write_image_data(texel)).expect("is written");
        bytes
    };
    for (bytes, has_alpha) in
        [(png(png::ColorType::Rgb, &[1, 2, 3]), false), (png(png::ColorType::Rgba, &[1; 4]), true)]
    {
        let mut file = file_with(json!({
            "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
        }));
        file["images"] = json!([{ "bufferView": 0, "mimeType": "image/png", "name": "wood" }]);
        file["textures"] = json!([{ "source": 0 }]);
        file["buffers"] = json!([{ "uri": "a.bin", "byteLength": bytes.len() }]);
        file["bufferViews"] = json!([{ "buffer": 0, "byteLength": bytes.len() }]);
        let parts = describe(&open(file, &bytes), &PLAIN).unwrap_or_else(|fault| panic!("{fault:?}"));
        let [(name, TextureDesc::Image(picture))] = &parts.textures[..] else { panic!("{:?}", parts.textures) };
        assert_eq!((name.as_str(), picture.file.0.as_str()), ("m/a.gltf/wood", "m/a.gltf#image/0"));
        let MaterialDesc::MetallicRoughness(desc) = &parts.materials[0].1 else { panic!() };
        assert_eq!(desc.common.alpha.texture.is_some(), has_alpha);
        // In a file of its own
        let mut file = file_with(json!({
            "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
            "extensions": { "KHR_materials_specular": { "specularTexture": { "index": 0 } } },
        }));
        file["images"] = json!([{ "uri": "wood.png" }]);
        let mut assets = MemoryAssets::default();
        assets.files.insert("m/wood.png".into(), bytes);
        let shown = ShownModel { assets: &assets, ..PLAIN };
        let parts = describe(&open(file, &[]), &shown).unwrap_or_else(|fault| panic!("{fault:?}"));
        let MaterialDesc::MetallicRoughness(desc) = &parts.materials[0].1 else { panic!() };
        assert_eq!([&desc.common.alpha, &desc.specular].map(|number| number.texture.is_some()), [has_alpha; 2]);
    }
}

#[test]
fn extensions_of_materials() {
    let desc = metallic(json!({ "extensions": {
        "KHR_materials_ior": { "ior": 1.33 },
        "KHR_materials_specular": {
            "specularFactor": 0.5, "specularTexture": { "index": 0 },
            "specularColorFactor": [2, 1, 0], "specularColorTexture": { "index": 1 },
        },
        "KHR_materials_clearcoat": {
            "clearcoatFactor": 0.75, "clearcoatTexture": { "index": 0 },
            "clearcoatRoughnessFactor": 0.25, "clearcoatRoughnessTexture": { "index": 1 },
            "clearcoatNormalTexture": { "index": 2, "scale": 2 },
        },
    } }));
    assert_eq!((desc.ior, desc.specular), (1.33, channel(0, Channel::A, 0.5, 0.0)));
    // More than 1 is allowed of the factor
    assert_eq!(desc.specular_color, colored(1, [2.0, 1.0, 0.0]));
    assert_eq!(desc.clearcoat, channel(0, Channel::R, 0.75, 0.0));
    assert_eq!(desc.clearcoat_roughness, channel(1, Channel::G, 0.25, 0.0));
    assert_eq!((desc.clearcoat_normal_map, desc.clearcoat_normal_scale), (Some(texture(2)), 2.0));
    // An index of 0 stands for all that is reflected; others below 1 do not exist
    let ior = |ior: f64| metallic(json!({ "extensions": { "KHR_materials_ior": { "ior": ior } } })).ior;
    assert_eq!([ior(0.0), ior(0.5), ior(1e9)], [0.0, 1.0, 100.0]);
    // The alpha of a picture without one is 1
    let specular = json!({ "extensions": { "KHR_materials_specular": { "specularTexture": { "index": 3 } } } });
    assert_eq!(metallic(specular).specular, NumberParam::constant(1.0));
}

#[test]
fn an_unlit_material_is_its_colour() {
    let desc = material(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.3, 1], "baseColorTexture": { "index": 0 } },
        "normalTexture": { "index": 1 },
        "emissiveFactor": [1, 1, 0], "emissiveTexture": { "index": 2 },
        "extensions": { "KHR_materials_unlit": {} },
    }));
    let MaterialDesc::Unlit(desc) = desc else { panic!("{desc:?}") };
    assert_eq!(desc.common.emissive, ColorParam::gray(0.0));
    assert_eq!((desc.color, desc.common.normal_map), (colored(0, [0.1, 0.2, 0.3]), None));
}

#[test]
fn specular_glossiness_is_a_dielectric_that_reflects_its_specular_colour() {
    let of = |picture: usize| {
        metallic(json!({
            "alphaMode": "BLEND",
            // What is there for readers of metallic-roughness does not count
            "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 0, 1] },
            "extensions": { "KHR_materials_pbrSpecularGlossiness": {
                "diffuseFactor": [0.5, 0.25, 0.125, 0.75], "diffuseTexture": { "index": 0 },
                "specularFactor": [0.1, 0.2, 0.3], "glossinessFactor": 0.75,
                "specularGlossinessTexture": { "index": picture },
            } },
        }))
    };
    let desc = of(1);
    assert_eq!(desc.base_color, colored(0, [0.5, 0.25, 0.125]));
    assert_eq!((desc.ior, desc.specular_color), (0.0, colored(1, [0.1, 0.2, 0.3])));
    assert_eq!(desc.metallic, MetallicRoughnessDesc::default().metallic);
    // 1 - glossiness
    assert_eq!(desc.roughness, channel(1, Channel::A, -0.75, 1.0));
    assert_eq!(desc.common.alpha, channel(0, Channel::A, 0.75, 0.0));
    assert_eq!(of(3).roughness, NumberParam::constant(0.25));
}

#[test]
fn what_transmits_light_is_a_veil() {
    let of = |texture: Value| {
        let mut transmission = json!({ "transmissionFactor": 0.5 });
        if !texture.is_null() {
            transmission["transmissionTexture"] = texture;
        }
        let parts = parts_of(file_with(json!({
            "name": "pane",
            "pbrMetallicRoughness": { "metallicFactor": 0 },
            "extensions": { "KHR_materials_transmission": transmission },
        })));
        assert_eq!(
            warnings(&parts),
            ["the material \"pane\" transmits light: it is shown as a thin veil; light is not bent or coloured by it"]
        );
        let MaterialDesc::MetallicRoughness(desc) = &parts.materials[0].1 else { panic!() };
        assert_eq!(desc.common.alpha_mode, AlphaMode::Blend);
        desc.common.alpha.clone()
    };
    // White: 0.5 x 0.85 x 1 of what is behind it
    let alpha = of(Value::Null);
    assert!((alpha.factor - 0.575).abs() < 1e-12 && alpha.texture.is_none(), "{alpha:?}");
    let alpha = of(json!({ "index": 2 }));
    assert_eq!((alpha.texture, alpha.channel, alpha.bias), (Some(texture(2)), Channel::R, 1.0));
    assert!((alpha.factor + 0.425).abs() < 1e-12);
    // The alpha of a blended material multiplies that of transmission, a mask ignores it, and metalness reduces it
    let of = |mut material: Value| {
        material["extensions"] = json!({ "KHR_materials_transmission": { "transmissionFactor": 0.5 } });
        let parts = parts_of(file_with(material));
        let MaterialDesc::MetallicRoughness(desc) = &parts.materials[0].1 else { panic!() };
        (desc.common.alpha_mode, desc.common.alpha.clone())
    };
    let base = |alpha: f64| {
        json!({
            "baseColorFactor": [1, 1, 1, alpha], "baseColorTexture": { "index": 0 }, "metallicFactor": 0,
        })
    };
    let (mode, alpha) = of(json!({ "alphaMode": "BLEND", "pbrMetallicRoughness": base(0.5) }));
    assert_eq!((mode, alpha.texture, alpha.channel), (AlphaMode::Blend, Some(texture(0)), Channel::A));
    assert!((alpha.factor - 0.5 * 0.575).abs() < 1e-12);
    let (mode, alpha) = of(json!({ "alphaMode": "MASK", "pbrMetallicRoughness": base(1.0) }));
    assert_eq!((mode, alpha.factor), (AlphaMode::Mask, 1.0));
    let metal = |metallic: f64| json!({ "pbrMetallicRoughness": { "metallicFactor": metallic } });
    assert_eq!(of(metal(1.0)).0, AlphaMode::Opaque);
    assert!((of(metal(0.5)).1.factor - 0.7875).abs() < 1e-12);
    // Without a factor nothing is let through
    let none = metallic(json!({ "extensions": { "KHR_materials_transmission": {} } }));
    assert_eq!(none.common.alpha_mode, AlphaMode::Opaque);
}

/// The texture of a material with this reference to texture 0, which has a sampler.
fn image(info: Value, sampler: Value) -> (ImageTextureDesc, Vec<String>) {
    let mut file = file_with(json!({ "pbrMetallicRoughness": { "baseColorTexture": info } }));
    file["textures"][0]["sampler"] = 0.into();
    file["samplers"] = json!([sampler]);
    let mut parts = parts_of(file);
    let warnings = warnings(&parts);
    match parts.textures.remove(0).1 {
        TextureDesc::Image(image) => (image, warnings),
        other => panic!("{other:?}"),
    }
}

#[test]
fn samplers() {
    let of = |sampler| {
        let (image, warnings) = image(json!({ "index": 0 }), sampler);
        assert_eq!((image.file.0.as_str(), warnings), ("m/t0.png", Vec::new()));
        (image.wrap, image.filter)
    };
    assert_eq!(of(json!({})), ([Wrap::Repeat; 2], Filter::Anisotropic));
    assert_eq!(
        of(json!({ "wrapS": 33071, "wrapT": 33648, "magFilter": 9729, "minFilter": 9984 })),
        ([Wrap::Clamp, Wrap::Mirror], Filter::Anisotropic)
    );
    assert_eq!(of(json!({ "wrapS": 10497, "magFilter": 9728 })), ([Wrap::Repeat; 2], Filter::Nearest));
}

#[test]
fn sets_of_texture_coordinates() {
    let of = |info| {
        let (image, warnings) = image(info, json!({}));
        (image.uv_set, warnings)
    };
    assert_eq!(of(json!({ "index": 0, "texCoord": 2 })), (Some(2), Vec::new()));
    // That of the transform counts
    let transform = json!({ "KHR_texture_transform": { "texCoord": 1 } });
    assert_eq!(of(json!({ "index": 0, "texCoord": 2, "extensions": transform })), (Some(1), Vec::new()));
    let warning = "/materials/0/pbrMetallicRoughness/baseColorTexture: set 5 of texture coordinates is not read; 0 to \
                   3 are; set 0 is used instead";
    assert_eq!(of(json!({ "index": 0, "texCoord": 5 })), (None, vec![warning.to_owned()]));
}

#[test]
fn a_texture_transform_moves_points_as_on_paper() {
    let (offset, rotation, scale) = ([0.25, 0.5], 0.4f64, [2.0, 3.0]);
    let transform = json!({ "offset": offset, "rotation": rotation, "scale": scale });
    let info = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
    let desc = image(info, json!({})).0;
    for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.8]] {
        // KHR_texture_transform, with v downwards
        let (sin, cos) = pxfm::f_sincos(rotation);
        let [su, sv] = [scale[0] * u, scale[1] * v];
        let expected = [offset[0] + cos * su + sin * sv, 1.0 - (offset[1] - sin * su + cos * sv)];
        // ImageTextureDesc, with v upwards
        let (sin, cos) = pxfm::f_sincos(desc.rotate_deg.to_radians());
        let [su, sv] = [desc.scale[0] * u, desc.scale[1] * (1.0 - v)];
        let found = [cos * su - sin * sv + desc.offset[0], sin * su + cos * sv + desc.offset[1]];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found}, not {expected}, of {u}, {v}");
        }
    }
}

#[test]
fn textures_without_a_picture_are_left_out() {
    let mut file = file_with(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    file["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
    let parts = parts_of(file.clone());
    assert_eq!(
        warnings(&parts),
        ["/textures/0: the texture has no picture that can be read, and is left out; pictures are PNG, JPEG or WebP"]
    );
    assert!(parts.textures.is_empty());
    file["textures"][0] = json!({ "source": 0, "extensions": { "EXT_texture_webp": { "source": 1 } } });
    let parts = parts_of(file.clone());
    let TextureDesc::Image(image) = &parts.textures[0].1 else { panic!() };
    assert_eq!(image.file.0, "m/t1.png");
    // Two textures of one picture are one
    file["materials"][0]["emissiveTexture"] = json!({ "index": 1 });
    file["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    assert_eq!(parts_of(file.clone()).textures.len(), 1);
    file["textures"][0]["source"] = 9.into();
    file["textures"][0]["extensions"] = Value::Null;
    assert_eq!(
        fault_of(file, &PLAIN),
        "/textures/0/source: there is no number 9 in \"images\", which has 4; the file is damaged or written wrongly: \
         export it anew"
    );
}

#[test]
fn variants_give_primitives_other_materials() {
    let mapping = json!({ "KHR_materials_variants": { "mappings": [
        { "variants": [1], "material": 1 }, { "variants": [0, 2], "material": 2 },
    ] } });
    let file = json!({
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0 }, "material": 0, "extensions": mapping },
            { "attributes": { "POSITION": 0 }, "material": 0 },
        ] }],
        "materials": [{ "name": "red" }, { "name": "green" }, { "name": "blue" }],
        "extensions": { "KHR_materials_variants": { "variants": [
            { "name": "day" }, { "name": "night" }, { "name": "dawn" },
        ] } },
    });
    let materials = |variant| {
        let parts = describe(&open(file.clone(), &[]), &ShownModel { variant, ..PLAIN });
        match &parts.unwrap_or_else(|fault| panic!("{fault:?}")).shapes[0].shape {
            ShapeDesc::Mesh(mesh) => mesh.materials.clone(),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(materials(None), ["m/a.gltf/red", "m/a.gltf/red"]);
    assert_eq!(materials(Some("night")), ["m/a.gltf/green", "m/a.gltf/red"]);
    assert_eq!(materials(Some("dawn")), ["m/a.gltf/blue", "m/a.gltf/red"]);
    assert_eq!(
        fault_of(file.clone(), &ShownModel { variant: Some("noon"), ..PLAIN }),
        ": there is no variant \"noon\"; the file has \"day\", \"night\", \"dawn\""
    );
    // The scene's own in place of one of the file
    let chosen = |name: &str| (name == "red").then(|| "mine".to_owned());
    let parts = describe(&open(file, &[]), &ShownModel { chosen: &chosen, ..PLAIN }).expect("is read");
    assert!(parts.materials.is_empty());
}

#[test]
fn materials_are_called_as_the_file_calls_them() {
    let primitives = json!([
        { "attributes": { "POSITION": 0 }, "material": 0 },
        { "attributes": { "POSITION": 0 }, "material": 1 },
        { "attributes": { "POSITION": 0 }, "material": 2 },
        { "attributes": { "POSITION": 0 } },
        { "attributes": { "POSITION": 0, "COLOR_0": 0 } },
    ]);
    let file = json!({
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": primitives }],
        "materials": [{ "name": "default" }, { "name": "default" }, {}],
    });
    let parts = parts_of(file.clone());
    let names: Vec<&str> = parts.materials.iter().map(|(name, _)| name.as_str()).collect();
    let expected = ["default", "default 2", "material 2", "default 3", "default with colours"];
    assert_eq!(names, expected.map(|name| format!("m/a.gltf/{name}")));
    // Without a material: matte, and white below the colours of vertices
    assert_eq!(parts.materials[3].1, clay(false));
    assert_eq!(parts.materials[4].1, clay(true));
    let unlit = describe(&open(file.clone(), &[]), &ShownModel { unlit: true, ..PLAIN }).expect("is read");
    assert!(unlit.materials.iter().all(|(_, material)| matches!(material, MaterialDesc::Unlit(_))));
    assert_eq!(unlit.materials[0].0, "m/a.gltf/default unlit");
    // So they are replaced by those of the scene, and what has none is no material of that name
    let chosen = |name: &str| matches!(name, "material 2" | "default").then(|| "red".to_owned());
    let gltf = open(file, &[]);
    assert_eq!(gltf.material_names(), ["default", "default", "material 2"]);
    let parts = describe(&gltf, &ShownModel { chosen: &chosen, ..PLAIN }).expect("is read");
    let names: Vec<&str> = parts.materials.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["m/a.gltf/default", "m/a.gltf/default with colours"]);
    let ShapeDesc::Mesh(mesh) = &parts.shapes[0].shape else { panic!("is a mesh") };
    assert_eq!(mesh.materials[..3], ["red", "red", "red"]);
}

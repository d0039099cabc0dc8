//! What a glTF file holds, shown or not, for reports.

use std::collections::HashSet;

use super::LIGHTS;
use super::extensions::is_read;
use super::material::VARIANTS;
use crate::context::Assets;
use crate::import::{Gltf, GltfFault, JsonPlace, MeshAddress, Uri, called};
use crate::model::PictureFinder;
use crate::model::report::{
    ModelAnimation, ModelCounts, ModelExtension, ModelFile, ModelMaterial, ModelPicture, ModelReport,
};

/// The largest picture that is looked at, in bytes.
const MAX_PICTURE: u64 = 1 << 30;

/// Fills in what the file `file` says of itself; its pictures are read by `assets`.
pub(crate) fn gltf_contents(
    gltf: &Gltf,
    file: &str,
    assets: &dyn Assets,
    report: &mut ModelReport,
) -> Result<(), GltfFault> {
    let root = gltf.root();
    report.format = if gltf.is_binary { "GLB" } else { "glTF" };
    let asset = root.get("asset");
    let said = |key: &str| asset.as_ref().and_then(|asset| asset.text_of(key)).map(str::to_owned);
    (report.version, report.generator, report.copyright) = (said("version"), said("generator"), said("copyright"));
    report.files.push(ModelFile { file: file.to_owned(), bytes: Some(gltf.length) });
    for (file, bytes) in gltf.buffer_files() {
        report.files.push(ModelFile { file, bytes });
    }
    report.extensions = extensions(&root)?;
    for (index, animation) in root.list("animations")?.iter().enumerate() {
        let name = animation.text_of("name").unwrap_or_default().to_owned();
        report.animations.push(ModelAnimation { name, seconds: gltf.duration(index)? });
    }
    if let Some(variants) = root.extension(VARIANTS) {
        let names = variants.list("variants")?;
        report.variants = names.iter().map(|variant| variant.text_of("name").unwrap_or_default().to_owned()).collect();
    }
    report.counts = counts(&root)?;
    let used = used_materials(&root)?;
    for (index, at) in root.list("materials")?.iter().enumerate() {
        let named = at.text_of("name").is_some_and(|name| !name.is_empty());
        report.materials.push(ModelMaterial { name: called(at, index), named, used: used.contains(&index) });
    }
    report.pictures = pictures(gltf, file, assets)?;
    Ok(())
}

fn extensions(root: &JsonPlace<'_>) -> Result<Vec<ModelExtension>, GltfFault> {
    let names = |key: &str| root.list(key)?.iter().map(|name| name.text()).collect::<Result<Vec<_>, _>>();
    let (used, required) = (names("extensionsUsed")?, names("extensionsRequired")?);
    let mut seen = HashSet::new();
    let all = used.iter().chain(&required).filter(|name| seen.insert(**name));
    let all = all.map(|name| ModelExtension {
        name: (*name).to_owned(),
        required: required.contains(name),
        read: is_read(name),
    });
    Ok(all.collect())
}

fn counts(root: &JsonPlace<'_>) -> Result<ModelCounts, GltfFault> {
    let count = |key: &str| root.count(key) as u64;
    let mut counts = ModelCounts {
        scenes: count("scenes"),
        nodes: count("nodes"),
        meshes: count("meshes"),
        materials: count("materials"),
        skins: count("skins"),
        cameras: count("cameras"),
        lights: root.extension(LIGHTS).map_or(0, |lights| lights.count("lights") as u64),
        ..ModelCounts::default()
    };
    for mesh in root.list("meshes")? {
        let primitives = mesh.list("primitives")?;
        counts.primitives += primitives.len() as u64;
        counts.morph_targets += primitives.iter().map(|primitive| primitive.count("targets")).max().unwrap_or(0) as u64;
    }
    for skin in root.list("skins")? {
        counts.joints += skin.count("joints") as u64;
    }
    for node in root.list("nodes")? {
        let scale: [f64; 3] = node.numbers_or("scale", [1.0; 3])?;
        counts.negative_scales += u64::from(scale.iter().any(|along| *along < 0.0));
    }
    Ok(counts)
}

/// The numbers of the materials that primitives have, in any variant.
fn used_materials(root: &JsonPlace<'_>) -> Result<HashSet<usize>, GltfFault> {
    let mut used = HashSet::new();
    for mesh in root.list("meshes")? {
        for primitive in mesh.list("primitives")? {
            used.extend(primitive.get("material").map(|number| number.index()).transpose()?);
            if let Some(mapped) = primitive.extension(VARIANTS) {
                for mapping in mapped.list("mappings")? {
                    used.insert(mapping.need("material")?.index()?);
                }
            }
        }
    }
    Ok(used)
}

/// All pictures, and what materials use them for.
fn pictures(gltf: &Gltf, file: &str, assets: &dyn Assets) -> Result<Vec<ModelPicture>, GltfFault> {
    let root = gltf.root();
    let (textures, images) = (root.list("textures")?, root.list("images")?);
    let mut uses: Vec<Vec<String>> = vec![Vec::new(); images.len()];
    for material in root.list("materials")? {
        for (of, texture) in material.textures() {
            for source in textures.get(texture).map(JsonPlace::sources).unwrap_or_default() {
                if let Some(uses) = uses.get_mut(source)
                    && !uses.contains(&of)
                {
                    uses.push(of.clone());
                }
            }
        }
    }
    let mut finder = PictureFinder::new(assets);
    let mut pictures = Vec::with_capacity(images.len());
    for (index, (image, uses)) in images.iter().zip(uses).enumerate() {
        let inside = format!("{file}#image/{index}");
        let uri = image.text_of("uri").filter(|_| image.get("bufferView").is_none());
        let (file, bytes) = match uri.map(|uri| Uri::of(uri, gltf.folder())) {
            Some(Uri::File(path)) => {
                let path = finder.find(path, gltf.folder());
                let bytes = assets.read(&path, MAX_PICTURE).map_err(|error| error.to_string());
                (path, bytes)
            }
            Some(Uri::Scheme(scheme)) => {
                (uri.unwrap_or_default().to_owned(), Err(format!("{scheme}: nothing is fetched from a network")))
            }
            Some(Uri::Data(_)) | None => {
                (inside, gltf.image(index).map(Option::unwrap_or_default).map_err(|fault| fault.message))
            }
        };
        pictures.push(ModelPicture::new(file, bytes, uses));
    }
    Ok(pictures)
}

/// How many sets of texture coordinates each primitive of the mesh at an address has.
pub(crate) fn gltf_uv_sets(gltf: &Gltf, address: &MeshAddress) -> Result<Vec<usize>, GltfFault> {
    let root = gltf.root();
    let mesh = match address {
        MeshAddress::Mesh(mesh) => *mesh,
        MeshAddress::Node(node, _) => root.nth("nodes", *node)?.need("mesh")?.index()?,
    };
    let primitives = root.nth("meshes", mesh)?.list("primitives")?;
    let sets = |primitive: &JsonPlace<'_>| {
        let attributes = primitive.get("attributes");
        let has = |set: usize| attributes.as_ref().is_some_and(|at| at.get(&format!("TEXCOORD_{set}")).is_some());
        (0..).take_while(|set| has(*set)).count()
    };
    Ok(primitives.iter().map(sets).collect())
}

//! Extensions of glTF: which are read, and what to do about the others.

use super::super::ModelWarning;
use crate::import::{GltfFault, JsonPlace};

/// Those that are read, or change nothing that could be seen.
const READ: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
];

/// How a file becomes one that can be read, by the extension that stands in the way.
const CONVERT: &[(&str, &str)] = &[
    ("KHR_draco_mesh_compression", "unpack it: `npx @gltf-transform/cli copy in.glb out.glb`"),
    ("EXT_meshopt_compression", "unpack it: `npx @gltf-transform/cli copy in.glb out.glb`"),
    ("KHR_meshopt_compression", "unpack it: `npx @gltf-transform/cli copy in.glb out.glb`"),
    ("KHR_texture_basisu", "unpack its pictures: `npx @gltf-transform/cli ktxdecompress in.glb out.glb`"),
    ("EXT_texture_avif", "convert its pictures: `npx @gltf-transform/cli webp in.glb out.glb`"),
];

/// Whether an extension is read, or changes nothing that could be seen.
pub(super) fn is_read(name: &str) -> bool {
    READ.contains(&name)
}

/// Refuses a file that cannot be shown without an extension that is not read; warns of those that it could do without.
pub(super) fn check(root: &JsonPlace<'_>, warnings: &mut Vec<ModelWarning>) -> Result<(), GltfFault> {
    let names = |key: &str| -> Result<Vec<&str>, GltfFault> {
        let names = root.list(key)?.iter().map(|name| name.text()).collect::<Result<Vec<_>, _>>()?;
        Ok(names.into_iter().filter(|name| !is_read(name)).collect())
    };
    let required = names("extensionsRequired")?;
    let shown = |name: &str| name.chars().take(80).collect::<String>();
    if let Some(name) = required.first() {
        let hint = CONVERT.iter().find(|(known, _)| known == name).map(|(_, hint)| (*hint).to_owned());
        let hint = hint.unwrap_or_else(|| "export it without that extension".into());
        let message = format!("needs the extension {}, which is not read", shown(name));
        return Err(GltfFault { hint, ..root.fault(message) });
    }
    for name in names("extensionsUsed")? {
        let message = format!("uses the extension {}, which is not read", shown(name));
        warnings.push(ModelWarning { message, hint: "what it adds is not shown".into() });
    }
    Ok(())
}

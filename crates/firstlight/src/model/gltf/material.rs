//! The materials and textures of a glTF file.
//!
//! Source: "glTF 2.0 specification", section 3.8 and 3.9, and the extensions named below.

use std::collections::HashMap;

use super::super::{ModelParts, ModelWarning, PictureFinder, UniqueNames, clay, material_name, shown};
use super::{ShownModel, no_such};
use crate::describe::{Channel, ColorDesc, ColorParam, FilePath, NumberParam, ParamDesc};
use crate::image::read::{Limits, read_header};
use crate::import::{Gltf, GltfFault, JsonPlace, Uri, called};
use crate::material::{AlphaMode, MaterialCommonDesc, MaterialDesc, MetallicRoughnessDesc, UnlitDesc};
use crate::texture::{Filter, ImageTextureDesc, TextureDesc, Wrap};

/// The materials of a file that its primitives use, and their textures.
pub(super) struct Materials<'a> {
    gltf: &'a Gltf,
    shown: &'a ShownModel<'a>,
    variant: Option<usize>,
    /// Names of those that are described, by their numbers; `None` is the material of what has none.
    names: HashMap<(Option<usize>, bool), String>,
    materials: Vec<(String, MaterialDesc)>,
    material_names: UniqueNames,
    textures: Vec<(String, TextureDesc)>,
    texture_names: UniqueNames,
    /// The textures by all that parts them, as text.
    known_textures: HashMap<String, usize>,
    /// Whether pictures have alpha.
    alphas: HashMap<PictureAddress, bool>,
    pictures: PictureFinder<'a>,
    warnings: Vec<ModelWarning>,
}

/// A texture that a material uses.
struct Used {
    name: String,
    picture: PictureAddress,
}

/// Where a picture is.
#[derive(Clone, PartialEq, Eq, Hash)]
enum PictureAddress {
    /// In the glTF file: its number there.
    Inside(usize),
    /// A file of its own.
    File(String),
}

pub(super) const VARIANTS: &str = "KHR_materials_variants";
/// The largest picture that is looked at for alpha, in bytes.
const MAX_PICTURE: u64 = 1 << 30;
/// How much of the light behind thin glass is seen at most.
const CLEAREST: f64 = 0.85;

impl<'a> Materials<'a> {
    pub fn new(gltf: &'a Gltf, shown: &'a ShownModel<'a>) -> Result<Self, GltfFault> {
        let variants = gltf.root().extension(VARIANTS).map_or(Ok(Vec::new()), |variants| variants.list("variants"))?;
        let names: Vec<&str> = variants.iter().map(|variant| variant.text_of("name").unwrap_or_default()).collect();
        let find = |wanted: &str| {
            let found = names.iter().position(|name| *name == wanted);
            found.ok_or_else(|| no_such(&gltf.root(), "variant", wanted, &names))
        };
        let variant = shown.variant.map(find).transpose()?;
        Ok(Materials {
            gltf,
            shown,
            variant,
            names: HashMap::new(),
            materials: Vec::new(),
            material_names: UniqueNames::default(),
            textures: Vec::new(),
            texture_names: UniqueNames::default(),
            known_textures: HashMap::new(),
            alphas: HashMap::new(),
            pictures: PictureFinder::new(shown.assets),
            warnings: Vec::new(),
        })
    }

    /// Hands over what was described.
    pub fn finish(self, parts: &mut ModelParts) {
        parts.materials.extend(self.materials);
        parts.textures.extend(self.textures);
        parts.warnings.extend(self.warnings);
        parts.warnings.extend(self.pictures.warnings);
    }

    /// The name in the scene of the material of a primitive.
    pub fn of_primitive(&mut self, primitive: &JsonPlace<'_>) -> Result<String, GltfFault> {
        let mut number = primitive.get("material");
        if let (Some(variant), Some(mapped)) = (self.variant, primitive.extension(VARIANTS)) {
            for mapping in mapped.list("mappings")? {
                for of in mapping.list("variants")? {
                    if of.index()? == variant {
                        number = Some(mapping.need("material")?);
                    }
                }
            }
        }
        let has_colors = primitive.get("attributes").is_some_and(|attributes| attributes.get("COLOR_0").is_some());
        let index = number.as_ref().map(|number| number.index()).transpose()?;
        let key = (index, has_colors && index.is_none());
        if let Some(name) = self.names.get(&key) {
            return Ok(name.clone());
        }
        let at = number.map(|number| self.gltf.root().of_index("materials", &number)).transpose()?;
        let own = match (&at, index) {
            (Some(at), Some(index)) => called(at, index),
            _ if has_colors => "default with colours".to_owned(),
            _ => "default".to_owned(),
        };
        let chosen = index.and_then(|_| (self.shown.chosen)(&own));
        let name = match chosen {
            Some(chosen) => chosen,
            None => {
                let name = self.material_names.unique(material_name(self.shown.file, &own, self.shown.unlit));
                let material = match &at {
                    Some(at) => self.material(at, &own)?,
                    None => clay(has_colors),
                };
                self.materials.push((name.clone(), shown(material, self.shown.unlit)));
                name
            }
        };
        self.names.insert(key, name.clone());
        Ok(name)
    }

    fn warn(&mut self, message: String, hint: &str) {
        self.warnings.push(ModelWarning { message, hint: hint.to_owned() });
    }

    fn material(&mut self, at: &JsonPlace<'_>, name: &str) -> Result<MaterialDesc, GltfFault> {
        if let Some(old) = at.extension("KHR_materials_pbrSpecularGlossiness") {
            return self.specular_glossiness(at, &old);
        }
        let pbr = at.get("pbrMetallicRoughness");
        let factors = pbr.as_ref().map_or(Ok([1.0; 4]), |pbr| pbr.numbers_or("baseColorFactor", [1.0; 4]))?;
        let of_pbr = |key: &str| pbr.as_ref().and_then(|pbr| pbr.get(key));
        let base = self.texture(of_pbr("baseColorTexture"))?;
        let mut common = self.common(at, base.as_ref(), factors[3])?;
        let base_color = color(factors, base);
        if at.extension("KHR_materials_unlit").is_some() {
            // KHR_materials_unlit: the base colour alone is shown
            (common.normal_map, common.emissive) = (None, MaterialCommonDesc::default().emissive);
            return Ok(MaterialDesc::Unlit(UnlitDesc { color: base_color, common }));
        }
        let data = self.texture(of_pbr("metallicRoughnessTexture"))?;
        let factor = |key: &str| pbr.as_ref().map_or(Ok(1.0), |pbr| pbr.number_or(key, 1.0));
        let mut desc = MetallicRoughnessDesc {
            metallic: number(factor("metallicFactor")?, data.as_ref(), Channel::B),
            roughness: number(factor("roughnessFactor")?, data.as_ref(), Channel::G),
            base_color,
            common,
            ..MetallicRoughnessDesc::default()
        };
        self.occlusion(at, &mut desc)?;
        self.extensions(at, name, &mut desc)?;
        Ok(MaterialDesc::MetallicRoughness(desc))
    }

    /// Source: KHR_materials_ior, KHR_materials_specular, KHR_materials_clearcoat, KHR_materials_transmission.
    fn extensions(
        &mut self,
        at: &JsonPlace<'_>,
        name: &str,
        desc: &mut MetallicRoughnessDesc,
    ) -> Result<(), GltfFault> {
        if let Some(ior) = at.extension("KHR_materials_ior") {
            let ior = ior.number_or("ior", 1.5)?;
            desc.ior = if ior == 0.0 { 0.0 } else { ior.clamp(1.0, 100.0) };
        }
        if let Some(specular) = at.extension("KHR_materials_specular") {
            let texture = self.texture(specular.get("specularTexture"))?.filter(|used| self.may_have_alpha(used));
            desc.specular = number(specular.number_or("specularFactor", 1.0)?, texture.as_ref(), Channel::A);
            let [r, g, b] = specular.numbers_or("specularColorFactor", [1.0; 3])?;
            let texture = self.texture(specular.get("specularColorTexture"))?;
            desc.specular_color = unclamped_color([r, g, b].map(|c| c.clamp(0.0, 1e4)), texture);
        }
        if let Some(coat) = at.extension("KHR_materials_clearcoat") {
            let texture = self.texture(coat.get("clearcoatTexture"))?;
            desc.clearcoat = number(coat.number_or("clearcoatFactor", 0.0)?, texture.as_ref(), Channel::R);
            let texture = self.texture(coat.get("clearcoatRoughnessTexture"))?;
            let roughness = coat.number_or("clearcoatRoughnessFactor", 0.0)?;
            desc.clearcoat_roughness = number(roughness, texture.as_ref(), Channel::G);
            if let Some(map) = coat.get("clearcoatNormalTexture") {
                desc.clearcoat_normal_scale = map.number_or("scale", 1.0)?.clamp(-1e4, 1e4);
                desc.clearcoat_normal_map = self.texture(Some(map))?.map(|texture| texture.name);
            }
        }
        if let Some(transmission) = at.extension("KHR_materials_transmission") {
            let part = transmission.number_or("transmissionFactor", 0.0)?.clamp(0.0, 1.0);
            // A metal transmits no light. A metalness texture is not looked up: its material counts as a dielectric
            let dielectric = 1.0 - if desc.metallic.texture.is_none() { desc.metallic.factor } else { 0.0 };
            let part = part * dielectric;
            // A masked material is opaque where it is not cut out
            if part > 0.0 && desc.common.alpha_mode != AlphaMode::Mask {
                // Thin and clear: what the base colour lets through
                let [r, g, b] = desc.base_color.factor.linear;
                let through = part * CLEAREST * (0.2126 * r + 0.7152 * g + 0.0722 * b).clamp(0.0, 1.0);
                let texture = self.texture(transmission.get("transmissionTexture"))?;
                let common = &mut desc.common;
                let coverage = if common.alpha_mode == AlphaMode::Blend { common.alpha.clone() } else { 1.0.into() };
                common.alpha = match (coverage.texture.is_some(), texture) {
                    (false, Some(texture)) => NumberParam {
                        texture: Some(texture.name),
                        channel: Channel::R,
                        factor: -through * coverage.factor,
                        bias: coverage.factor,
                    },
                    // Alpha has one texture; that of the base colour is kept
                    _ => NumberParam { factor: coverage.factor * (1.0 - through), ..coverage },
                };
                common.alpha_mode = AlphaMode::Blend;
                let message = format!("the material {name:?} transmits light: it is shown as a thin veil");
                self.warn(message, "light is not bent or coloured by it");
            }
        }
        Ok(())
    }

    fn occlusion(&mut self, at: &JsonPlace<'_>, desc: &mut MetallicRoughnessDesc) -> Result<(), GltfFault> {
        if let Some(occlusion) = at.get("occlusionTexture") {
            let strength = occlusion.number_or("strength", 1.0)?.clamp(0.0, 1.0);
            if let Some(texture) = self.texture(Some(occlusion))? {
                // 1 + strength (texture - 1)
                desc.occlusion = NumberParam {
                    texture: Some(texture.name),
                    channel: Channel::R,
                    factor: strength,
                    bias: 1.0 - strength,
                };
            }
        }
        Ok(())
    }

    /// A dielectric whose reflectance seen from the front is the specular colour: with an index of refraction of 0 all
    /// of it is `specular_color`.
    ///
    /// Source: KHR_materials_pbrSpecularGlossiness; KHR_materials_ior, on an index of 0.
    fn specular_glossiness(&mut self, at: &JsonPlace<'_>, old: &JsonPlace<'_>) -> Result<MaterialDesc, GltfFault> {
        let factors = old.numbers_or("diffuseFactor", [1.0; 4])?;
        let diffuse = self.texture(old.get("diffuseTexture"))?;
        let common = self.common(at, diffuse.as_ref(), factors[3])?;
        let data = self.texture(old.get("specularGlossinessTexture"))?;
        let glossiness = old.number_or("glossinessFactor", 1.0)?.clamp(0.0, 1.0);
        let roughness = match &data {
            Some(data) if self.may_have_alpha(data) => {
                NumberParam { texture: Some(data.name.clone()), channel: Channel::A, factor: -glossiness, bias: 1.0 }
            }
            _ => NumberParam::constant(1.0 - glossiness),
        };
        let specular = old.numbers_or("specularFactor", [1.0; 3])?.map(|c| c.clamp(0.0, 1.0));
        let mut desc = MetallicRoughnessDesc {
            base_color: color(factors, diffuse),
            specular_color: unclamped_color(specular, data),
            ior: 0.0,
            roughness,
            common,
            ..MetallicRoughnessDesc::default()
        };
        self.occlusion(at, &mut desc)?;
        Ok(MaterialDesc::MetallicRoughness(desc))
    }

    /// What materials of all kinds have. `base` is the texture whose alpha counts.
    fn common(&mut self, at: &JsonPlace<'_>, base: Option<&Used>, alpha: f64) -> Result<MaterialCommonDesc, GltfFault> {
        let mut common = MaterialCommonDesc::default();
        let alpha = alpha.clamp(0.0, 1.0);
        common.single_sided = !at.flag("doubleSided");
        let mode = match at.text_of("alphaMode") {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask,
            Some("BLEND") => AlphaMode::Blend,
            Some(other) => {
                let shown: String = other.chars().take(40).collect();
                return Err(at.fault(format!("{shown:?} is none of OPAQUE, MASK and BLEND")));
            }
        };
        if mode != AlphaMode::Opaque {
            common.alpha_mode = mode;
            common.alpha = match base.filter(|base| self.may_have_alpha(base)) {
                Some(base) => NumberParam { factor: alpha, ..NumberParam::channel(&*base.name, Channel::A) },
                None => NumberParam::constant(alpha),
            };
            let cutoff = at.number_or("alphaCutoff", 0.5)?;
            common.cutoff = cutoff.clamp(0.0, 1.0);
            // No alpha reaches a cutoff above 1: the whole surface is cut out
            if mode == AlphaMode::Mask && cutoff > 1.0 {
                (common.alpha, common.cutoff) = (NumberParam::constant(0.0), 1.0);
            }
        }
        if let Some(map) = at.get("normalTexture") {
            common.normal_scale = map.number_or("scale", 1.0)?.clamp(-1e4, 1e4);
            common.normal_map = self.texture(Some(map))?.map(|texture| texture.name);
        }
        let factor = at.numbers_or("emissiveFactor", [0.0; 3])?.map(|c| c.clamp(0.0, 1e6));
        let texture = self.texture(at.get("emissiveTexture").filter(|_| factor != [0.0; 3]))?;
        common.emissive = unclamped_color(factor, texture);
        if let Some(strength) = at.extension("KHR_materials_emissive_strength") {
            common.emissive_strength = strength.number_or("emissiveStrength", 1.0)?.clamp(0.0, 1e6);
        }
        Ok(common)
    }

    /// The texture that a material names, if it names one that has a picture.
    fn texture(&mut self, info: Option<JsonPlace<'_>>) -> Result<Option<Used>, GltfFault> {
        let Some(info) = info else { return Ok(None) };
        let (root, number) = (self.gltf.root(), info.need("index")?);
        let texture = root.of_index("textures", &number)?;
        let webp = texture.extension("EXT_texture_webp").and_then(|webp| webp.get("source"));
        let Some(source) = webp.or(texture.get("source")) else {
            let message =
                format!("{}: the texture has no picture that can be read, and is left out", texture.pointer());
            self.warn(message, "pictures are PNG, JPEG or WebP");
            return Ok(None);
        };
        let image = root.of_index("images", &source)?;
        let source = source.index()?;
        let inside = || format!("{}#image/{source}", self.shown.file);
        let (file, picture) = match (image.get("bufferView"), image.text_of("uri")) {
            (None, Some(uri)) => match Uri::of(uri, self.gltf.folder()) {
                Uri::Data(_) => (inside(), PictureAddress::Inside(source)),
                Uri::File(path) => {
                    let path = self.pictures.find(path, self.gltf.folder());
                    (path.clone(), PictureAddress::File(path))
                }
                Uri::Scheme(_) => (uri.to_owned(), PictureAddress::File(uri.to_owned())),
            },
            _ => (inside(), PictureAddress::Inside(source)),
        };
        let mut desc = ImageTextureDesc::new(FilePath(file));
        if let Some(sampler) = texture.get("sampler") {
            let sampler = root.of_index("samplers", &sampler)?;
            for (wrap, key) in desc.wrap.iter_mut().zip(["wrapS", "wrapT"]) {
                *wrap = match sampler.index_or(key, 10497)? {
                    33071 => Wrap::Clamp,
                    33648 => Wrap::Mirror,
                    _ => Wrap::Repeat,
                };
            }
            // 9728: NEAREST
            if sampler.index_or("magFilter", 9729)? == 9728 {
                desc.filter = Filter::Nearest;
            }
        }
        let mut set = info.index_or("texCoord", 0)?;
        if let Some(transform) = info.extension("KHR_texture_transform") {
            set = transform.index_or("texCoord", set)?;
            texture_transform(&transform, &mut desc)?;
        }
        if set > 3 {
            let message = format!("{}: set {set} of texture coordinates is not read; 0 to 3 are", info.pointer());
            self.warn(message, "set 0 is used instead");
            set = 0;
        }
        desc.uv_set = (set > 0).then_some(set as u32);
        let known = format!("{desc:?}");
        if let Some(index) = self.known_textures.get(&known) {
            return Ok(Some(Used { name: self.textures[*index].0.clone(), picture }));
        }
        let own = [texture.text_of("name"), image.text_of("name")].into_iter().flatten().find(|name| !name.is_empty());
        let own = own.map_or_else(|| format!("texture {}", number.index().unwrap_or(0)), str::to_owned);
        let name = self.texture_names.unique(format!("{}/{own}", self.shown.file));
        self.known_textures.insert(known, self.textures.len());
        self.textures.push((name.clone(), TextureDesc::Image(desc)));
        Ok(Some(Used { name, picture }))
    }

    /// Whether the picture of a texture may have alpha: of one in a file that cannot be read it is not known.
    fn may_have_alpha(&mut self, used: &Used) -> bool {
        let (gltf, assets) = (self.gltf, self.shown.assets);
        *self.alphas.entry(used.picture.clone()).or_insert_with_key(|picture| {
            let bytes = match picture {
                PictureAddress::Inside(index) => Some(gltf.image(*index).ok().flatten().unwrap_or_default()),
                PictureAddress::File(path) => {
                    let ending = path.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
                    if matches!(ending.as_str(), "jpg" | "jpeg") {
                        return false;
                    }
                    assets.read(path, MAX_PICTURE).ok()
                }
            };
            bytes.is_none_or(|bytes| read_header(&bytes, &Limits::default()).is_ok_and(|header| header.has_alpha()))
        })
    }
}

/// Moves a texture. glTF turns v, which runs downwards there, before it is taken off 1: with v = 1 - w,
///
/// u' = ox + cos su u + sin sv (1 - w), 1 - w' = oy - sin su u + cos sv (1 - w).
///
/// Source: KHR_texture_transform.
fn texture_transform(transform: &JsonPlace<'_>, desc: &mut ImageTextureDesc) -> Result<(), GltfFault> {
    let limited = |v: f64| v.clamp(-1e6, 1e6);
    let scale: [f64; 2] = transform.numbers_or("scale", [1.0; 2])?.map(limited);
    let [x, y] = transform.numbers_or("offset", [0.0; 2])?.map(limited);
    let angle = transform.number_or("rotation", 0.0)?;
    let angle = if angle.abs() <= 600.0 { angle } else { 0.0 };
    let (sin, cos) = pxfm::f_sincos(angle);
    desc.scale = scale;
    desc.rotate_deg = angle.to_degrees();
    desc.offset = [x + sin * scale[1], 1.0 - y - cos * scale[1]].map(limited);
    Ok(())
}

/// A colour of 0 to 1 in each channel, times a texture.
fn color([r, g, b, _]: [f64; 4], texture: Option<Used>) -> ColorParam {
    unclamped_color([r, g, b].map(|c| c.clamp(0.0, 1.0)), texture)
}

fn unclamped_color(factor: [f64; 3], texture: Option<Used>) -> ColorParam {
    ColorParam { texture: texture.map(|used| used.name), ..ParamDesc::constant(ColorDesc::from(factor)) }
}

/// A number of 0 to 1, times a channel of a texture.
fn number(factor: f64, texture: Option<&Used>, channel: Channel) -> NumberParam {
    let factor = factor.clamp(0.0, 1.0);
    match texture {
        Some(used) => NumberParam { factor, ..NumberParam::channel(&*used.name, channel) },
        None => NumberParam::constant(factor),
    }
}

//! What a Wavefront MTL file says of surfaces, as materials and textures of a scene.
//!
//! The station before is the reader of statements, `import/mtl.rs`; the station after is whoever adds the materials to
//! a scene. Nothing here opens a file. What the terms become:
//!
//! - Without a term of the metallic-roughness kind (`Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso`, `anisor` and their maps) a
//!   material is `phong`: `Kd` is `diffuse`, `Ks` `specular`, `Ns` `shininess`. `illum 1` has no highlight; `illum 0`
//!   is `unlit` in the colour `Kd`. With one it is `metallic-roughness`: `Kd` is `base_color`, `Pr` `roughness`, `Pm`
//!   `metallic`, `Pc` and `Pcr` the coat, `Ni` above 1 `ior`; `Ks`, `Ns`, `Ka` and `illum` are not used.
//! - Colours are linear, as Blender writes and reads them.
//! - `Ka` is `ambient` where it is a colour or has a map. Where it is a gray it is what a program writes into every
//!   material, 0, 0.2 or 1, whatever the surface: then `ambient` is the diffuse colour, as in all scenes.
//! - A map is multiplied with its factor, as the specification says. Programs write a factor of 0 beside a map that
//!   they show, so 0 counts as 1 there.
//! - `d` and 1 - `Tr` are `alpha`, `d` before `Tr`; where there is anything to see through, `alpha_mode` is `blend`.
//! - A number takes the luminance of its map, or the channel that `-imfchan` says; `map_d` takes the alpha of a picture
//!   that has one.
//! - A bump map has heights without a unit: the caller says how much 1 is. Blender writes normal maps as `map_Bump` and
//!   its own name into the first line, so there they are normal maps, as `norm` is everywhere.

use std::collections::{HashMap, HashSet};

use crate::describe::{Channel, ColorParam, FilePath, NumberParam, ParamDesc};
use crate::import::mtl::{self, MtlColor, MtlMap, MtlMaterial, MtlNotes, MtlNumber, MtlPicture};
use crate::import::{ImportError, MtlNote, shown};
use crate::material::{AlphaMode, MaterialCommonDesc, MaterialDesc, MetallicRoughnessDesc, PhongDesc, UnlitDesc};
use crate::texture::{Filter, ImageTextureDesc, TextureDesc, TextureSpace, Wrap};

/// What a file of materials does not say itself.
#[derive(Clone, Copy)]
pub struct MtlSettings<'a> {
    /// Whether a material of this name is wanted; textures of others are left out with them.
    pub is_wanted: &'a dyn Fn(&str) -> bool,
    /// The name in the scene of a texture that this file calls so.
    pub texture_name: &'a dyn Fn(&str) -> String,
    /// Whether the picture at a path, relative to the MTL file, has an alpha channel; `None` where it cannot be read.
    pub has_alpha: &'a dyn Fn(&str) -> Option<bool>,
    /// The height of white in a bump map with `-bm 1`, in metres. A hundredth of the model's size is a good guess.
    pub bump_height: f64,
}

/// What a file says of surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaterials {
    /// In the order of the file, each name once.
    pub materials: Vec<(String, MaterialDesc)>,
    /// The textures of the materials, each name once; files are relative to the MTL file.
    pub textures: Vec<(String, TextureDesc)>,
    /// What was left out or taken otherwise than written, in the order of lines.
    pub notes: Vec<MtlNote>,
    /// The names of the materials that are not wanted, in the order of the file.
    pub unwanted: Vec<String>,
    /// The pictures that the file names and that none of the textures shows, sorted, relative to the MTL file.
    pub unused_pictures: Vec<String>,
}

/// Reads the materials of a Wavefront MTL file from its bytes. All numbers are within what materials may have.
///
/// `name` stands in errors.
///
/// # Errors
/// [`ImportError`] for what is no text, longer than 64 MiB, or has more than 65,536 materials.
pub fn read_mtl(name: &str, bytes: &[u8], settings: &MtlSettings<'_>) -> Result<MtlMaterials, ImportError> {
    let mut notes = MtlNotes::default();
    let read = mtl::read(name, bytes, &mut notes)?;
    let by_blender = bytes.starts_with(b"# Blender");
    let mut file = Translation { settings, notes, textures: MtlTextures::default(), by_blender };
    let (wanted, others): (Vec<_>, Vec<_>) = read.iter().partition(|material| (settings.is_wanted)(&material.name));
    let materials = wanted.iter().map(|material| (material.name.clone(), file.material(material))).collect();
    let textures = file.textures.list;
    let picture = |(_, texture): &'_ (String, TextureDesc)| match texture {
        TextureDesc::Image(image) => Some(image.file.0.clone()),
        _ => None,
    };
    let used: HashSet<String> = textures.iter().filter_map(picture).collect();
    let pictures = read.iter().flat_map(|material| material.maps.values()).map(|picture| &picture.file);
    let mut unused_pictures: Vec<String> = pictures.filter(|picture| !used.contains(*picture)).cloned().collect();
    unused_pictures.sort();
    unused_pictures.dedup();
    let unwanted = others.iter().map(|material| material.name.clone()).collect();
    Ok(MtlMaterials { materials, textures, notes: file.notes.finish(), unwanted, unused_pictures })
}

/// The textures so far: each picture once for each way it lies.
#[derive(Default)]
struct MtlTextures {
    list: Vec<(String, TextureDesc)>,
    /// By all that parts them, as text.
    known: HashMap<String, usize>,
    /// How many pictures of a name there are.
    named: HashMap<String, u64>,
    taken: HashSet<String>,
}

struct Translation<'a> {
    settings: &'a MtlSettings<'a>,
    notes: MtlNotes,
    textures: MtlTextures,
    /// Whether Blender wrote the file.
    by_blender: bool,
}

impl Translation<'_> {
    fn material(&mut self, material: &MtlMaterial) -> MaterialDesc {
        if material.is_metallic_roughness {
            return MaterialDesc::MetallicRoughness(self.metallic_roughness(material));
        }
        if material.illum == Some(0) {
            let color = self.color(material, MtlColor::Kd, MtlMap::Kd, 0.8);
            return MaterialDesc::Unlit(UnlitDesc { color, common: self.common(material) });
        }
        let diffuse = self.color(material, MtlColor::Kd, MtlMap::Kd, 0.8);
        let ambient = self.ambient(material).filter(|ambient| *ambient != diffuse);
        let mut phong = PhongDesc { diffuse, ambient, common: self.common(material), ..PhongDesc::default() };
        if self.has_highlight(material) {
            phong.specular = self.color(material, MtlColor::Ks, MtlMap::Ks, 0.0);
            // A map without a factor spans the range that the specification names
            let default = phong.shininess.factor;
            phong.shininess = self.number(material, MtlNumber::Ns, MtlMap::Ns, default, [1000.0, 1e6]);
        }
        MaterialDesc::Phong(phong)
    }

    fn metallic_roughness(&mut self, material: &MtlMaterial) -> MetallicRoughnessDesc {
        let number = |number, without: f64| material.numbers.get(&number).map_or(without, |(value, _)| *value);
        let base_color = self.color(material, MtlColor::Kd, MtlMap::Kd, 0.8);
        let roughness = self.number(material, MtlNumber::Pr, MtlMap::Pr, 0.5, [1.0, 1.0]);
        let metallic = self.number(material, MtlNumber::Pm, MtlMap::Pm, 0.0, [1.0, 1.0]);
        // 1 is what programs write that know no index
        let ior = Some(number(MtlNumber::Ni, 0.0)).filter(|ior| *ior > 1.0).unwrap_or(1.5);
        let common = self.common(material);
        MetallicRoughnessDesc {
            base_color,
            roughness,
            metallic,
            ior,
            clearcoat: NumberParam::constant(number(MtlNumber::Pc, 0.0)),
            clearcoat_roughness: NumberParam::constant(number(MtlNumber::Pcr, 0.0)),
            common,
            ..MetallicRoughnessDesc::default()
        }
    }

    /// What materials of all kinds have.
    fn common(&mut self, material: &MtlMaterial) -> MaterialCommonDesc {
        let emissive = self.color(material, MtlColor::Ke, MtlMap::Ke, 0.0);
        let (alpha, alpha_mode) = self.alpha(material);
        let mut common = MaterialCommonDesc { emissive, alpha, alpha_mode, ..MaterialCommonDesc::default() };
        let is_unlit = material.illum == Some(0) && !material.is_metallic_roughness;
        for (map, word) in [(MtlMap::Normal, "norm"), (MtlMap::Bump, "bump")] {
            let Some(picture) = material.maps.get(&map) else { continue };
            if is_unlit {
                let message = format!("`{word}` changes nothing under illum 0, where no light counts");
                self.notes.add("unlit map", picture.line, message, "write illum 1 or 2");
            } else if map == MtlMap::Normal || self.by_blender && common.normal_map.is_none() {
                (common.normal_map, common.normal_scale) = (Some(self.texture(picture)), picture.bump.clamp(-1e4, 1e4));
            } else {
                common.bump_map = self.textured(picture, 1.0, [-1e4, 1e4], Channel::Luminance);
                common.bump_scale = (picture.bump * self.settings.bump_height).clamp(-1e4, 1e4);
            }
        }
        common
    }

    /// The diffuse colour if there is none.
    fn ambient(&mut self, material: &MtlMaterial) -> Option<ColorParam> {
        let is_gray = |[r, g, b]: [f64; 3]| r == g && g == b;
        match (material.colors.get(&MtlColor::Ka), material.maps.get(&MtlMap::Ka)) {
            (None, None) => None,
            (Some(&(ka, line)), None) if is_gray(ka) => {
                if ka[0] != 0.0 && ka[0] != 1.0 {
                    let message = format!("a gray Ka, {}, is not used: the ambient colour is Kd", ka[0]);
                    let hint = "programs write one gray for all surfaces; a material in the scene may have `ambient`";
                    self.notes.add("gray Ka", line, message, hint);
                }
                None
            }
            _ => Some(self.color(material, MtlColor::Ka, MtlMap::Ka, 1.0)),
        }
    }

    /// Whether a material of the classic kind has a highlight.
    fn has_highlight(&mut self, material: &MtlMaterial) -> bool {
        let has_map = material.maps.contains_key(&MtlMap::Ks);
        let has_color = material.colors.get(&MtlColor::Ks).is_some_and(|(ks, _)| *ks != [0.0; 3]);
        if material.illum == Some(1) || !(has_map || has_color) {
            return false;
        }
        match (material.numbers.get(&MtlNumber::Ns), material.maps.get(&MtlMap::Ns)) {
            (Some(&(0.0, line)), None) => {
                let message = "Ns 0 is taken as no highlight: it would be as wide as the surface";
                self.notes.add("Ns 0", line, message, "write Ns 1 or more, or Ks 0");
                false
            }
            _ => true,
        }
    }

    fn alpha(&mut self, material: &MtlMaterial) -> (NumberParam, AlphaMode) {
        let number = |number| material.numbers.get(&number).copied();
        let (d, tr) = (number(MtlNumber::D), number(MtlNumber::Tr));
        let (mut alpha, line, written) = match (d, tr) {
            (Some((d, line)), _) => (d, line, "d 0"),
            (None, Some((tr, line))) => (1.0 - tr, line, "Tr 1"),
            (None, None) => (1.0, material.line, ""),
        };
        if let (Some((d, _)), Some((tr, line))) = (d, tr)
            && (d + tr - 1.0).abs() > 1e-3
        {
            let message = format!("d {d} and Tr {tr} contradict each other: d is taken");
            self.notes.add("d and Tr", line, message, "Tr is 1 - d");
        }
        let Some(picture) = material.maps.get(&MtlMap::D) else {
            if alpha == 0.0 {
                let message = format!("{written} makes the material {} invisible", shown(material.name.as_bytes()));
                self.notes.add("invisible", line, message, "d 1 is opaque; some programs take Tr for d");
            }
            let mode = if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
            return (NumberParam::constant(alpha), mode);
        };
        if alpha == 0.0 {
            self.zero_factor(line, written, "map_d");
            alpha = 1.0;
        }
        let has_alpha = (self.settings.has_alpha)(&picture.file) == Some(true);
        let channel = if has_alpha { Channel::A } else { Channel::Luminance };
        let mut param = self.textured(picture, alpha, [0.0, 1.0], channel);
        if param.channel == Channel::A && !has_alpha {
            let file = shown(picture.file.as_bytes());
            let message = format!("{file} has no alpha that could be read: its luminance is taken");
            self.notes.add("no alpha", picture.line, message, "-imfchan m takes the alpha of a picture");
            param.channel = Channel::Luminance;
        }
        (param, AlphaMode::Blend)
    }

    /// A colour with its map. `without`: the colour that nothing is said of.
    fn color(&mut self, material: &MtlMaterial, color: MtlColor, map: MtlMap, without: f64) -> ColorParam {
        let said = material.colors.get(&color).copied();
        let Some(picture) = material.maps.get(&map) else {
            return ColorParam::from(said.map_or([without; 3], |(rgb, _)| rgb));
        };
        let mut factor = said.map_or([1.0; 3], |(rgb, _)| rgb);
        if factor == [0.0; 3] {
            let line = said.map_or(picture.line, |(_, line)| line);
            self.zero_factor(line, &format!("{color:?} 0"), &format!("map_{color:?}"));
            factor = [1.0; 3];
        }
        if picture.base != 0.0 {
            let message = format!("the base {} of -mm is not added to colours", picture.base);
            self.notes.add("base of a colour", picture.line, message, "the gain is multiplied with them");
        }
        let factor = factor.map(|value| (value * picture.gain).clamp(0.0, 1e6));
        ParamDesc { factor: factor.into(), ..ColorParam::texture(self.texture(picture)) }
    }

    /// A number with its map. `without`: the number that nothing is said of; `[with_map, most]`: the factor of a map
    /// without one, and the largest.
    fn number(
        &mut self,
        material: &MtlMaterial,
        number: MtlNumber,
        map: MtlMap,
        without: f64,
        [with_map, most]: [f64; 2],
    ) -> NumberParam {
        let said = material.numbers.get(&number).copied();
        let Some(picture) = material.maps.get(&map) else {
            return NumberParam::constant(said.map_or(without, |(value, _)| value));
        };
        let factor = match said {
            Some((0.0, line)) => {
                self.zero_factor(line, &format!("{number:?} 0"), &format!("map_{number:?}"));
                with_map
            }
            Some((value, _)) => value,
            None => with_map,
        };
        let mut param = self.textured(picture, factor, [0.0, most], Channel::Luminance);
        if param.channel == Channel::A && (self.settings.has_alpha)(&picture.file) != Some(true) {
            param.channel = Channel::Luminance;
        }
        param
    }

    fn zero_factor(&mut self, line: u64, written: &str, map: &str) {
        let message = format!("{written} beside {map} is taken as 1: the map would be black");
        self.notes.add(&format!("zero {map}"), line, message, "the factor multiplies the map");
    }

    /// factor x (base + gain x number), of the picture's own channel or else this one. The factor of the number is kept
    /// within a range.
    fn textured(
        &mut self,
        picture: &MtlPicture,
        factor: f64,
        [least, most]: [f64; 2],
        channel: Channel,
    ) -> NumberParam {
        let channel = picture.channel.unwrap_or(channel);
        let bias = (factor * picture.base).clamp(-1e6, 1e6);
        let factor = (factor * picture.gain).clamp(least, most);
        ParamDesc { factor, bias, ..NumberParam::channel(self.texture(picture), channel) }
    }

    /// The name of the texture that shows a picture.
    fn texture(&mut self, picture: &MtlPicture) -> String {
        let filter = match picture.blend {
            [false, false] => Filter::Nearest,
            _ => Filter::Anisotropic,
        };
        if picture.blend[0] != picture.blend[1] {
            let message = "texels are blended along both axes or none: -blendu and -blendv differ, and they are";
            self.notes.add("blend", picture.line, message, "write both as off for texels with sharp edges");
        }
        let space = |srgb: bool| if srgb { TextureSpace::Srgb } else { TextureSpace::Raw };
        let desc = ImageTextureDesc {
            wrap: [if picture.clamp { Wrap::Clamp } else { Wrap::Repeat }; 2],
            filter,
            color_space: picture.srgb.map(space),
            scale: picture.scale,
            offset: picture.offset,
            ..ImageTextureDesc::new(FilePath(picture.file.clone()))
        };
        let textures = &mut self.textures;
        let index = *textures.known.entry(format!("{desc:?}")).or_insert_with(|| {
            // By the picture, and by a number where it lies in several ways
            let base = picture.file.rsplit('/').next().unwrap_or_default();
            let count = textures.named.entry(base.to_owned()).or_insert(0);
            let local = loop {
                *count += 1;
                let local = if *count == 1 { base.to_owned() } else { format!("{base} {count}") };
                if textures.taken.insert(local.clone()) {
                    break local;
                }
            };
            textures.list.push(((self.settings.texture_name)(&local), TextureDesc::Image(desc)));
            textures.list.len() - 1
        });
        textures.list[index].0.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::ColorDesc;

    const SETTINGS: MtlSettings<'static> = MtlSettings {
        is_wanted: &|_| true,
        texture_name: &|name| format!("m/{name}"),
        has_alpha: &|_| None,
        bump_height: 0.01,
    };

    fn of(text: &str) -> MtlMaterials {
        read_mtl("a.mtl", text.as_bytes(), &SETTINGS).unwrap()
    }

    fn one(statements: &str) -> (MaterialDesc, MtlMaterials) {
        let all = of(&format!("newmtl a\n{statements}"));
        (all.materials[0].1.clone(), all)
    }

    fn phong(statements: &str) -> PhongDesc {
        match one(statements).0 {
            MaterialDesc::Phong(phong) => phong,
            other => panic!("{other:?}"),
        }
    }

    fn rough(statements: &str) -> MetallicRoughnessDesc {
        match one(statements).0 {
            MaterialDesc::MetallicRoughness(rough) => rough,
            other => panic!("{other:?}"),
        }
    }

    fn messages(all: &MtlMaterials) -> Vec<&str> {
        all.notes.iter().map(|note| note.message.as_str()).collect()
    }

    fn textured(name: &str, factor: f64) -> ColorParam {
        ParamDesc { factor: ColorDesc::gray(factor), ..ColorParam::texture(name) }
    }

    #[test]
    fn classic_terms_are_those_of_phong() {
        let (material, all) =
            one("Ka 0 0 0\nKd 0.64 0.5 0\nKs 0.5 0.4 0.3\nKe 0.1 0 0\nNs 96\nNi 1.45\nd 1\nillum 2\n");
        let common = MaterialCommonDesc { emissive: [0.1, 0.0, 0.0].into(), ..MaterialCommonDesc::default() };
        let (diffuse, specular) = ([0.64, 0.5, 0.0].into(), [0.5, 0.4, 0.3].into());
        let shininess = NumberParam::constant(96.0);
        assert_eq!(material, MaterialDesc::Phong(PhongDesc { diffuse, specular, ambient: None, shininess, common }));
        assert_eq!((all.textures.len(), all.notes.len()), (0, 0));
        // Nothing said
        assert_eq!(phong(""), PhongDesc::default());
    }

    #[test]
    fn illum_says_whether_there_is_light_and_a_highlight() {
        let specular = |illum: &str| phong(&format!("Ks 0.5\nNs 8\n{illum}")).specular;
        assert_eq!(
            ["", "illum 2", "illum 5"].map(specular),
            [ColorParam::gray(0.5), ColorParam::gray(0.5), ColorParam::gray(0.5)]
        );
        assert_eq!(specular("illum 1"), ColorParam::gray(0.0));
        let (material, all) = one("illum 0\nKd 1 0 0\nKe 0 1 0\nmap_bump a.png\nd 0.5\n");
        let MaterialDesc::Unlit(unlit) = material else { panic!("{material:?}") };
        assert_eq!((unlit.color, unlit.common.emissive), ([1.0, 0.0, 0.0].into(), [0.0, 1.0, 0.0].into()));
        assert_eq!((unlit.common.alpha_mode, unlit.common.bump_map), (AlphaMode::Blend, NumberParam::constant(0.0)));
        assert_eq!(messages(&all), ["`bump` changes nothing under illum 0, where no light counts"]);
        assert_eq!(all.textures.len(), 0);
    }

    #[test]
    fn an_exponent_of_0_is_no_highlight() {
        let (material, all) = one("Ks 1\nmap_Ks a.png\nNs 0\nillum 2\n");
        assert_eq!(material, MaterialDesc::Phong(PhongDesc::default()));
        assert_eq!((messages(&all).len(), all.textures.len()), (1, 0));
        assert_eq!(one("Ks 0\nNs 0").1.notes.len(), 0);
        assert_eq!(phong("Ks 1").shininess, NumberParam::constant(16.0));
    }

    #[test]
    fn ambient_is_the_diffuse_colour_unless_ka_is_a_colour_or_a_map() {
        let ambient = |text: &str| phong(text).ambient;
        assert_eq!(["Ka 0", "Ka 1 1 1", "Ka 0.2 0.2 0.2", "Ka 20 20 20"].map(ambient), [None, None, None, None]);
        assert_eq!(messages(&one("Ka 0.2").1), ["a gray Ka, 0.2, is not used: the ambient colour is Kd"]);
        assert_eq!(one("Ka 1").1.notes.len(), 0);
        assert_eq!(ambient("Ka 0.1 0 0\nKd 1 0 0"), Some([0.1, 0.0, 0.0].into()));
        assert_eq!(ambient("Ka 0.1 0 0\nKd 0.1 0 0"), None);
        assert_eq!(ambient("Ka 0.5\nKd 0.5\nmap_Ka a.png\nmap_Kd a.png"), None);
        assert_eq!(ambient("map_Ka a.png\nmap_Kd b.png"), Some(ColorParam::texture("m/a.png")));
    }

    #[test]
    fn maps_are_multiplied_with_their_factors() {
        let (_, all) = one("Kd 0 0 0\nKs 0.5\nmap_Kd a.png\nmap_Ks -mm 0 0.5 a.png\nNs 20\n\
             map_Ns -imfchan g -mm 0.1 0.9 n.png\nmap_Ke a.png");
        let MaterialDesc::Phong(phong) = &all.materials[0].1 else { panic!() };
        assert_eq!((&phong.diffuse, &phong.specular), (&textured("m/a.png", 1.0), &textured("m/a.png", 0.25)));
        assert_eq!(phong.common.emissive, textured("m/a.png", 1.0));
        let shininess = ParamDesc { factor: 18.0, bias: 2.0, ..NumberParam::channel("m/n.png", Channel::G) };
        assert_eq!(phong.shininess, shininess);
        assert_eq!(messages(&all), ["Kd 0 beside map_Kd is taken as 1: the map would be black"]);
        assert_eq!(all.textures.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["m/a.png", "m/n.png"]);
        // Without a number, all of the range
        let (_, all) = one("Ks 1\nmap_Ns -imfchan m n.png\nmap_Kd -mm 0.5 1 a.png");
        let MaterialDesc::Phong(phong) = &all.materials[0].1 else { panic!() };
        assert_eq!(
            phong.shininess,
            ParamDesc { factor: 1000.0, ..NumberParam::channel("m/n.png", Channel::Luminance) }
        );
        assert_eq!(messages(&all), ["the base 0.5 of -mm is not added to colours"]);
    }

    #[test]
    fn terms_of_metallic_roughness_make_that_material() {
        let text =
            "Kd 0.9 0.5 0.1\nKs 0.5\nKe 1 1 1\nNi 1.33\nPr 0.2\nPm 0.3\nPc 0.5\nPcr 0.6\nillum 0\nnorm -bm 0.5 n.png";
        let material = rough(text);
        assert_eq!(material.base_color, [0.9, 0.5, 0.1].into());
        let numbers = [&material.roughness, &material.metallic, &material.clearcoat, &material.clearcoat_roughness];
        assert_eq!(numbers, [0.2, 0.3, 0.5, 0.6].map(NumberParam::constant).each_ref());
        assert_eq!((material.ior, material.common.emissive), (1.33, ColorParam::gray(1.0)));
        assert_eq!((material.common.normal_map.as_deref(), material.common.normal_scale), (Some("m/n.png"), 0.5));
        assert_eq!(rough("Ps 0\nNi 1.0"), MetallicRoughnessDesc::default());
        let maps = rough("map_Pr r.png\nPm 0\nmap_Pm m.png\nPr 0.5");
        let luminance = |name: &str, factor| ParamDesc { factor, ..NumberParam::channel(name, Channel::Luminance) };
        assert_eq!((maps.roughness, maps.metallic), (luminance("m/r.png", 0.5), luminance("m/m.png", 1.0)));
    }

    #[test]
    fn alpha_is_d_or_1_less_tr() {
        let alpha = |text: &str| {
            let (material, all) = one(text);
            let MaterialDesc::Phong(phong) = material else { panic!() };
            (phong.common.alpha.factor, phong.common.alpha_mode, all.notes.len())
        };
        assert_eq!(alpha("d 1"), (1.0, AlphaMode::Opaque, 0));
        assert_eq!(alpha("d 0.25\nTr 0.75"), (0.25, AlphaMode::Blend, 0));
        assert_eq!(alpha("Tr 0.25"), (0.75, AlphaMode::Blend, 0));
        assert_eq!(alpha("d 1\nTr 1"), (1.0, AlphaMode::Opaque, 1));
        assert_eq!(alpha("Tr 1"), (0.0, AlphaMode::Blend, 1));
        assert_eq!(messages(&one("Tr 1").1), ["Tr 1 makes the material `a` invisible"]);
        // By a map: the alpha of what has one
        let of_map = |text: &str, has_alpha: Option<bool>| {
            let settings = MtlSettings { has_alpha: &move |_| has_alpha, ..SETTINGS };
            let all = read_mtl("a.mtl", format!("newmtl a\n{text}").as_bytes(), &settings).unwrap();
            let MaterialDesc::Phong(phong) = &all.materials[0].1 else { panic!() };
            assert_eq!(phong.common.alpha_mode, AlphaMode::Blend);
            (phong.common.alpha.channel, phong.common.alpha.factor, all.notes.len())
        };
        assert_eq!(of_map("map_d a.png", Some(true)), (Channel::A, 1.0, 0));
        assert_eq!(of_map("d 0.5\nmap_d a.png", Some(false)), (Channel::Luminance, 0.5, 0));
        assert_eq!(of_map("d 0\nmap_d -imfchan m a.png", None), (Channel::Luminance, 1.0, 2));
        assert_eq!(of_map("map_d -imfchan r a.png", Some(true)), (Channel::R, 1.0, 0));
    }

    #[test]
    fn bumps_are_as_high_as_the_caller_says() {
        let common = phong("map_bump -bm 3 b.png").common;
        assert_eq!((common.bump_map, common.bump_scale), (NumberParam::channel("m/b.png", Channel::Luminance), 0.03));
        let common = phong("bump -bm -1 -imfchan r b.png\nnorm n.png").common;
        assert_eq!((common.bump_map, common.bump_scale), (NumberParam::texture("m/b.png"), -0.01));
        assert_eq!(common.normal_map.as_deref(), Some("m/n.png"));
        // Blender writes normal maps so
        let blender = of("# Blender 4.1.1 MTL File: ''\nnewmtl a\nillum 2\nmap_Bump -bm 0.5 n.png\n");
        let MaterialDesc::Phong(PhongDesc { common, .. }) = &blender.materials[0].1 else { panic!() };
        assert_eq!((common.normal_map.as_deref(), common.normal_scale), (Some("m/n.png"), 0.5));
        assert_eq!(common.bump_map, NumberParam::constant(0.0));
    }

    #[test]
    fn each_picture_is_a_texture_for_each_way_it_lies() {
        let text = "map_Kd x/a.png\nmap_Ks -s 2 3 -o 0.5 -clamp on x/a.png\nmap_Ka y/a.png\nmap_Ke x/a.png\n\
                    map_d -blendu off -blendv off -colorspace srgb b.png\nmap_bump y/a.png 2";
        let (_, all) = one(text);
        let names: Vec<&str> = all.textures.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["m/a.png", "m/a.png 2", "m/b.png", "m/a.png 2 2", "m/a.png 3"]);
        let TextureDesc::Image(image) = &all.textures[4].1 else { panic!() };
        assert_eq!((image.scale, image.offset, image.wrap), ([2.0, 3.0], [0.5, 0.0], [Wrap::Clamp; 2]));
        let TextureDesc::Image(image) = &all.textures[2].1 else { panic!() };
        assert_eq!((image.filter, image.color_space), (Filter::Nearest, Some(TextureSpace::Srgb)));
    }
}

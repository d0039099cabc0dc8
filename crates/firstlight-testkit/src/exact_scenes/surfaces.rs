//! Scenes of metals and dielectrics: pictures, normal maps, masks, veils, clear coats.

use firstlight::{
    AlphaMode, AmbientDesc, AmbientGradientDesc, Channel, FilePath, Filter, ImageTextureDesc, MaterialCommonDesc,
    MetallicRoughnessDesc, NumberParam, TextureDesc, Wrap,
};

use super::*;

/// The textures of a scene by what they are for.
#[derive(Default)]
struct Palette {
    /// Names of pictures and checkerboards for colours and numbers.
    values: Vec<String>,
    /// Those of pictures, which have all channels.
    pictures: Vec<String>,
    /// Those of normal maps.
    normals: Vec<String>,
    /// Those of heights.
    heights: Vec<String>,
}

/// What [`composed`] builds, of metals and dielectrics.
pub(super) fn surfaces(random: &mut Random) -> SceneDesc {
    let mut scene = empty(48, 48, random.pick(&[1, 1, 2, 2, 3, 4]));
    scene.render.display = random.pick(&[
        DisplayEncoding::Srgb,
        DisplayEncoding::Srgb,
        DisplayEncoding::Neutral,
        DisplayEncoding::Gamma,
        DisplayEncoding::Linear,
    ]);
    let stage = Stage::new(random);
    let mut palette = Palette::default();
    scene = palette.fill(random, scene);
    for i in 0..2 + random.below(4) {
        let material = match random.chance(0.12) {
            true => material(random, &scene),
            false => MaterialDesc::MetallicRoughness(palette.metallic_roughness(random, &stage)),
        };
        scene = scene.with_material(&format!("material {i}"), material);
    }
    if random.chance(0.4) {
        let mut part = || tint(random).linear.map(|channel| channel * 0.1);
        let [up, down] = [part(), part()].map(|[r, g, b]| ColorDesc::linear(r, g, b));
        let gradient = AmbientGradientDesc { up, down };
        scene.render.ambient = if random.chance(0.5) { up.into() } else { AmbientDesc::Gradient(gradient) };
    }
    let mut scene = staged(random, &stage, scene);
    let groups = scene.groups.iter_mut().flat_map(|(_, group)| &mut group.shapes);
    for shape in scene.shapes.iter_mut().chain(groups) {
        if let ShapeDesc::Mesh(mesh) = shape {
            paint(random, &stage, mesh);
        }
    }
    scene
}

/// Gives a mesh texture coordinates, and sometimes colours and alphas at its vertices.
fn paint(random: &mut Random, stage: &Stage, mesh: &mut MeshDesc) {
    let count = mesh.positions.len();
    if mesh.uvs.is_empty() && random.chance(0.9) {
        // Projected along a direction
        let [a, b] = across(random.direction()).map(|axis| mul(axis, random.scale(0.1, 2.0) / stage.unit));
        mesh.uvs = mesh.positions.iter().map(|p| [a, b].map(|axis| dot(sub(*p, stage.middle), axis))).collect();
    }
    if random.chance(0.3) {
        mesh.colors = (0..count).map(|_| tint(random).linear).collect();
    }
    if random.chance(0.3) {
        mesh.alphas = (0..count).map(|_| random.unit()).collect();
    }
}

impl Palette {
    fn fill(&mut self, random: &mut Random, mut scene: SceneDesc) -> SceneDesc {
        for i in 0..1 + random.below(3) {
            let name = format!("values {i}");
            let texture = if random.chance(0.35) {
                let counts = [1 + random.below(20), 1 + random.below(20)];
                checkerboard(counts, [tint(random), tint(random)].map(|color| color.linear))
            } else {
                self.pictures.push(name.clone());
                let kind = random.pick(&["noise", "hills", "spots", "spots"]);
                TextureDesc::Image(image(random, kind))
            };
            self.values.push(name.clone());
            scene = scene.with_texture(&name, texture);
        }
        for (list, name, kinds) in
            [(&mut self.normals, "normals", ["waves", "waves", "bumps"]), (&mut self.heights, "heights", ["hills"; 3])]
        {
            if random.chance(0.6) {
                let kind = random.pick(&kinds);
                scene = scene.with_texture(name, TextureDesc::Image(image(random, kind)));
                list.push(name.to_owned());
            }
        }
        scene
    }

    fn color(&self, random: &mut Random, chance: f64) -> ColorParam {
        let texture = random.chance(chance).then(|| name(random, &self.values)).flatten();
        ColorParam { texture, ..ColorParam::constant(tint(random)) }
    }

    /// A number between two others, of a texture or not.
    fn number(&self, random: &mut Random, chance: f64, [low, high]: [f64; 2]) -> NumberParam {
        if !random.chance(chance) {
            return NumberParam::constant(random.between(low, high));
        }
        let is_picture = !self.pictures.is_empty() && random.chance(0.8);
        let channels = [Channel::R, Channel::G, Channel::B, Channel::Luminance, Channel::A];
        let channel = random.pick(if is_picture { &channels[..] } else { &channels[..4] });
        let texture = name(random, if is_picture { &self.pictures } else { &self.values });
        let ends = [random.between(low, high), random.between(low, high)];
        let bias = ends[0].min(ends[1]);
        NumberParam { texture, factor: ends[0].max(ends[1]) - bias, channel, bias }
    }

    fn metallic_roughness(&self, random: &mut Random, stage: &Stage) -> MetallicRoughnessDesc {
        let mut desc = MetallicRoughnessDesc {
            base_color: self.color(random, 0.5),
            roughness: self.number(random, 0.4, [0.1, 1.0]),
            metallic: match random.below(5) {
                0 | 1 => NumberParam::constant(0.0),
                2 => NumberParam::constant(1.0),
                _ => self.number(random, 0.6, [0.0, 1.0]),
            },
            common: self.common(random, stage),
            ..MetallicRoughnessDesc::default()
        };
        if random.chance(0.3) {
            desc.ior = random.pick(&[0.0, 1.0, 1.33, 2.4]);
        }
        if random.chance(0.3) {
            (desc.specular, desc.specular_color) = (self.number(random, 0.4, [0.0, 1.0]), self.color(random, 0.4));
        }
        if random.chance(0.2) {
            desc.occlusion = self.number(random, 0.8, [0.0, 1.0]);
        }
        if random.chance(0.25) {
            desc.clearcoat = self.number(random, 0.3, [0.2, 1.0]);
            desc.clearcoat_roughness = self.number(random, 0.3, [0.1, 0.8]);
            desc.clearcoat_normal_map = random.chance(0.4).then(|| name(random, &self.normals)).flatten();
            desc.clearcoat_normal_scale = random.between(0.2, 1.5);
        }
        desc
    }

    fn common(&self, random: &mut Random, stage: &Stage) -> MaterialCommonDesc {
        let mut common = MaterialCommonDesc {
            normal_map: random.chance(0.4).then(|| name(random, &self.normals)).flatten(),
            normal_scale: random.between(-0.5, 1.5),
            single_sided: random.chance(0.08),
            ..MaterialCommonDesc::default()
        };
        if let Some(texture) = name(random, &self.heights).filter(|_| random.chance(0.25)) {
            common.bump_map = NumberParam::texture(texture);
            common.bump_scale = stage.unit * random.scale(0.003, 0.1);
        }
        if random.chance(0.12) {
            common.emissive = self.color(random, 0.6);
            common.emissive_strength = random.between(0.05, 0.5);
        }
        match random.below(8) {
            0 => (common.alpha_mode, common.cutoff) = (AlphaMode::Mask, random.between(0.2, 0.8)),
            1 => common.alpha_mode = AlphaMode::Blend,
            _ => return common,
        }
        common.alpha = match name(random, &self.pictures) {
            Some(picture) if random.chance(0.8) => NumberParam::channel(picture, Channel::A),
            _ => self.number(random, 0.6, [0.1, 1.0]),
        };
        common
    }
}

fn name(random: &mut Random, names: &[String]) -> Option<String> {
    (!names.is_empty()).then(|| names[random.below(names.len() as u32) as usize].clone())
}

/// A small picture of a kind, repeated, turned and filtered in some way.
fn image(random: &mut Random, kind: &str) -> ImageTextureDesc {
    let [width, height] = [0; 2].map(|_| 2 + random.below(23));
    let file = FilePath(format!("{kind}-{width}x{height}-{}.png", random.below(1000)));
    let filter = random.pick(&[
        Filter::Anisotropic,
        Filter::Anisotropic,
        Filter::Anisotropic,
        Filter::Trilinear,
        Filter::Bilinear,
        Filter::Nearest,
    ]);
    let mut desc = ImageTextureDesc { filter, ..ImageTextureDesc::new(file) };
    if random.chance(0.6) {
        let side = random.scale(0.5, 8.0);
        desc.scale = [side, side * random.pick(&[1.0, 1.0, -1.0, 0.5])];
        desc.offset = [random.unit(), random.unit()];
    }
    if random.chance(0.3) {
        desc.rotate_deg = random.between(0.0, 360.0);
    }
    if random.chance(0.3) {
        desc.wrap = [0; 2].map(|_| random.pick(&[Wrap::Repeat, Wrap::Mirror, Wrap::Clamp]));
    }
    desc
}

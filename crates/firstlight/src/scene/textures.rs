//! The textures of a scene: which pictures its materials use, and for what; then all of them, read and decoded at once.

use std::collections::HashMap;
use std::sync::Arc;

use super::SceneDesc;
use super::advice::advise_reflectance;
use super::compile::check_unique;
use crate::color::Rgb;
use crate::context::{AssetError, Assets, CompileContext};
use crate::describe::{Channel, ColorDesc, ColorParam, FilePath, NumberParam};
use crate::ids::TextureId;
use crate::image::ImageError;
use crate::image::read::{Limits, PictureHeader, decode, read_header};
use crate::material::{Material, UvSetUse};
use crate::parallel;
use crate::shape::{CompileCache, ShapeDesc, UV_SETS, key_of};
use crate::texture::{
    CheckerboardDesc, ImageTextureDesc, MaskRule, Param, Params, Pyramid, Texture, TextureDesc, TexturePattern,
    TextureSpace, TextureUse,
};

/// The largest picture file read as a texture, in bytes.
const MAX_TEXTURE_FILE: u64 = 1 << 30;

/// Bytes that the pictures of a scene may take as textures, with their smaller copies, unless
/// [`CompileOptions::texture_memory`](crate::CompileOptions::texture_memory) says otherwise: 2 GiB, 25 pictures of
/// 4096 x 4096 with alpha.
pub const TEXTURE_MEMORY: u64 = 2 << 30;

/// The textures of a scene while its materials are compiled: nothing is read yet.
pub(super) struct TextureRequests<'a> {
    desc: &'a SceneDesc,
    assets: &'a dyn Assets,
    /// Pyramids of before.
    cache: Option<&'a CompileCache>,
    budget: u64,
    /// Which texture a name means.
    names: HashMap<&'a str, usize>,
    /// Each texture for each use: colour and data read the same file differently.
    ids: HashMap<(usize, [u8; 7]), TextureId>,
    /// The same, in the order of ids.
    wanted: Vec<(usize, TextureUse)>,
    /// Where alpha is wanted of which texture.
    alphas: Vec<(String, usize)>,
}

/// The textures of a scene.
pub(super) struct Textures<'a> {
    pub(super) compiled: Vec<Texture>,
    /// The files that something stands in for.
    pub(super) placeholders: Vec<String>,
    /// Each file that a material uses with the hash of its bytes, in the order of names; 0 where it could not be had.
    pub(super) file_hashes: Vec<(&'a str, [u8; 32])>,
    /// Name and kind of each texture, and its squares or texels across and down.
    pub(super) sizes: Vec<(String, &'static str, Option<[u32; 2]>)>,
    /// Bytes of all pyramids.
    pub(super) bytes: u64,
}

/// A file of a scene, read.
struct PictureFile {
    bytes: Vec<u8>,
    hash: [u8; 32],
    header: PictureHeader,
}

/// Why there is no picture.
enum TextureFault {
    Read(AssetError),
    Decode(ImageError, usize),
}

/// A picture with all that is made of it.
struct SharedPicture<'p> {
    file: &'p PictureFile,
    uses: Vec<TextureUse>,
}

impl<'a> TextureRequests<'a> {
    pub(super) fn new(
        desc: &'a SceneDesc,
        assets: &'a dyn Assets,
        cache: Option<&'a CompileCache>,
        budget: Option<u64>,
    ) -> Self {
        let names = desc.textures.iter().enumerate().rev().map(|(index, (name, _))| (name.as_str(), index)).collect();
        let budget = budget.unwrap_or(TEXTURE_MEMORY);
        let (ids, wanted, alphas) = (HashMap::new(), Vec::new(), Vec::new());
        TextureRequests { desc, assets, cache, budget, names, ids, wanted, alphas }
    }

    /// Finds the faults of all textures, used or not, but for those of their files.
    pub(super) fn check(&self, cx: &mut CompileContext) {
        check_unique(cx, "texture", self.desc.textures.iter().map(|(name, t)| (t.kind(), name.as_str())));
        for (name, desc) in &self.desc.textures {
            cx.within(&format!("texture.{}.{name}", desc.kind()), |cx| match desc {
                TextureDesc::Checkerboard(board) => drop(board.compile(cx)),
                TextureDesc::Image(image) => image.check(cx),
                TextureDesc::UvGrid(grid) => grid.check(cx),
            });
        }
    }

    /// The texture called `name`.
    fn find(&self, cx: &mut CompileContext, field: &str, name: &str) -> Option<usize> {
        let index = self.names.get(name).copied();
        if index.is_none() {
            let names: Vec<&str> = self.desc.textures.iter().map(|(name, _)| name.as_str()).collect();
            cx.unknown(field, "texture", name, &names);
        }
        index
    }

    /// The texture `index`, for a use.
    fn request(&mut self, index: usize, of: TextureUse) -> TextureId {
        let next = TextureId(self.wanted.len() as u32);
        let id = *self.ids.entry((index, of.key())).or_insert(next);
        if id == next {
            self.wanted.push((index, of));
        }
        id
    }

    /// What the numbers of a texture mean, where it does not say itself.
    fn space(&self, index: usize, space: TextureSpace) -> TextureSpace {
        match &self.desc.textures[index].1 {
            TextureDesc::Image(image) => image.color_space.unwrap_or(space),
            TextureDesc::Checkerboard(_) | TextureDesc::UvGrid(_) => space,
        }
    }

    /// A channel of a texture that has to have it, if it is alpha.
    fn check_channel(&mut self, cx: &CompileContext, field: &str, index: usize, channel: Channel) {
        if channel == Channel::A {
            self.alphas.push((cx.path_of(&format!("{field}.channel")), index));
        }
    }

    /// A number, in a range if a texture does not drive it, and the texture.
    fn factor(
        &mut self,
        cx: &mut CompileContext,
        field: &str,
        param: &NumberParam,
        range: [f64; 2],
    ) -> (Param<f32>, Option<usize>) {
        // A texture may be turned around: factor = -1, bias = 1
        let least = if param.texture.is_some() { -range[1] } else { range[0] };
        let factor = cx.between(&factor_path(field, &param.texture), param.factor, least, range[1], None) as f32;
        cx.between(&format!("{field}.bias"), param.bias, -MAX_BIAS, MAX_BIAS, Some("it is added after the factor"));
        let index = param.texture.as_ref().and_then(|name| self.find(cx, &format!("{field}.texture"), name));
        if let Some(index) = index {
            self.check_channel(cx, field, index, param.channel);
        }
        (Param { texture: None, factor, channel: param.channel, bias: param.bias as f32 }, index)
    }

    fn colored(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam, covered: bool) -> Param<Rgb> {
        let path = factor_path(field, &param.texture);
        let factor = cx.color(&path, param.factor);
        let index = param.texture.as_ref().and_then(|name| self.find(cx, &format!("{field}.texture"), name));
        let texture = index.map(|index| {
            let space = self.space(index, TextureSpace::Srgb);
            let of = if covered { TextureUse::CoveredColor(space) } else { TextureUse::Color(space) };
            self.request(index, of)
        });
        Param { texture, ..Param::constant(factor) }
    }

    /// Which sets of texture coordinates the textures of a material name.
    pub(super) fn uv_sets(&self, material: &Material) -> UvSetUse {
        let named = |id: TextureId| {
            let index = self.wanted[id.index()].0;
            named_set(&self.desc.textures[index].1).map(|set| (set, index as u32))
        };
        material.uv_set_use(named)
    }

    /// Reads and decodes all pictures, on all threads, each once; those that no material uses as well, to find their
    /// faults.
    pub(super) fn finish(self, cx: &mut CompileContext) -> Textures<'a> {
        // Each file once, with the texture that names it first and the uses of all of them
        let mut files: Vec<(&str, usize, Vec<TextureUse>)> = Vec::new();
        let mut file_of: HashMap<&str, usize> = HashMap::new();
        for (index, (_, desc)) in self.desc.textures.iter().enumerate() {
            let TextureDesc::Image(image) = desc else { continue };
            let file = *file_of.entry(&image.file.0).or_insert_with(|| {
                files.push((&image.file.0, index, Vec::new()));
                files.len() - 1
            });
            for (_, of) in self.wanted.iter().filter(|(of_texture, _)| *of_texture == index) {
                if !files[file].2.iter().any(|other| other.key() == of.key()) {
                    files[file].2.push(*of);
                }
            }
        }
        let read: Vec<Result<PictureFile, TextureFault>> =
            parallel::collect(files.len(), |file| read_file(self.assets, files[file].0));
        // Each content once, however many files have it
        let mut pictures: Vec<SharedPicture> = Vec::new();
        let mut picture_of: HashMap<[u8; 32], usize> = HashMap::new();
        for (file, (.., uses)) in read.iter().zip(&files) {
            let Ok(file) = file else { continue };
            let picture = *picture_of.entry(file.hash).or_insert_with(|| {
                pictures.push(SharedPicture { file, uses: Vec::new() });
                pictures.len() - 1
            });
            for of in uses {
                if !pictures[picture].uses.iter().any(|other| other.key() == of.key()) {
                    pictures[picture].uses.push(*of);
                }
            }
        }
        if !self.fits(cx, &pictures) {
            return Textures::nothing();
        }
        let made: Vec<Result<Vec<Arc<Pyramid>>, ImageError>> =
            parallel::collect(pictures.len(), |picture| pictures[picture].pyramids(self.cache));
        // Say what is wrong, file by file
        let mut textures = Textures::nothing();
        for ((file, index, uses), read) in files.iter().zip(&read) {
            let path = format!("texture.image.{}.file", self.desc.textures[*index].0);
            let hash = match read {
                Err(fault) => {
                    cx.outside(|cx| fault.report(cx, &path, file));
                    None
                }
                Ok(read) => match &made[picture_of[&read.hash]] {
                    Err(error) => {
                        cx.outside(|cx| report_damage(cx, &path, file, error, read.bytes.len()));
                        None
                    }
                    Ok(_) => Some(read.hash),
                },
            };
            if !uses.is_empty() {
                textures.file_hashes.push((file, hash.unwrap_or_default()));
                textures.placeholders.extend(hash.is_none().then(|| (*file).to_owned()));
            }
        }
        textures.file_hashes.sort_unstable();
        for (path, index) in &self.alphas {
            let desc = &self.desc.textures[*index].1;
            let TextureDesc::Image(image) = desc else {
                let hint = "use \"r\", \"g\", \"b\" or \"luminance\"";
                cx.outside(|cx| {
                    cx.error(path, format!("a texture of the kind {} has no alpha", desc.kind()), Some(hint))
                });
                continue;
            };
            let file = &image.file.0;
            if let Ok(read) = &read[file_of[file.as_str()]]
                && !read.header.has_alpha()
            {
                let message = format!("{file:?} has no alpha");
                let hint = "use \"r\", \"g\", \"b\" or \"luminance\", or a picture with alpha";
                cx.outside(|cx| cx.error(path, message, Some(hint)));
            }
        }
        textures.bytes = made.iter().flatten().flatten().map(|pyramid| pyramid.bytes()).sum();
        textures.sizes = self.sizes(&read, &file_of);
        // Put them together
        let silent = &mut CompileContext::default();
        let mut pattern = |desc: &TextureDesc, of: TextureUse| match desc {
            TextureDesc::Checkerboard(board) => TexturePattern::Checkerboard(for_mask(board, of).compile(silent)),
            TextureDesc::UvGrid(grid) => {
                let image = ImageTextureDesc::new(FilePath(String::new()));
                TexturePattern::Image(image.texture(Arc::new(Pyramid::new(&grid.picture(), of))))
            }
            TextureDesc::Image(image) => {
                let picture = read[file_of[image.file.0.as_str()]].as_ref().ok().map(|file| picture_of[&file.hash]);
                let pyramid = picture.and_then(|picture| {
                    let at = pictures[picture].uses.iter().position(|other| other.key() == of.key())?;
                    made[picture].as_ref().ok().map(|pyramids| pyramids[at].clone())
                });
                match pyramid {
                    Some(pyramid) => TexturePattern::Image(image.texture(pyramid)),
                    None => TexturePattern::Checkerboard(placeholder(of).compile(silent)),
                }
            }
        };
        textures.compiled.extend(self.wanted.iter().map(|(index, of)| {
            let desc = &self.desc.textures[*index].1;
            Texture { pattern: pattern(desc, *of), uv_set: named_set(desc) }
        }));
        textures
    }

    /// Whether all pyramids fit into the budget; before anything is decoded.
    fn fits(&self, cx: &mut CompileContext, pictures: &[SharedPicture]) -> bool {
        let bytes = |picture: &SharedPicture| -> u64 { picture.uses.iter().map(|of| picture.bytes_of(*of)).sum() };
        let total: u64 = pictures.iter().map(bytes).sum();
        if total > self.budget {
            let mib = |bytes: u64| bytes.div_ceil(1 << 20);
            let message = format!(
                "the pictures take {} MiB with their smaller copies, the limit is {} MiB",
                mib(total),
                self.budget >> 20
            );
            let hint = format!("make them smaller, or allow more: --texture-memory {}", mib(total));
            cx.outside(|cx| cx.error("texture", message, Some(&hint)));
        }
        total <= self.budget
    }

    fn sizes(
        &self,
        read: &[Result<PictureFile, TextureFault>],
        file_of: &HashMap<&str, usize>,
    ) -> Vec<(String, &'static str, Option<[u32; 2]>)> {
        let used = |index: usize| self.wanted.iter().any(|(of, _)| *of == index);
        let size = |index: usize, desc: &TextureDesc| match desc {
            TextureDesc::Checkerboard(board) => Some(board.counts),
            TextureDesc::UvGrid(grid) => Some(grid.counts),
            TextureDesc::Image(image) if used(index) => {
                let header = &read[file_of[image.file.0.as_str()]].as_ref().ok()?.header;
                Some([header.width, header.height])
            }
            TextureDesc::Image(_) => None,
        };
        let textures = self.desc.textures.iter().enumerate();
        textures.map(|(index, (name, desc))| (name.clone(), desc.kind(), size(index, desc))).collect()
    }
}

/// The largest number added to a texture.
const MAX_BIAS: f64 = 1e6;

fn read_file(assets: &dyn Assets, file: &str) -> Result<PictureFile, TextureFault> {
    let bytes = assets.read(file, MAX_TEXTURE_FILE).map_err(TextureFault::Read)?;
    let header = read_header(&bytes, &Limits::default()).map_err(|error| TextureFault::Decode(error, bytes.len()))?;
    let hash = *blake3::hash(&bytes).as_bytes();
    Ok(PictureFile { bytes, hash, header })
}

impl SharedPicture<'_> {
    /// Bytes that its pyramid for a use takes.
    fn bytes_of(&self, of: TextureUse) -> u64 {
        let PictureHeader { width, height, channels, sample } = self.file.header;
        Pyramid::bytes_of([width, height], channels, sample, of)
    }

    /// A pyramid for each use, those of before and new ones.
    fn pyramids(&self, cache: Option<&CompileCache>) -> Result<Vec<Arc<Pyramid>>, ImageError> {
        let key = |of: &TextureUse| key_of("pyramid", [&self.file.hash[..], &of.key()[..]]);
        let kept: Vec<Option<Arc<Pyramid>>> =
            self.uses.iter().map(|of| cache.and_then(|cache| cache.find(&key(of)))).collect();
        if !kept.is_empty() && kept.iter().all(Option::is_some) {
            return Ok(kept.into_iter().flatten().collect());
        }
        let texels = decode(&self.file.bytes, &Limits::default())?;
        let of_use = |(of, kept): (&TextureUse, Option<Arc<Pyramid>>)| {
            kept.unwrap_or_else(|| {
                let made = Arc::new(Pyramid::new(&texels, *of));
                if let Some(cache) = cache {
                    cache.keep(key(of), &made);
                }
                made
            })
        };
        Ok(self.uses.iter().zip(kept).map(of_use).collect())
    }
}

/// The set of texture coordinates that a texture names; one that is too large is a fault elsewhere.
fn named_set(desc: &TextureDesc) -> Option<u8> {
    desc.uv_set().filter(|set| *set < UV_SETS as u32).map(|set| set as u8)
}

const STANDS_IN: &str = "magenta and black stand in for it, unless compiled strictly";

/// Warns that a file is no picture.
fn report_damage(cx: &mut CompileContext, path: &str, file: &str, error: &ImageError, length: usize) {
    let message = match length {
        0 => format!("{file:?} is empty"),
        _ => format!("{file:?} cannot be read as a picture: {error}"),
    };
    cx.warning(path, message, Some(STANDS_IN));
}

impl TextureFault {
    fn report(&self, cx: &mut CompileContext, path: &str, file: &str) {
        match self {
            TextureFault::Decode(error, length) => report_damage(cx, path, file, error, *length),
            // Not a texture that happens to be missing, but one that may not be read
            TextureFault::Read(error @ AssetError::Outside) => {
                let hint = "copy it there, or allow its folder with --allow-dir";
                cx.error(path, format!("{file:?}: {error}"), Some(hint));
            }
            TextureFault::Read(error) => {
                let place = error.slashes(file);
                let place = place.as_deref().unwrap_or("it is looked for beside the text that names it");
                cx.warning(path, format!("{file:?}: {error}"), Some(&format!("{place}; {STANDS_IN}")));
            }
        }
    }
}

impl Textures<'_> {
    /// No textures.
    fn nothing() -> Self {
        Textures {
            compiled: Vec::new(),
            placeholders: Vec::new(),
            file_hashes: Vec::new(),
            sizes: Vec::new(),
            bytes: 0,
        }
    }
}

impl Params for TextureRequests<'_> {
    fn radiance(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb> {
        self.colored(cx, field, param, false)
    }

    fn color(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb> {
        advise_reflectance(cx, &factor_path(field, &param.texture), param.factor.linear);
        self.radiance(cx, field, param)
    }

    fn covered_color(&mut self, cx: &mut CompileContext, field: &str, param: &ColorParam) -> Param<Rgb> {
        advise_reflectance(cx, &factor_path(field, &param.texture), param.factor.linear);
        self.colored(cx, field, param, true)
    }

    fn number(&mut self, cx: &mut CompileContext, field: &str, param: &NumberParam, range: [f64; 2]) -> Param<f32> {
        let (constant, index) = self.factor(cx, field, param, range);
        let texture = index.map(|index| self.request(index, TextureUse::Color(self.space(index, TextureSpace::Raw))));
        Param { texture, ..constant }
    }

    fn mask(&mut self, cx: &mut CompileContext, field: &str, param: &NumberParam, cutoff: f64) -> Param<f32> {
        let (constant, index) = self.factor(cx, field, param, [0.0, 1.0]);
        let cutoff = cutoff as f32;
        let solid = |value: f32| Param::constant(if value >= cutoff { 1.0 } else { 0.0 });
        let Some(index) = index else { return solid(constant.factor) };
        // number x factor + bias >= cutoff
        if constant.factor == 0.0 {
            return solid(constant.bias);
        }
        let cutoff = (cutoff - constant.bias) / constant.factor;
        let rule = MaskRule { channel: param.channel, space: self.space(index, TextureSpace::Raw), cutoff };
        Param { texture: Some(self.request(index, TextureUse::Mask(rule))), ..Param::constant(1.0) }
    }

    fn unmasked(&mut self, param: &NumberParam) -> Option<Param<f32>> {
        let (desc, scratch) = (self.desc, &mut CompileContext::default());
        let grouped = desc.groups.iter().flat_map(|(_, group)| &group.shapes);
        let may_have_alphas = |shape: &ShapeDesc| match shape {
            ShapeDesc::Mesh(mesh) => {
                !mesh.alphas.is_empty() || mesh.file.as_ref().is_some_and(|file| is_ply(file) || is_contained(file))
            }
            _ => false,
        };
        let is_needed = desc.shapes.iter().chain(grouped).any(may_have_alphas);
        is_needed.then(|| self.number(scratch, "alpha", param, [0.0, 1.0]))
    }

    fn normals(&mut self, cx: &mut CompileContext, field: &str, texture: &str) -> Option<TextureId> {
        let index = self.find(cx, field, texture)?;
        let kind = self.desc.textures[index].1.kind();
        if !matches!(self.desc.textures[index].1, TextureDesc::Image(_)) {
            let message = format!("a texture of the kind {kind} is no normal map");
            cx.error(field, message, Some("name a texture of the kind image"));
            return None;
        }
        Some(self.request(index, TextureUse::Normal))
    }
}

/// Whether a file is named as PLY files are, whose vertices may have an alpha.
fn is_ply(file: &FilePath) -> bool {
    file.0.as_bytes().last_chunk().is_some_and(|end: &[u8; 4]| end.eq_ignore_ascii_case(b".ply"))
}

/// Whether a file is a part of another one, whose vertices may have an alpha.
fn is_contained(file: &FilePath) -> bool {
    file.0.contains('#')
}

/// Where the number of a parameter stands: a constant is the field itself.
fn factor_path(field: &str, texture: &Option<String>) -> String {
    if texture.is_some() { format!("{field}.factor") } else { field.to_owned() }
}

/// What stands in for a picture that cannot be had: magenta and black squares, not to be overlooked; no bumps, no
/// holes.
fn placeholder(of: TextureUse) -> CheckerboardDesc {
    let colors = match of {
        TextureUse::Color(_) | TextureUse::CoveredColor(_) => [ColorDesc::linear(1.0, 0.0, 1.0), ColorDesc::BLACK],
        TextureUse::Normal => [ColorDesc::linear(0.0, 0.0, 1.0); 2],
        TextureUse::Mask(_) => [ColorDesc::WHITE; 2],
    };
    CheckerboardDesc { counts: [8, 8], colors, uv_set: None }
}

/// A board whose colours are numbers, as the mask that they make.
fn for_mask(board: &CheckerboardDesc, of: TextureUse) -> CheckerboardDesc {
    let TextureUse::Mask(rule) = of else { return board.clone() };
    let colors = board.colors.map(|color| {
        let Rgb { r, g, b } = color.into();
        ColorDesc::gray(if rule.number([r, g, b, 1.0]) >= rule.cutoff { 1.0 } else { 0.0 })
    });
    CheckerboardDesc { colors, ..board.clone() }
}

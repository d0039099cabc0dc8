//! What textures take in memory, what of them is shared, and pictures whose numbers are light.

use std::path::Path;
use std::sync::Arc;

use super::{CompileOptions, Scene, SceneDesc};
use crate::color::{Display, Encoding};
use crate::context::MemoryAssets;
use crate::error::SceneError;
use crate::image::{Format, Image, Receipt, Window};
use crate::math::Vec2;
use crate::shape::CompileCache;
use crate::texture::{Pyramid, Texture, TexturePattern};

fn compile(text: &str, assets: &MemoryAssets, options: &CompileOptions) -> Result<Scene, SceneError> {
    let text = format!("[camera]\nposition = [0, 0, 9]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n{text}");
    let parsed = SceneDesc::parse("s.toml", text.as_bytes(), assets);
    parsed.compile(assets, options).map(|compiled| compiled.scene)
}

fn scene(text: &str, assets: &MemoryAssets, cache: Option<&CompileCache>) -> Scene {
    let options = CompileOptions { strict: true, cache: cache.cloned(), ..CompileOptions::default() };
    compile(text, assets, &options).unwrap_or_else(|fault| panic!("{fault}"))
}

/// A picture with such linear red, green and blue in column i and row j.
fn picture(format: Format, [width, height]: [u32; 2], at: impl Fn(u32, u32) -> [f32; 3]) -> Vec<u8> {
    let pixels = (0..width * height).map(|k| {
        let [r, g, b] = at(k % width, k / width);
        [r, g, b, 1.0]
    });
    let window = Window { x: 0, y: 0, width, height };
    let image = Image { film: [width, height], window, pixels: pixels.collect() };
    let display = Display { encoding: Encoding::Linear, ..Display::default() };
    image.encode(format, &display, &Receipt::default()).unwrap()
}

fn assets<const N: usize>(files: [(&str, Vec<u8>); N]) -> MemoryAssets {
    MemoryAssets { files: files.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect() }
}

/// The texels of a texture, if it is a picture.
fn pyramid(texture: &Texture) -> &Arc<Pyramid> {
    let TexturePattern::Image(image) = &texture.pattern else { panic!("is a picture") };
    image.pyramid()
}

/// A picture in all uses that there are.
const USES: &str = "[texture.image.a]\nfile = \"a.png\"\n[texture.image.b]\nfile = \"b.png\"\nuv_set = 0\n\
    [material.metallic-roughness.m]\nbase_color = { texture = \"a\" }\nroughness = { texture = \"a\" }\n\
    emissive = { texture = \"b\" }\nnormal_map = \"a\"\n\
    [material.phong.thin]\nalpha = { texture = \"a\" }\nalpha_mode = \"mask\"\ndiffuse = { texture = \"b\" }\n";

#[test]
fn the_budget_is_what_the_textures_take() {
    let ramp = |i: u32, j: u32| [i as f32 / 600.0, j as f32 / 500.0, 0.5];
    let other = |i: u32, j: u32| ramp(j, i);
    let files = assets([
        ("a.png", picture(Format::Png8, [600, 500], ramp)),
        ("b.png", picture(Format::Png16, [500, 600], other)),
    ]);
    let with = |bytes: Option<u64>| {
        compile(USES, &files, &CompileOptions { texture_memory: bytes, ..CompileOptions::default() })
    };
    let bytes = with(None).unwrap().summary().texture_bytes;
    // Colour, number, normals and mask of one, colour of the other, a third more with their smaller copies
    let texels = 600 * 500;
    assert!(bytes > texels * (3 + 3 + 3 + 2 + 6) * 4 / 3 && bytes < texels * (3 + 3 + 6 + 3 + 6) * 4 / 3, "{bytes}");
    assert_eq!(with(Some(bytes)).unwrap().summary().texture_bytes, bytes);
    let fault = with(Some(bytes - 1)).unwrap_err().to_string();
    let (wanted, limit) = (bytes.div_ceil(1 << 20), (bytes - 1) >> 20);
    let message = format!("the pictures take {wanted} MiB with their smaller copies, the limit is {limit} MiB");
    assert!(fault.contains(&message), "{fault}");
    assert!(fault.contains(&format!("--texture-memory {wanted}")), "{fault}");
    assert!(with(Some(wanted << 20)).is_ok());
    assert!(with(Some(0)).is_err());
}

#[test]
fn equal_contents_are_one_picture() {
    let (one, other) = (|i: u32, j: u32| [i as f32 / 40.0, j as f32 / 30.0, 0.3], |_: u32, _: u32| [0.5; 3]);
    let [one, other] = [picture(Format::Png8, [40, 30], one), picture(Format::Png8, [40, 30], other)];
    let same = assets([("a.png", one.clone()), ("b.png", one.clone())]);
    let text = "[texture.image.a]\nfile = \"a.png\"\n[texture.image.b]\nfile = \"b.png\"\nuv_set = 0\n\
        [texture.image.again]\nfile = \"a.png\"\nscale = [2, 2]\n\
        [material.phong.m]\ndiffuse = { texture = \"a\" }\nspecular = { texture = \"b\" }\n\
        emissive = { texture = \"again\" }\n";
    let alone = "[texture.image.a]\nfile = \"a.png\"\n[material.phong.m]\ndiffuse = { texture = \"a\" }\n";
    let cache = CompileCache::default();
    let first = scene(text, &same, Some(&cache));
    assert_eq!(first.textures.len(), 3);
    let shared = |a: &Texture, b: &Texture| Arc::ptr_eq(pyramid(a), pyramid(b));
    assert!(first.textures[1..].iter().all(|texture| shared(texture, &first.textures[0])));
    let bytes = |scene: &Scene| scene.summary().texture_bytes;
    assert_eq!(bytes(&first), bytes(&scene(alone, &same, None)));
    // A picture for another use, and another picture, are others
    let different = assets([("a.png", one), ("b.png", other)]);
    let second = scene(text, &different, None);
    assert_eq!(bytes(&second), 2 * bytes(&first));
    assert!(!shared(&second.textures[0], &second.textures[1]) && shared(&second.textures[0], &second.textures[2]));
    let number = format!("{alone}shininess = {{ texture = \"a\" }}\n");
    assert_eq!(bytes(&scene(&number, &same, None)), 2 * bytes(&first));
    // From one compilation to the next, if they share a cache
    let again = scene(alone, &same, Some(&cache));
    assert!(shared(&first.textures[0], &again.textures[0]));
    assert!(!shared(&first.textures[0], &scene(alone, &same, None).textures[0]));
    let stale = scene(&alone.replace("a.png", "b.png"), &different, Some(&cache));
    assert!(!shared(&first.textures[0], &stale.textures[0]));
}

/// The value of a texture at the middle of a texel, column i and row j from the top.
#[cfg(feature = "exr")]
fn texel(texture: &Texture, [width, height]: [u32; 2], i: u32, j: u32) -> [f32; 4] {
    texture.at(Vec2::new((i as f32 + 0.5) / width as f32, 1.0 - (j as f32 + 0.5) / height as f32))
}

const LIGHT: &str = "[texture.image.light]\nfile = \"light.exr\"\nfilter = \"nearest\"\n[material.unlit.m]\n\
    color = { texture = \"light\" }\nalpha = { texture = \"light\" }\nalpha_mode = \"blend\"\n";

#[cfg(feature = "exr")]
#[test]
fn the_numbers_of_an_exr_are_linear_and_not_bounded() {
    let size = [16, 8];
    let at = |i: u32, j: u32| [i as f32 * 4.0 - 1.5, j as f32 * 0.01, if i == 3 { f32::NAN } else { 1e9 }];
    let files = assets([("light.exr", picture(Format::Exr, size, at))]);
    let scene = scene(LIGHT, &files, None);
    assert_eq!(scene.textures.len(), 2);
    for (i, j) in [(0, 0), (1, 3), (3, 5), (15, 7)] {
        let [r, g, b] = at(i, j);
        // Nothing is decoded, whatever the use; what is no light is 0
        let expected = [r.max(0.0), g, if b.is_nan() { 0.0 } else { 65504.0 }, 1.0];
        for texture in &scene.textures {
            assert_eq!(texel(texture, size, i, j), expected, "{i} {j}");
        }
    }
}

#[cfg(feature = "exr")]
#[test]
fn dwab_pictures_are_read() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/images/ramps-dwab.exr");
    let files = assets([("light.exr", std::fs::read(file).unwrap())]);
    let scene = scene(
        &LIGHT.replace("alpha = { texture = \"light\"", "alpha = { texture = \"light\", channel = \"a\""),
        &files,
        None,
    );
    let size = [32, 16];
    for k in 0..size[0] * size[1] {
        let (i, j) = (k % size[0], k / size[0]);
        let [r, g, b, a] = texel(&scene.textures[0], size, i, j);
        let expected = [i as f32 / 4.0, j as f32 / 16.0, 3.0 * (i + j) as f32 / 94.0];
        // The writer lost 0.04 of red, the largest
        for (found, expected) in [r, g, b].into_iter().zip(expected) {
            assert!((found - expected).abs() < 0.05, "{i} {j}: {found}, not {expected}");
        }
        assert_eq!(a, if i < 16 { 1.0 } else { 0.25 });
    }
}

//! Picture files from anywhere: what reading them promises.

use firstlight::{CompileOptions, MemoryAssets, SceneDesc, StoredImage};

/// A scene whose texture is the picture.
const SCENE: &str = "\
[texture.image.picture]
file = \"picture\"
filter = \"nearest\"
[material.phong.shown]
diffuse = { texture = \"picture\" }
[[sphere]]
center = [0, 0, -5]
radius = 1
material = \"shown\"
";

/// Reads a picture as a texture and as one of our own. Panics where a promise is broken.
pub fn check(bytes: &[u8]) {
    let mut assets = MemoryAssets::default();
    assets.files.insert("picture".into(), bytes.to_vec());
    let parsed = SceneDesc::parse("scene.toml", SCENE.as_bytes(), &assets);
    assert!(parsed.faults().is_empty(), "{:?}", parsed.faults());
    // Damaged, it is a warning that names it; only a strict scene is refused
    match parsed.compile(&assets, &CompileOptions::default()) {
        Ok(compiled) => {
            for warning in &compiled.warnings {
                assert!(warning.to_string().contains("\"picture\""), "{warning}");
            }
        }
        Err(error) => panic!("{:?}", error.faults),
    }
    if let Ok(stored) = StoredImage::read(bytes) {
        assert_eq!(stored.pixels.len() as u64, u64::from(stored.window.width) * u64::from(stored.window.height));
    }
    assert!(!firstlight::is_decoding());
}

/// Keeps panics inside decoders, which the library catches, from ending a fuzzer; unless `FUZZ_DECODERS` is set.
pub fn pass_over_decoders() {
    if std::env::var_os("FUZZ_DECODERS").is_none() {
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !firstlight::is_decoding() {
                hook(panic);
            }
        }));
    }
}

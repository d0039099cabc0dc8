//! Scene text from anywhere: what reading, compiling and writing it promise.

use firstlight::{CompileOptions, NoAssets, SceneDesc};

/// Reads, compiles and writes a text; its first byte chooses the language. Panics where a promise is broken.
pub fn check(data: &[u8]) {
    let Some((language, text)) = data.split_first() else { return };
    let name = match language {
        b'j' => "scene.json",
        b'c' => "scene.txt",
        _ => "scene.toml",
    };
    let parsed = SceneDesc::parse(name, text, &NoAssets);
    for fault in parsed.faults() {
        assert!(!fault.to_string().is_empty());
    }
    // Large pictures and many samples cost nothing until they are rendered
    if let Err(error) = parsed.compile(&NoAssets, &CompileOptions::default()) {
        assert!(!error.faults.is_empty());
    }
    if !parsed.faults().is_empty() {
        return;
    }
    let toml = parsed.desc.to_toml();
    let again = SceneDesc::parse("scene.toml", toml.as_bytes(), &NoAssets);
    assert!(again.faults().is_empty(), "{toml}\n{:?}", again.faults());
    // NaN differs from itself; its text does not
    assert_eq!(again.desc.to_toml(), toml);
    assert!(again.desc == parsed.desc || toml.contains("nan"), "{toml}");
}

//! `cargo xtask pictures`: the pictures of the book.

use std::ops::ControlFlow;
use std::path::Path;

use firstlight::{
    Assets, CompileOptions, FolderAssets, Format, NoAssets, RenderSettings, SceneDesc, builtin_scenes, render,
};

use crate::{Outcome, root, write};

pub fn run(filter: Option<&str>) -> Outcome {
    let wanted = |name: &str| filter.is_none_or(|part| name.contains(part));
    for builtin in builtin_scenes().iter().filter(|b| wanted(b.name)) {
        // Wide enough to look at, small enough for a repository; config 11 is the one that people look into
        let size = if builtin.name == "config11" { 1024 } else { 256 };
        picture(builtin.name, builtin.text.as_bytes(), &NoAssets, Some(size))?;
    }
    let gallery = root().join("scenes/gallery");
    let assets = FolderAssets::new(&gallery, &[]).map_err(|(path, e)| format!("{}: {e}", path.display()))?;
    let mut files: Vec<_> = std::fs::read_dir(&gallery)
        .map_err(|e| format!("scenes/gallery: {e}"))?
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    for file in files {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if wanted(&name) {
            let text = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            picture(&name, &text, &assets, None)?;
        }
    }
    Ok(())
}

/// Renders one scene into `docs/src/pictures/NAME.png`.
fn picture(name: &str, text: &[u8], assets: &dyn Assets, size: Option<u32>) -> Outcome {
    let mut parsed = SceneDesc::parse(&format!("{name}.toml"), text, assets);
    if let Some(size) = size {
        (parsed.desc.render.width, parsed.desc.render.height) = (size, size);
    }
    let compiled = parsed
        .compile(assets, &CompileOptions { strict: true, ..CompileOptions::default() })
        .map_err(|e| e.to_string())?;
    let (scene, settings) = (&compiled.scene, RenderSettings::default());
    let ControlFlow::Continue((film, _)) = render(scene, &settings, &|_, _| ControlFlow::Continue(())) else {
        return Err("stopped".into());
    };
    let bytes = film
        .develop()
        .encode(Format::Png8, &scene.display(), &scene.receipt(&settings))
        .map_err(|e| format!("{name}: {e}"))?;
    let path = Path::new("docs/src/pictures").join(format!("{name}.png"));
    write(&root().join(&path), &bytes)?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

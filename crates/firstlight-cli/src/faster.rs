//! What would make a render faster: advice for those that take long.

use std::num::NonZeroUsize;

use firstlight::{AaMode, RenderDesc, RenderSettings, SamplesDesc, Scene, VisibilityMode};

/// Points of a light that are enough for a first look.
const FEW_SAMPLES: u32 = 64;
/// In display steps: what does for a preview.
const PREVIEW: f64 = 4.0;
/// n of the n x n camera rays that are.
const FEW_RAYS: u32 = 2;
/// A side of a picture that is small.
const SMALL: u32 = 256;

/// Options that would make rendering `scene` with `settings` faster, those that change the least first.
pub fn faster(scene: &Scene, settings: &RenderSettings, render: &RenderDesc) -> String {
    let mut ways = Vec::new();
    let available = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    if settings.threads.is_some_and(|threads| threads.get() < available) {
        ways.push(format!("--threads {available}"));
    }
    // The same bytes, by what leaves out what is proved not to matter
    let is_traced = settings.visibility == VisibilityMode::Traced;
    if settings.reference || is_traced {
        let option = if settings.reference { "--reference" } else { "--visibility traced" };
        ways.push(format!("--aa-mode full with --samples instead of {option}, which gives the same bytes"));
    } else if settings.aa_mode == AaMode::Full {
        ways.push("--aa-mode adaptive".to_owned());
    }
    let most = scene.summary().lights.iter().map(|(.., samples)| match samples {
        SamplesDesc::Exact => u32::MAX,
        SamplesDesc::Count(count) => *count,
    });
    let most = most.max();
    // What is judged: light that is integrated, and what is lit once for several rays
    let is_judged = most == Some(u32::MAX) || most.is_some() && settings.aa_mode == AaMode::Adaptive;
    if is_judged && !settings.reference && !is_traced && render.tolerance < PREVIEW {
        ways.push(format!("--tolerance {PREVIEW}"));
    }
    if most.is_some_and(|most| most > FEW_SAMPLES) {
        ways.push(format!("--samples {FEW_SAMPLES}"));
    }
    if render.antialiasing > FEW_RAYS {
        ways.push(format!("--aa {FEW_RAYS}"));
    }
    if render.width > SMALL {
        ways.push(format!("--width {}", (render.width / 2).max(SMALL)));
    }
    ways.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight::{CompileOptions, NoAssets, SceneDesc};

    #[test]
    fn what_makes_it_faster_is_what_is_slow() {
        let text = "[render]\nwidth = 400\nheight = 300\n[camera]\nposition = [0, 0, 5]\n[[light.rectangle]]\n\
                    center = [0, 3, 0]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\n";
        let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
        let scene = parsed.compile(&NoAssets, &CompileOptions::default()).unwrap().scene;
        let mut settings = RenderSettings::default();
        let say = |settings: &RenderSettings| faster(&scene, settings, &parsed.desc.render);
        assert_eq!(say(&settings), "--tolerance 4, --samples 64, --aa 2, --width 256");
        settings.aa_mode = AaMode::Full;
        assert_eq!(say(&settings), "--aa-mode adaptive, --tolerance 4, --samples 64, --aa 2, --width 256");
        settings.reference = true;
        assert!(say(&settings).starts_with("--aa-mode full with --samples instead of --reference"));
        // A small picture with few rays, lit by nothing: there is no way
        let parsed = SceneDesc::parse(
            "s.toml",
            b"render.width = 8\nrender.antialiasing = 1\ncamera.position = [0, 0, 5]",
            &NoAssets,
        );
        let scene = parsed.compile(&NoAssets, &CompileOptions::default()).unwrap().scene;
        assert_eq!(faster(&scene, &RenderSettings::default(), &parsed.desc.render), "");
    }
}

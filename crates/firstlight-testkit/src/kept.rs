//! Converged pictures kept as files: PNG, 16 bits a channel, as displayed; a pixel that is open is transparent, another
//! nearly opaque, the less so the more points it took.

use std::path::Path;

use firstlight::SceneDesc;

use crate::converged::Converged;

/// One step of an 8-bit picture, in a channel of 16 bits.
const STEP: f64 = 257.0;
/// What a settled pixel's alpha is less than full for each doubling of its points.
const LEVEL: u16 = 256;
/// The names under which a file says what scene it shows, what its largest sets are, and how far off it may be itself.
const SCENE: &str = "firstlight:scene";
const CAP: &str = "firstlight:cap";
const DOUBT: &str = "firstlight:doubt";

/// Which scene it is: the same text has the same name, with any tolerance of 1 or more.
fn name(desc: &SceneDesc) -> String {
    let mut desc = desc.clone();
    desc.render.tolerance = desc.render.tolerance.min(1.0);
    blake3::hash(desc.to_toml().as_bytes()).to_hex()[..32].to_owned()
}

/// Writes a converged picture whose sets had up to 2^`cap` points.
#[track_caller]
pub fn write(path: &Path, desc: &SceneDesc, cap: u32, truth: &Converged) {
    let mut samples = Vec::with_capacity(truth.pixels.len() * 8);
    for (i, pixel) in truth.pixels.iter().enumerate() {
        let alpha = if truth.open[i] { 0 } else { u16::MAX - LEVEL * truth.levels[i] as u16 };
        for sample in pixel.map(|steps| (steps * STEP).round() as u16).into_iter().chain([alpha]) {
            samples.extend(sample.to_be_bytes());
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, truth.width, truth.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Sixteen);
    let texts = [(SCENE, name(desc)), (CAP, cap.to_string()), (DOUBT, truth.own_error().to_string())];
    for (key, text) in texts {
        encoder.add_text_chunk(key.into(), text).expect("the text is ASCII");
    }
    let mut writer = encoder.write_header().expect("the picture has pixels");
    writer.write_image_data(&samples).expect("there are as many samples as pixels ask for");
    writer.finish().expect("memory holds it");
    // Never half a file: others may read it meanwhile
    let part = path.with_extension("part");
    std::fs::write(&part, bytes).unwrap_or_else(|fault| panic!("{}: {fault}", part.display()));
    std::fs::rename(&part, path).unwrap_or_else(|fault| panic!("{}: {fault}", path.display()));
}

/// Reads it again, with the logarithm to base 2 of the points that its largest sets may have had. `None` if the file is
/// not there or shows another scene.
#[track_caller]
pub fn read(path: &Path, desc: &SceneDesc) -> Option<(Converged, u32)> {
    let file = std::fs::File::open(path).ok()?;
    let fault = |what: &dyn std::fmt::Display| -> ! { panic!("{}: {what}", path.display()) };
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap_or_else(|e| fault(&e));
    let mut samples = vec![0; reader.output_buffer_size().unwrap_or_else(|| fault(&"too large"))];
    reader.next_frame(&mut samples).unwrap_or_else(|e| fault(&e));
    let text = |key: &str| {
        let texts = &reader.info().uncompressed_latin1_text;
        texts.iter().find(|chunk| chunk.keyword == key).map(|chunk| chunk.text.as_str())
    };
    let mut truth = Converged::unknown(desc);
    if text(SCENE)? != name(desc) || samples.len() != truth.pixels.len() * 8 {
        return None;
    }
    let doubt: f64 = text(DOUBT)?.parse().ok()?;
    for (i, pixel) in samples.chunks_exact(8).enumerate() {
        let [r, g, b, alpha] = std::array::from_fn(|k| u16::from_be_bytes([pixel[2 * k], pixel[2 * k + 1]]));
        truth.pixels[i] = [r, g, b].map(|sample| f64::from(sample) / STEP);
        truth.half_differences[i] = [doubt; 3];
        truth.open[i] = alpha == 0;
        truth.levels[i] = u32::from((u16::MAX - alpha) / LEVEL);
    }
    Some((truth, text(CAP)?.parse().ok()?))
}

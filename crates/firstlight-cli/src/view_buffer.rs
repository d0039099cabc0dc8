//! `firstlight view-buffer`: a buffer of a file as a picture to look at.

use std::path::PathBuf;

use firstlight::{BufferView, Display, Format, PlaneVec, StoredPlane, StoredPlanes, nearest_name};

use crate::args::ViewBufferArgs;
use crate::difference;
use crate::interrupt::Watch;
use crate::output::{Content, Output, Target};
use crate::report::{Failure, shown};

/// Writes the picture.
///
/// # Errors
/// The file cannot be read or has no such buffer; the picture cannot be written.
pub fn run(args: &ViewBufferArgs) -> Result<(), Failure> {
    let target = target(args)?;
    let file = difference::read(&args.file)?;
    let plane = find(args, &file)?;
    let mut numbers = plane.meant(&args.name, &file.receipt);
    // The colours of a PNG file are encoded already
    if let (Some(_), true, PlaneVec::Floats(colors)) = (plane.steps, plane.is_color(), &mut numbers) {
        let encoding = file.display().encoding;
        colors.iter_mut().for_each(|color| *color = encoding.decode(f64::from(*color)) as f32);
    }
    let view = BufferView {
        name: &args.name,
        channels: &plane.channels,
        numbers: numbers.numbers(),
        size: [file.window.width, file.window.height],
        range: args.range,
        display: Display { exposure: args.exposure.unwrap_or(0.0), ..Display::default() },
    };
    let bytes = view.encode(&file.receipt).map_err(|e| Failure::Work(format!("{}: {e}", shown(&args.file))))?;
    let watch = Watch::begin();
    target.ready()?.stage(&bytes)?.commit(args.quiet, &|| watch.check().is_err())
}

/// The buffer of that name; of an array by itself the one there is, whose name the file does not say.
fn find<'a>(args: &ViewBufferArgs, file: &'a StoredPlanes) -> Result<&'a StoredPlane, Failure> {
    if let (Format::Npy, [plane]) = (file.format, &file.planes[..]) {
        return Ok(plane);
    }
    file.plane(&args.name).ok_or_else(|| {
        let names: Vec<&str> = file.planes.iter().map(|plane| plane.name.as_str()).collect();
        let hint = nearest_name(&args.name, &names).map(|near| format!("; did you mean {near:?}?"));
        Failure::Work(format!(
            "{} has no buffer {:?}{} it has {}",
            shown(&args.file),
            args.name,
            hint.as_deref().unwrap_or(";"),
            names.join(", ")
        ))
    })
}

/// Where the picture goes.
fn target(args: &ViewBufferArgs) -> Result<Target, Failure> {
    let Some(path) = &args.output else {
        // The names of lights may hold what stands in no file's name
        let stem = args.file.file_stem().unwrap_or_default().to_string_lossy();
        let is_plain = |c: char| c.is_alphanumeric() || "-_.#".contains(c);
        let name: String = args.name.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
        let target = Target::File(PathBuf::from(format!("{stem}.{name}.png")));
        let output = Output { target, format: Format::Png8, content: Content::Scene };
        if !output.is_free() {
            let name = output.target.name();
            let message = format!("{name} is there and is no picture of firstlight; name another file with -o");
            return Err(Failure::Work(message));
        }
        return Ok(output.target);
    };
    let target = Target::of(path);
    if target != Target::Stdout && !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
        let name = shown(path);
        return Err(Failure::Usage(format!("-o {name}: the file's name must end in .png; - is standard output")));
    }
    if target.real() == Target::of(&args.file).real() {
        return Err(Failure::Usage(format!("-o {} would replace the file itself; name another", shown(path))));
    }
    Ok(target)
}

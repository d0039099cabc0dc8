//! `firstlight relight`: a picture with other lights, without a render.

use firstlight::{FileSettings, Format, LightChange, NamedPlane, Plane, PlaneNumbers, Relit, encode_planes, relight};

use crate::args::RelightArgs;
use crate::difference;
use crate::interrupt::Watch;
use crate::output::{Target, commit, with_bits};
use crate::report::{Failure, say, shown};

/// Lights the picture of a file again and writes it.
///
/// # Errors
/// The file cannot be read, lacks what that takes, or has no such light; an output cannot be written.
pub fn run(args: &RelightArgs) -> Result<(), Failure> {
    let outputs = outputs(args)?;
    let ready = outputs.iter().map(|(target, _)| target.ready()).collect::<Result<Vec<_>, _>>()?;
    let stored = difference::read(&args.file)?;
    let work = |why: String| Failure::Work(format!("{}: {why}", shown(&args.file)));
    let Relit { image, display, receipt, keeps_shadows } =
        relight(&stored, &args.light).map_err(|e| work(e.to_string()))?;
    if FileSettings::of(&stored.receipt).half && !args.quiet {
        let name = shown(&args.file);
        say(format_args!("note: {name} holds its lights in 16-bit floats; the picture is as exact as those"));
    }
    if keeps_shadows && !args.light.is_empty() && !args.quiet {
        let name = shown(&args.file);
        say(format_args!("note: the shadows on shadow catchers are those of {name}: render it again to change them"));
    }
    let display = args.display.of(&display);
    let watch = Watch::begin();
    let default = FileSettings::default();
    let files = FileSettings { display, jpeg_quality: args.quality.unwrap_or(default.jpeg_quality), ..default };
    let planes = [NamedPlane::new(Plane::Color, PlaneNumbers::Floats(image.pixels.as_flattened()))];
    let encode =
        |(_, format): &(Target, Format)| encode_planes(image.film, image.window, &planes, *format, &files, &receipt);
    let encoded =
        outputs.iter().map(encode).collect::<Result<Vec<_>, _>>().map_err(|e| Failure::Work(e.to_string()))?;
    let staged = ready.into_iter().zip(&encoded).map(|(ready, bytes)| ready.stage(bytes));
    commit(staged.collect::<Result<Vec<_>, _>>()?, args.quiet, &|| watch.check().is_err())
}

/// The pictures to write, none of which replaces the file that is read.
fn outputs(args: &RelightArgs) -> Result<Vec<(Target, Format)>, Failure> {
    let mut outputs: Vec<(Target, Format)> = Vec::new();
    for path in &args.output {
        let (target, name) = (Target::of(path), shown(path));
        if target == Target::Stdout {
            return Err(Failure::Usage("-o -: relight writes files; name one".into()));
        }
        let format = Format::from_path(path).map_err(|e| Failure::Usage(e.to_string()))?;
        if target.real() == Target::of(&args.file).real() {
            return Err(Failure::Usage(format!("-o {name} would replace the file that is lit again; name another")));
        }
        if outputs.iter().any(|(other, _)| other.real() == target.real()) {
            return Err(Failure::Usage(format!("-o {name} is named twice")));
        }
        outputs.push((target, with_bits(format, args.bits)));
    }
    let any = |is: &dyn Fn(Format) -> bool| outputs.iter().any(|(_, format)| is(*format));
    for (option, is_given, kinds, is_used) in [
        ("--bits", args.bits.is_some(), "PNG", any(&|format| matches!(format, Format::Png8 | Format::Png16))),
        ("--display", args.display.display.is_some(), "PNG and JPEG", any(&Format::is_display_encoded)),
        ("--exposure", args.display.exposure.is_some(), "PNG and JPEG", any(&Format::is_display_encoded)),
        ("--quality", args.quality.is_some(), "JPEG", any(&|format| format == Format::Jpeg)),
    ] {
        if is_given && !is_used {
            return Err(Failure::Usage(format!("{option} is for {kinds} only, and no output is one")));
        }
    }
    Ok(outputs)
}

/// Reads `NAME=x1.5`, `NAME=1.5` or `NAME=#ffd0a0`: the name may hold `=`, what follows the last one is the change.
pub fn change(text: &str) -> Result<(String, LightChange), String> {
    let wanted = "NAME=x1.5 multiplies the strength of the light NAME, or of #3, the third; NAME=1.5 sets it; \
                  NAME=#ffd0a0, NAME=orange or NAME=R,G,B sets its colour";
    let (name, value) = text.rsplit_once('=').filter(|(name, _)| !name.is_empty()).ok_or(wanted)?;
    let number = |text: &str| text.parse::<f64>().ok().filter(|number| (0.0..=1e15).contains(number));
    let change = match value.strip_prefix('x') {
        Some(factor) => number(factor).map(LightChange::Times),
        None => {
            let color = || crate::args::color(value).ok().map(LightChange::Color);
            number(value).map(LightChange::Strength).or_else(color)
        }
    };
    Ok((name.to_owned(), change.ok_or(wanted)?))
}

#[cfg(test)]
mod tests {
    use firstlight::ColorDesc;

    use super::*;

    #[test]
    fn changes_are_read() {
        let white = LightChange::Color(ColorDesc::WHITE);
        for (text, name, expected) in [
            ("key=x1.5", "key", LightChange::Times(1.5)),
            ("key=0", "key", LightChange::Strength(0.0)),
            ("a=b=#ffffff", "a=b", white.clone()),
            ("#3=1,1,1", "#3", white.clone()),
            ("#3=White", "#3", white),
        ] {
            assert_eq!(change(text), Ok((name.to_owned(), expected)), "{text}");
        }
        for text in ["key", "=x2", "key=", "key=x", "key=-1", "key=x-1", "key=#ff", "key=nan", "key=xinf"] {
            assert!(change(text).unwrap_err().contains("sets its colour"), "{text}");
        }
    }
}

//! `firstlight diff`: how two pictures differ.

use firstlight::{
    Display, Flip, Format, PlaneDifference, Receipt, StoredPlane, StoredPlanes, false_colors, relative_differences,
};
use serde_json::json;

use crate::args::DiffArgs;
use crate::difference::{self, Found};
use crate::interrupt::Watch;
use crate::output::Target;
use crate::report::{Failure, answer, shown};

/// Two pictures, made comparable.
struct Pair {
    names: [String; 2],
    files: [StoredPlanes; 2],
    /// How each is displayed.
    displays: [Display; 2],
}

/// Says how they differ, buffer by buffer.
///
/// # Errors
/// They differ, by more than was allowed; they cannot be compared; the picture of their difference cannot be written.
pub fn run(args: &DiffArgs) -> Result<(), Failure> {
    let pair = Pair::read(args)?;
    let (common, alone) = pair.buffers(args)?;
    if let Some(path) = &args.output {
        check_output(path, args)?;
    }
    let watch = Watch::begin();
    let mut found = Vec::new();
    for name in &common {
        found.push(pair.compare(name, args.ppd)?);
        watch.check()?;
    }
    let is_color = found.iter().any(|found: &Found| found.flip.is_some());
    if args.flip.is_some() && !is_color {
        return Err(Failure::Usage(format!("--flip is for colours, and of those {} has none", common.join(", "))));
    }
    let is_same = alone.iter().all(Vec::is_empty) && found.iter().all(|found| is_within(found, args));
    if let Some(path) = &args.output {
        pair.draw(&found, args.ppd)?.write(path, args.quiet, &watch)?;
    }
    drop(watch);
    if args.json {
        let buffers: Vec<_> = found.iter().map(Found::json).collect();
        let [a, b] = &pair.names;
        let value = json!({
            "a": a, "b": b, "same": is_same, "buffers": buffers, "only_in_a": alone[0], "only_in_b": alone[1],
            "pixels_per_degree": args.ppd,
        });
        answer(&format!("{value:#}\n"))?;
    } else if !args.quiet {
        let mut text: String = found.iter().map(|found| found.line() + "\n").collect();
        for (names, file) in alone.iter().zip(&pair.names).filter(|(names, _)| !names.is_empty()) {
            text += &format!("only in {file}: {}\n", names.join(", "));
        }
        answer(&text)?;
    }
    if is_same { Ok(()) } else { Err(Failure::Differs) }
}

/// Whether a buffer differs by no more than is allowed: by nothing, unless something was said that applies to it.
fn is_within(found: &Found, args: &DiffArgs) -> bool {
    let max = args.max.zip(found.difference.distance.as_ref()).map(|(most, distance)| distance.max <= most);
    let flip = args.flip.zip(found.flip.as_ref()).map(|(most, flip)| flip.mean() <= most);
    match (max, flip) {
        (None, None) => found.is_same(),
        (max, flip) => max.unwrap_or(true) && flip.unwrap_or(true),
    }
}

impl Pair {
    fn read(args: &DiffArgs) -> Result<Self, Failure> {
        let names = [&args.a, &args.b].map(|path| shown(path));
        let (mut a, mut b) = (difference::read(&args.a)?, difference::read(&args.b)?);
        let sizes = [&a, &b].map(|file| [file.window.width, file.window.height]);
        if sizes[0] != sizes[1] {
            let [[w, h], [v, g]] = sizes;
            let [one, other] = &names;
            return Err(Failure::Work(format!(
                "{one} is {w} x {h} pixels and {other} is {v} x {g}; only pictures of one size can be compared"
            )));
        }
        // What is of 8 or 16 bits cannot be undone: the other becomes it
        let is_shown = |file: &StoredPlanes| file.format.is_display_encoded();
        let both_linear = !is_shown(&a) && !is_shown(&b);
        if args.exposure.is_some() && !both_linear {
            let message =
                "--exposure is for two pictures of linear light, .exr, .npz or .hdr; PNG and JPEG files have their own";
            return Err(Failure::Usage(message.into()));
        }
        let displays = match (is_shown(&a), is_shown(&b)) {
            (false, false) => [Display { exposure: args.exposure.unwrap_or(0.0), ..Display::default() }; 2],
            (true, false) => [a.display(); 2],
            (false, true) => [b.display(); 2],
            (true, true) => [a.display(), b.display()],
        };
        let mixed = |file: &StoredPlanes, of: &StoredPlanes, name: &str| {
            file.shown_as(of).map_err(|e| Failure::Work(format!("{name}: {e}")))
        };
        match (is_shown(&a), is_shown(&b)) {
            (true, false) => b = mixed(&b, &a, &names[1])?,
            (false, true) => a = mixed(&a, &b, &names[0])?,
            _ => {}
        }
        Ok(Pair { names, files: [a, b], displays })
    }

    /// The buffers that both have, and those that only one has, where both could have it.
    fn buffers(&self, args: &DiffArgs) -> Result<(Vec<String>, [Vec<String>; 2]), Failure> {
        let names = self.files.each_ref().map(|file| file.planes.iter().map(|plane| plane.name.clone()).collect());
        let [a, b]: [Vec<String>; 2] = names;
        if let Some(asked) = &args.buffers {
            for (names, file) in [&a, &b].into_iter().zip(&self.names) {
                if let Some(missing) = asked.iter().find(|name| !names.contains(name)) {
                    let names = names.join(", ");
                    return Err(Failure::Work(format!("{file} has no buffer {missing}; it has {names}")));
                }
            }
            return Ok((asked.clone(), Default::default()));
        }
        let common: Vec<String> = a.iter().filter(|name| b.contains(name)).cloned().collect();
        if common.is_empty() {
            let [one, other] = &self.names;
            let (a, b) = (a.join(", "), b.join(", "));
            return Err(Failure::Work(format!("{one} has {a} and {other} has {b}: no buffer is in both")));
        }
        let holds_buffers = |file: &StoredPlanes| matches!(file.format, Format::Exr | Format::Npz);
        if !self.files.iter().all(holds_buffers) {
            return Ok((common, Default::default()));
        }
        let alone = [&a, &b].map(|names| names.iter().filter(|name| !common.contains(name)).cloned().collect());
        Ok((common, alone))
    }

    fn planes(&self, name: &str) -> Result<[&StoredPlane; 2], Failure> {
        let plane = |k: usize| {
            let missing = || Failure::Work(format!("{} has no buffer {name}", self.names[k]));
            self.files[k].plane(name).ok_or_else(missing)
        };
        Ok([plane(0)?, plane(1)?])
    }

    fn columns(&self) -> u32 {
        self.files[0].window.width
    }

    fn compare(&self, name: &str, ppd: f64) -> Result<Found, Failure> {
        let [a, b] = self.planes(name)?;
        let compared = PlaneDifference::compare(a, b, self.columns());
        let difference =
            compared.map_err(|why| Failure::Work(format!("{} and {}: {why}", self.names[0], self.names[1])))?;
        let flip = match [a, b].map(StoredPlane::is_color) {
            [true, true] => self.flip(a, b, ppd),
            _ => None,
        };
        Ok(Found { difference, flip })
    }

    fn flip(&self, a: &StoredPlane, b: &StoredPlane, ppd: f64) -> Option<Flip> {
        let (a, b) = (a.displayed(&self.displays[0])?, b.displayed(&self.displays[1])?);
        Some(Flip::compare(&a, &b, self.columns() as usize, ppd))
    }

    /// The picture of the difference: of the picture itself, else of the first buffer that differs.
    fn draw(&self, found: &[Found], ppd: f64) -> Result<Drawn, Failure> {
        let is_picture = |found: &&Found| found.difference.name == "color";
        let chosen = found.iter().find(is_picture).or(found.iter().find(|found| !found.is_same())).or(found.first());
        let Some(chosen) = chosen else { return Err(Failure::Work("there is nothing to draw".into())) };
        let name = &chosen.difference.name;
        let [a, b] = self.planes(name)?;
        let (what, numbers) = match &chosen.flip {
            Some(flip) => (format!("FLIP, {ppd} pixels per degree"), flip.errors.clone()),
            None => ("difference over the largest".into(), relative_differences(a, b).map_err(Failure::Work)?),
        };
        let said = [("difference", what), ("buffers", json!([name]).to_string())];
        let receipt = Receipt { entries: said.map(|(key, value)| (key.to_owned(), value)).into() };
        let image = false_colors(&numbers, self.columns());
        let png = image.encode(Format::Png8, &Display::default(), &receipt);
        png.map(Drawn).map_err(|e| Failure::Work(e.to_string()))
    }
}

/// The bytes of a PNG file.
struct Drawn(Vec<u8>);

impl Drawn {
    fn write(&self, path: &std::path::Path, quiet: bool, watch: &Watch) -> Result<(), Failure> {
        Target::of(path).ready()?.stage(&self.0)?.commit(quiet, &|| watch.check().is_err())
    }
}

/// Sees that the picture of the difference is a PNG file and replaces neither of the two.
fn check_output(path: &std::path::Path, args: &DiffArgs) -> Result<(), Failure> {
    let (target, name) = (Target::of(path), shown(path));
    if target == Target::Stdout {
        return Err(Failure::Usage("-o - is taken by what is said of the difference; name a file".into()));
    }
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
        return Err(Failure::Usage(format!("-o {name}: the file's name must end in .png")));
    }
    if [&args.a, &args.b].iter().any(|file| Target::of(file).real() == target.real()) {
        return Err(Failure::Usage(format!("-o {name} would replace one of the two pictures; name another file")));
    }
    target.ready().map(drop)
}

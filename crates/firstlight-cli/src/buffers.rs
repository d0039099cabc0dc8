//! `firstlight buffers`: what files can hold of each pixel.

use firstlight::Plane;

use crate::report::{Failure, answer};

/// Lists all buffers: name, channels, type, unit, space, how a pixel of it comes about; and what each is.
///
/// # Errors
/// Standard output is closed.
pub fn run() -> Result<(), Failure> {
    let head = ["name", "channels", "type", "unit", "space", "sampling"].map(str::to_owned);
    let row = |plane: &Plane| {
        let channels = match plane.channels() {
            // Of a layer of Cryptomatte, from where to where
            [first, .., last] if plane.channels().len() > 4 => format!("{first} to {last}"),
            all => all.join(" "),
        };
        let words =
            [plane.name(), &channels, plane.number_type(), plane.unit(), plane.space(), plane.sampling().name()];
        words.map(str::to_owned)
    };
    let rows: Vec<[String; 6]> = std::iter::once(head).chain(Plane::ALL.iter().map(row)).collect();
    let widths: [usize; 6] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for row in rows {
        let line = row.iter().zip(widths).map(|(word, width)| format!("{word:width$}")).collect::<Vec<_>>().join("  ");
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text.push('\n');
    for plane in Plane::ALL {
        text.push_str(&format!("{:width$}  {}\n", plane.name(), plane.about(), width = widths[0]));
    }
    text.push_str(LIGHTS);
    text.push_str(OBJECTS);
    answer(&text)
}

/// Those whose names hold the name of a light.
const LIGHTS: &str = "
Of each light, with the channels of diffuse; NAME is its name, or #3 for the third in scene order,
or * for all of them, each apart; group:NAME is the same of a group of lights:
light:NAME                    What of the picture it sends.
light:NAME:diffuse            What of that surfaces reflect diffusely.
light:NAME:specular           What of that highlights make.
light:NAME:unshadowed         What it would send if nothing cast shadows.
light:NAME:visibility         The share of that which arrives, 0 to 1, as shadow.
light:NAME:unscaled-diffuse   What it sends before its own colour and strength; not of groups.
light:NAME:unscaled-specular  The same of highlights.
relight                       All that `firstlight relight` needs: alpha, background, emission, ambient,
                              the unscaled parts of all lights, the coverage of lights that are seen.
";

/// Those whose names hold the name of an object.
const OBJECTS: &str = "
Of each object, as coverage:background is of the background; NAME is its name, or #3 for the one of
object-id 3, or * for all that a camera can see, each apart:
coverage:NAME        The share of the pixel's camera rays that meet it first.
";

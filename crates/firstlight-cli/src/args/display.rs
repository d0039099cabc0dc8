//! How a picture is displayed: what the scene says, and the options `--display` and `--exposure` in place of it.

use clap::Args;
use firstlight::{Display, Encoding};

use super::values::exposure;

/// The options.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct DisplayArgs {
    /// How linear light becomes the numbers of 8- and 16-bit pictures: srgb, neutral (Khronos's PBR Neutral tone
    /// mapping, then sRGB), linear, or gamma=G, 0.1 to 10. Other formats are not affected [default: the scene's; of a
    /// model by itself that of the studio: neutral, but for flat and none]
    #[arg(long, value_name = "WORD", value_parser = display, help_heading = "Output")]
    pub display: Option<Display>,
    /// Stops of exposure of 8- and 16-bit pictures, -64 to 64: they are multiplied by 2^EV. Other formats are not
    /// affected [default: the scene's]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure, help_heading = "Output")]
    pub exposure: Option<f64>,
}

impl DisplayArgs {
    /// The display of a scene, with what the options say in place of it.
    pub fn of(&self, scene: &Display) -> Display {
        Display { exposure: self.exposure.unwrap_or(scene.exposure), ..self.display.unwrap_or(*scene) }
    }
}

/// Reads `--display`: the words of [`Display`] without their exposure, which is 0.
fn display(text: &str) -> Result<Display, String> {
    let is_in_range = |display: &Display| match display.encoding {
        Encoding::Gamma(gamma) => (0.1..=10.0).contains(&gamma),
        Encoding::Srgb | Encoding::Linear => true,
    };
    let read = format!("{}, exposure 0", text.replacen("gamma=", "gamma ", 1)).parse::<Display>();
    let display = read.ok().filter(is_in_range);
    display.ok_or_else(|| "srgb, neutral, linear or gamma=G is needed, with G from 0.1 to 10".to_owned())
}

#[cfg(test)]
mod tests {
    use firstlight::ToneMapping;

    use super::*;

    #[test]
    fn options_take_the_place_of_the_scenes_words() {
        let scene = Display { encoding: Encoding::Gamma(1.8), exposure: 1.5, tone_mapping: ToneMapping::None };
        let of = |display: &str, exposure| {
            DisplayArgs { display: super::display(display).ok(), exposure }.of(&scene).to_string()
        };
        assert_eq!(of("", None), "gamma 1.8, exposure 1.5");
        assert_eq!(of("", Some(0.0)), "gamma 1.8, exposure 0");
        assert_eq!(of("neutral", None), "neutral, exposure 1.5");
        assert_eq!(of("srgb", Some(-1.0)), "srgb, exposure -1");
        assert_eq!(of("linear", None), "linear, exposure 1.5");
        assert_eq!(of("gamma=2.2", None), "gamma 2.2, exposure 1.5");
        for bad in ["", "sRGB", "gamma", "gamma=", "gamma=0", "gamma=nan", "gamma=11", "filmic"] {
            assert!(display(bad).is_err(), "{bad}");
        }
    }
}

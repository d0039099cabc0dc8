//! Pictures that are made by a formula, by their file names: scenes that name them need no files.

use std::f64::consts::TAU;

use firstlight::{AssetError, Assets};

use crate::Random;

/// The files `KIND-WxH-SEED.png`, 8-bit RGBA, the same for the same name; no others. Kinds:
///
/// - `noise`: random texels in all channels.
/// - `waves`: a normal map of waves that repeats, with slopes up to 0.8.
/// - `bumps`: a normal map with a random slope up to 0.5 at each texel.
/// - `hills`: a sum of waves that repeats, the same in red, green and blue; alpha is its complement.
/// - `spots`: random colours; alpha falls from 1 to 0 away from a few points.
pub struct FormulaPictures;

/// The largest number of texels along a side.
const MAX_SIDE: u32 = 256;

impl FormulaPictures {
    /// The bytes of the PNG file of a name.
    pub fn file(name: &str) -> Option<Vec<u8>> {
        let mut words = name.strip_suffix(".png")?.split('-');
        let kind = words.next()?;
        let (width, height) = words.next()?.split_once('x')?;
        let size = [width, height].map(|side| side.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side)));
        let (size, seed) = ([size[0]?, size[1]?], words.next()?.parse().ok()?);
        let texels = texels(kind, size, &mut Random::new(seed))?;
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(png::ColorType::Rgba);
        let mut writer = encoder.write_header().ok()?;
        writer.write_image_data(texels.as_flattened()).ok()?;
        writer.finish().ok()?;
        Some(bytes)
    }
}

impl Assets for FormulaPictures {
    fn read(&self, path: &str, _limit: u64) -> Result<Vec<u8>, AssetError> {
        FormulaPictures::file(path).ok_or(AssetError::NotFound)
    }
}

fn byte(x: f64) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// A normal of such slopes as a texel.
fn normal([du, dv]: [f64; 2]) -> [u8; 4] {
    let length = (du * du + dv * dv + 1.0).sqrt();
    let [x, y, z] = [-du, -dv, 1.0].map(|x| byte(0.5 + 0.5 * x / length));
    [x, y, z, 255]
}

/// The texels of a kind, the top row first.
fn texels(kind: &str, [width, height]: [u32; 2], random: &mut Random) -> Option<Vec<[u8; 4]>> {
    // Whole waves along u and v, so that the picture repeats
    let waves = [0; 3].map(|_| [1 + random.below(3), 1 + random.below(3)].map(f64::from));
    let phases = [0; 3].map(|_| random.between(0.0, TAU));
    let spots: Vec<[f64; 3]> =
        (0..3 + random.below(6)).map(|_| [random.unit(), random.unit(), random.between(0.1, 0.3)]).collect();
    let mut texel = |u: f64, v: f64| {
        let angles = [0, 1, 2].map(|k| TAU * (waves[k][0] * u + waves[k][1] * v) + phases[k]);
        Some(match kind {
            "noise" => [0; 4].map(|_| random.below(256) as u8),
            "waves" => normal([0, 1].map(|axis| 0.4 * pxfm::f_sin(angles[axis]) + 0.4 * pxfm::f_cos(angles[2]))),
            "bumps" => normal([0; 2].map(|_| random.between(-0.5, 0.5))),
            "hills" => {
                let height = byte(0.5 + angles.map(|angle| pxfm::f_sin(angle) / 6.0).iter().sum::<f64>());
                [height, height, height, 255 - height]
            }
            "spots" => {
                let cover = spots.iter().map(|[x, y, reach]| {
                    let away = ((u - x) * (u - x) + (v - y) * (v - y)).sqrt();
                    (1.5 - away / reach).clamp(0.0, 1.0)
                });
                let [r, g, b] = [0; 3].map(|_| random.below(256) as u8);
                [r, g, b, byte(cover.fold(0.0, f64::max))]
            }
            _ => return None,
        })
    };
    let at = |i: u32, side: u32| (f64::from(i) + 0.5) / f64::from(side);
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    places.map(|(x, y)| texel(at(x, width), at(y, height))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_make_pictures_and_others_are_not_found() {
        for kind in ["noise", "waves", "bumps", "hills", "spots"] {
            let name = format!("{kind}-7x5-3.png");
            let [one, other] = [(); 2].map(|()| FormulaPictures.read(&name, 1 << 20).unwrap());
            assert_eq!(one, other);
            let reader = png::Decoder::new(std::io::Cursor::new(one)).read_info().unwrap();
            assert_eq!((reader.info().width, reader.info().height), (7, 5));
        }
        for name in ["noise-0x5-3.png", "noise-7x5.png", "noise-7x999-3.png", "cat-7x5-3.png", "noise-7x5-3.jpg"] {
            assert_eq!(FormulaPictures.read(name, 1 << 20), Err(AssetError::NotFound), "{name}");
        }
    }
}

//! What the filters promise, against sums over many texels.

use std::path::Path;

use glam::DVec2;

use super::filter::{Beyond, TexturePlace};
use super::pyramid::{MaskRule, Pyramid, TextureUse};
use super::{Filter, TextureSpace, Wrap};
use crate::describe::Channel;
use crate::image::read::{Limits, TexelSamples, Texels, decode};

const REPEAT: Beyond = Beyond { wrap: [Wrap::Repeat; 2], border: [0.0; 4] };

fn photograph(name: &str) -> Texels {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/images");
    decode(&std::fs::read(folder.join(name)).unwrap(), &Limits::default()).unwrap()
}

fn place(at: DVec2, steps: [DVec2; 2]) -> TexturePlace {
    TexturePlace { at, steps, within: [None; 2] }
}

/// Footprints of all angles and ratios up to 16, whose smaller side is from `least` to 24 texels.
fn footprints(random: &mut firstlight_testkit::Random, least: f64) -> [DVec2; 2] {
    let scale = |random: &mut firstlight_testkit::Random, low: f64, high: f64| {
        low * pxfm::f_pow(high / low, f64::from(random.below(1 << 20)) / f64::from(1 << 20))
    };
    let minor = scale(random, least, 12.0);
    let major = minor * scale(random, 1.0, 12.0);
    let angle = f64::from(random.below(3600)) / 3600.0 * std::f64::consts::TAU;
    let (sin, cos) = pxfm::f_sincos(angle);
    [DVec2::new(cos, sin) * major, DVec2::new(-sin, cos) * minor]
}

/// Sums of many lookups of one texel each.
fn value_of_texel(pyramid: &Pyramid, filter: Filter, at: DVec2) -> [f32; 4] {
    pyramid.value(filter, &place(at, [DVec2::ZERO; 2]), &REPEAT)
}

fn encoded(v: f64) -> f64 {
    crate::color::Encoding::Srgb.encode(v)
}

/// At all angles and ratios: 1,024 points with the kernel of the ellipse.
#[test]
fn an_ellipse_is_its_kernel_over_the_picture() {
    let pyramid = Pyramid::new(&photograph("progressive_cat.jpg"), TextureUse::Color(TextureSpace::Srgb));
    let mut random = firstlight_testkit::Random::new(7);
    let (mut sum, mut count) = (0.0, 0.0);
    for _ in 0..400 {
        let steps = footprints(&mut random, 0.7);
        let at = DVec2::new(f64::from(random.below(10000)), f64::from(random.below(10000))) * 0.1;
        let got = pyramid.value(Filter::Anisotropic, &place(at, steps), &REPEAT);
        let (mut expected, mut weights) = ([0.0f64; 3], 0.0);
        for k in 0..1024 {
            let p = DVec2::new(f64::from(k % 32) - 15.5, f64::from(k / 32) - 15.5) / 16.0;
            let r2 = p.length_squared();
            if r2 < 1.0 {
                let weight = pxfm::f_exp(-2.0 * r2) - pxfm::f_exp(-2.0);
                let texel = value_of_texel(&pyramid, Filter::Bilinear, at + steps[0] * p.x + steps[1] * p.y);
                expected = std::array::from_fn(|k| expected[k] + f64::from(texel[k]) * weight);
                weights += weight;
            }
        }
        for k in 0..3 {
            let off = encoded(f64::from(got[k])) - encoded(expected[k] / weights);
            sum += off * off;
            count += 1.0;
        }
    }
    let rms = (sum / count).sqrt() * 255.0;
    assert!(rms < 1.3, "{rms}");
}

/// A pixel of 4 x 4 camera rays against the mean of the texels under it.
#[test]
fn a_pixel_is_a_box_over_a_photograph_to_40_decibels() {
    let pyramid = Pyramid::new(&photograph("progressive_cat.jpg"), TextureUse::Color(TextureSpace::Srgb));
    let mut random = firstlight_testkit::Random::new(8);
    let (mut sum, mut count) = (0.0, 0.0);
    for _ in 0..150 {
        let steps = footprints(&mut random, 2.0);
        let at = DVec2::new(f64::from(random.below(10000)), f64::from(random.below(10000))) * 0.1;
        let mut means = [[0.0f64; 3]; 2];
        for (mean, (n, filter)) in means.iter_mut().zip([(4, Filter::Anisotropic), (64, Filter::Nearest)]) {
            for k in 0..n * n {
                let n = f64::from(n);
                let p = (DVec2::new(f64::from(k) % n, (f64::from(k) / n).floor()) + 0.5) / n - 0.5;
                let at = at + steps[0] * p.x + steps[1] * p.y;
                let value = pyramid.value(filter, &place(at, steps.map(|step| step / n)), &REPEAT);
                *mean = std::array::from_fn(|k| mean[k] + f64::from(value[k]) / (n * n));
            }
        }
        for (one, other) in means[0].iter().zip(&means[1]).take(3) {
            let off = encoded(*one) - encoded(*other);
            sum += off * off;
            count += 1.0;
        }
    }
    let rms = (sum / count).sqrt();
    assert!(rms < 0.01, "{} dB", -20.0 * rms.log10());
}

/// Stripes of every width around that of the footprint's steps, seen by four camera rays in line.
#[test]
fn no_stripe_leaves_a_line() {
    for period in [4, 16, 64] {
        let row: Vec<u8> = (0..512).map(|i| if i * 2 / period % 2 == 0 { 255 } else { 0 }).collect();
        let texels = Texels { width: 512, height: 512, channels: 1, data: TexelSamples::U8(row.repeat(512)) };
        let pyramid = Pyramid::new(&texels, TextureUse::Color(TextureSpace::Raw));
        for (across, cycles) in [(1.0, 1.0), (0.25, 1.0), (1.0, 1.0625), (0.25, 1.0625), (1.0, 2.0), (1.0, 3.7)] {
            let step = period as f64 * cycles;
            for phase in 0..32 {
                let ray = |i: i32| {
                    let at = DVec2::new(f64::from(phase) / 32.0 * period as f64 + f64::from(i) * step, 300.0);
                    let steps = [DVec2::X * step, DVec2::Y * step * across];
                    f64::from(pyramid.value(Filter::Anisotropic, &place(at, steps), &REPEAT)[0])
                };
                let mean = (0..4).map(ray).sum::<f64>() / 4.0;
                assert!((mean - 0.5).abs() < 0.02, "{period} {across} {cycles} {phase}: {mean}");
            }
        }
    }
}

#[test]
fn a_constant_picture_is_constant_under_every_filter() {
    let mut random = firstlight_testkit::Random::new(3);
    for (width, height) in [(1, 1), (7, 5), (64, 64), (1, 300), (33, 2)] {
        let texel = [10, 200, 77, 128];
        let data = TexelSamples::U8(texel.repeat((width * height) as usize));
        let texels = Texels { width, height, channels: 4, data };
        for of in [TextureUse::Color(TextureSpace::Srgb), TextureUse::CoveredColor(TextureSpace::Srgb)] {
            let pyramid = Pyramid::new(&texels, of);
            let expected = value_of_texel(&pyramid, Filter::Nearest, DVec2::splat(0.5));
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                for filter in Filter::ALL {
                    for scale in [0.001, 0.1, 1.0, 100.0, 1e9] {
                        let steps = footprints(&mut random, 0.3).map(|step| step * scale);
                        let at = DVec2::new(f64::from(random.below(999)), f64::from(random.below(999))) - 500.0;
                        let beyond = Beyond { wrap: [wrap; 2], border: [0.0; 4] };
                        let got = pyramid.value(*filter, &place(at, steps), &beyond);
                        for k in 0..4 {
                            assert!((got[k] - expected[k]).abs() < 2e-6, "{filter:?} {steps:?} {got:?} {expected:?}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn hostile_footprints_give_numbers() {
    let pyramid = Pyramid::new(&photograph("progressive_cat.jpg"), TextureUse::Color(TextureSpace::Srgb));
    let numbers = [0.0, 1e-30, -0.3, 7.0, 1e9, -1e30, 1e200, f64::INFINITY, f64::NAN];
    for a in numbers {
        for b in numbers {
            for c in numbers {
                for filter in Filter::ALL {
                    let place = place(DVec2::new(c, b), [DVec2::new(a, b), DVec2::new(b, c)]);
                    let value = pyramid.value(*filter, &place, &REPEAT);
                    let fine = value.iter().all(|v| (-1e-6..=1.000001).contains(v));
                    assert!(fine || !(c.is_finite() && b.is_finite()), "{place:?} {filter:?} {value:?}");
                }
            }
        }
    }
}

#[test]
fn all_256_values_of_srgb_are_decoded() {
    let texels = Texels { width: 256, height: 1, channels: 1, data: TexelSamples::U8((0..=255).collect()) };
    let [srgb, raw] =
        [TextureSpace::Srgb, TextureSpace::Raw].map(|space| Pyramid::new(&texels, TextureUse::Color(space)));
    for i in 0..256 {
        let at = DVec2::new(f64::from(i) + 0.5, 0.5);
        let stored = f64::from(i) / 255.0;
        // IEC 61966-2-1
        let linear = if stored <= 0.04045 { stored / 12.92 } else { pxfm::f_pow((stored + 0.055) / 1.055, 2.4) };
        for filter in [Filter::Nearest, Filter::Bilinear, Filter::Trilinear, Filter::Anisotropic] {
            assert!((f64::from(value_of_texel(&srgb, filter, at)[0]) - linear).abs() < 1e-7, "{i} {filter:?}");
            assert_eq!(value_of_texel(&raw, filter, at)[0], stored as f32);
        }
    }
}

/// -0.5, 0, 1 and 1.5 of a picture of four texels: where they lie under each wrap.
#[test]
fn wraps_where_they_should() {
    let texels = Texels { width: 4, height: 1, channels: 1, data: TexelSamples::U8(vec![0, 85, 170, 255]) };
    let pyramid = Pyramid::new(&texels, TextureUse::Color(TextureSpace::Raw));
    for (wrap, nearest, bilinear) in [
        (Wrap::Repeat, [2.0, 0.0, 0.0, 2.0], [1.5, 1.5, 1.5, 1.5]),
        (Wrap::Mirror, [1.0, 0.0, 3.0, 1.0], [1.5, 0.0, 3.0, 1.5]),
        (Wrap::Clamp, [0.0, 0.0, 3.0, 3.0], [0.0, 0.0, 3.0, 3.0]),
        (Wrap::Border, [6.0, 0.0, 6.0, 6.0], [6.0, 3.0, 4.5, 6.0]),
    ] {
        for (i, u) in [-0.5, 0.0, 1.0, 1.5].into_iter().enumerate() {
            let beyond = Beyond { wrap: [wrap; 2], border: [2.0; 4] };
            let beyond = Beyond { wrap: [beyond.wrap[0], Wrap::Clamp], ..beyond };
            for (filter, expected) in [
                (Filter::Nearest, nearest[i]),
                (Filter::Bilinear, bilinear[i]),
                (Filter::Trilinear, bilinear[i]),
                (Filter::Anisotropic, bilinear[i]),
            ] {
                let got = pyramid.value(filter, &place(DVec2::new(u * 4.0, 0.5), [DVec2::ZERO; 2]), &beyond);
                assert!((got[0] - expected / 3.0).abs() < 1e-6, "{wrap:?} {u} {filter:?}: {}", got[0] * 3.0);
            }
        }
    }
}

/// Red where it shows, green where it does not: the smaller pictures are red, and as solid as half of them.
#[test]
fn what_is_transparent_does_not_colour() {
    let texels: Vec<u8> =
        (0..64 * 64).flat_map(|i| if i / 8 % 2 == 0 { [255, 0, 0, 255] } else { [0, 255, 0, 0] }).collect();
    let texels = Texels { width: 64, height: 64, channels: 4, data: TexelSamples::U8(texels) };
    let steps = [DVec2::X * 40.0, DVec2::Y * 40.0];
    let of = |of| Pyramid::new(&texels, of).value(Filter::Anisotropic, &place(DVec2::splat(9.0), steps), &REPEAT);
    let [r, g, _, a] = of(TextureUse::CoveredColor(TextureSpace::Srgb));
    assert!(r > 0.999 && g < 0.001 && (a - 0.5).abs() < 0.01, "{r} {g} {a}");
    let [r, g, _, a] = of(TextureUse::Color(TextureSpace::Srgb));
    assert!((r - 0.5).abs() < 0.01 && (g - 0.5).abs() < 0.01 && (a - 0.5).abs() < 0.01, "{r} {g} {a}");
}

/// A mask is 0 or 1 from near; from far it is the share of its texels at or above the cutoff.
#[test]
fn masks_hold_the_share_that_is_solid() {
    let mut random = firstlight_testkit::Random::new(5);
    let alpha: Vec<u8> = (0..61 * 47).map(|_| random.below(256) as u8).collect();
    let solid = alpha.iter().filter(|a| **a >= 77).count() as f32 / alpha.len() as f32;
    let texels = Texels { width: 61, height: 47, channels: 1, data: TexelSamples::U8(alpha.clone()) };
    let rule = MaskRule { channel: Channel::R, space: TextureSpace::Raw, cutoff: 77.0 / 255.0 };
    let pyramid = Pyramid::new(&texels, TextureUse::Mask(rule));
    let share = |at: DVec2, step: f64| {
        pyramid.share(Filter::Anisotropic, &place(at, [DVec2::X * step, DVec2::Y * step]), &REPEAT)
    };
    assert!((share(DVec2::new(20.0, 20.0), 1e4) - solid).abs() <= 1.0 / 255.0);
    for i in 0..61 {
        let at = DVec2::new(f64::from(i) + 0.5, 3.5);
        let expected = if alpha[3 * 61 + i as usize] >= 77 { 1.0 } else { 0.0 };
        assert_eq!(share(at, 0.3), expected, "{i}");
    }
}

/// Normals to the left and to the right: their mean points up and is short.
#[test]
fn means_of_normals_keep_their_length() {
    let texels: Vec<u8> =
        (0..16 * 16).flat_map(|i| if i % 2 == 0 { [218, 128, 218] } else { [37, 128, 218] }).collect();
    let texels = Texels { width: 16, height: 16, channels: 3, data: TexelSamples::U8(texels) };
    let pyramid = Pyramid::new(&texels, TextureUse::Normal);
    let [x, y, z, _] = value_of_texel(&pyramid, Filter::Nearest, DVec2::splat(0.5));
    assert!(((x * x + y * y + z * z).sqrt() - 1.0).abs() < 1e-6 && (x - z).abs() < 1e-6, "{x} {y} {z}");
    let steps = [DVec2::X * 100.0, DVec2::Y * 100.0];
    let [x, y, z, _] = pyramid.value(Filter::Anisotropic, &place(DVec2::splat(3.0), steps), &REPEAT);
    assert!(x.abs() < 0.003 && y.abs() < 0.01 && (z - 0.707).abs() < 0.003, "{x} {y} {z}");
}

/// What a picture of 4096 x 4096 takes, with alpha.
#[test]
fn large_pictures_take_what_is_said() {
    let of = TextureUse::Color(TextureSpace::Srgb);
    assert!(Pyramid::bytes_of([4096, 4096], 4, 1, of) <= 90_000_000);
    let mask = |channel, space| TextureUse::Mask(MaskRule { channel, space, cutoff: 0.5 });
    let uses = [
        of,
        TextureUse::Color(TextureSpace::Raw),
        TextureUse::CoveredColor(TextureSpace::Srgb),
        TextureUse::Normal,
        mask(Channel::G, TextureSpace::Raw),
        mask(Channel::G, TextureSpace::Srgb),
        mask(Channel::Luminance, TextureSpace::Raw),
    ];
    for size in [[7, 5], [64, 32], [100, 1], [1, 1], [9, 300]] {
        let [width, height] = size;
        for channels in 1..=4 {
            let count = width as usize * height as usize * channels;
            let samples = [
                TexelSamples::U8(vec![9; count]),
                TexelSamples::U16(vec![9; count]),
                TexelSamples::F32(vec![0.9; count]),
            ];
            for (data, sample_bytes) in samples.into_iter().zip([1, 2, 4]) {
                let texels = Texels { width, height, channels, data };
                for of in uses {
                    let said = Pyramid::bytes_of(size, channels, sample_bytes, of);
                    assert_eq!(said, Pyramid::new(&texels, of).bytes(), "{size:?} {channels} {sample_bytes} {of:?}");
                }
            }
        }
    }
}

/// The picture of half the size of odd sides has the same mean, and its middle in the same place.
#[test]
fn odd_sizes_are_not_shifted() {
    for (width, height) in [(5, 3), (17, 9), (31, 30)] {
        let ramp: Vec<u16> = (0..width * height).map(|i| (i % width * 1000) as u16).collect();
        let texels = Texels { width, height, channels: 1, data: TexelSamples::U16(ramp) };
        let pyramid = Pyramid::new(&texels, TextureUse::Color(TextureSpace::Raw));
        let middle = f64::from(width - 1) * 500.0 / 65535.0;
        for step in [1.0, 2.0, 4.0] {
            let at = DVec2::new(f64::from(width), f64::from(height)) * 0.5;
            let place = place(at, [DVec2::X * step, DVec2::Y * step]);
            let clamp = Beyond { wrap: [Wrap::Clamp; 2], border: [0.0; 4] };
            for filter in [Filter::Trilinear, Filter::Anisotropic] {
                let got = pyramid.value(filter, &place, &clamp)[0];
                assert!((f64::from(got) - middle).abs() < 2e-5, "{width} {step} {filter:?}: {got} {middle}");
            }
        }
    }
}

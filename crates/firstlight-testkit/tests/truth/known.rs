//! Config 11 against the picture it was known by, which another program made.
//!
//! That program shifted its camera rays by 0.4 pixel to the right and up, took 400 random light points, read its
//! checkerboards from 32 x 32 texels and cut bytes off instead of rounding them. So only the insides of surfaces are
//! compared: away from their outlines, the squares' edges and the borders of shadows.

use firstlight::{Vec3, WorldRay};

use crate::scenes::*;

const SIZE: u32 = 1024;
/// Every so many pixels in both directions.
const STRIDE: u32 = 3;
/// Half the side of the neighbourhood that has to look alike, in pixels.
const AROUND: f64 = 4.0;

/// Centre and radius of what can stand in the light: the walls of a closed room do not.
const BALLS: [(V, f64); 4] =
    [([3.0, 1.0, -7.0], 1.5), ([2.0, -3.2, -5.0], 1.0), ([-4.0, 2.0, -5.0], 1.8), ([-2.0, -4.5, -8.0], 2.0)];

/// How many of 5 x 5 points of the light, rim included, are hidden from `p`; points below the horizon `n` do not count.
fn hidden(p: V, n: V) -> [u32; 2] {
    let (mut blocked, mut below) = (0, 0);
    for k in 0..25 {
        let q = [(k % 5) as f64 * 0.5 - 1.0, 5.9, (k / 5) as f64 * 0.5 - 7.0];
        let l = sub(q, p);
        if dot(l, n) <= 0.0 {
            below += 1;
            continue;
        }
        // The distance from a centre to the line, where that lies between the ends
        blocked += u32::from(BALLS.iter().any(|(c, r)| {
            let f = sub(*c, p);
            let t = dot(f, l) / dot(l, l);
            let nearest = sub(f, mul(l, t));
            (1e-4..1.0).contains(&t) && length(nearest) < *r - 1e-4
        }));
    }
    [blocked, below]
}

/// What a place on the film shows, as far as the comparison cares: surface, square of its board, light.
fn seen(scene: &firstlight::Scene, x: f64, y: f64) -> (u32, [u32; 2], [u32; 2]) {
    let (ray, differential): (WorldRay, _) = scene.camera().ray(x as f32, y as f32, 1.0);
    let Some(hit) = scene.intersect(&ray) else { panic!("the room is closed behind {x}, {y}") };
    let id = hit.surface.0;
    if id >= 9 {
        return (id, [0; 2], [0; 2]);
    }
    let si = scene.surface(&ray, &hit, &differential);
    let v = |v: Vec3| v.to_array().map(f64::from);
    let squares = match id {
        2 => 8.0,
        0..4 => 4.0,
        _ => 1.0,
    };
    let square = si.uv.to_array().map(|w| if squares > 1.0 { (w as f64 * squares) as u32 } else { 0 });
    let [blocked, below] = hidden(si.p.to_array(), v(si.ng));
    // Lit by all of it that is above the horizon, by none of it, or in the penumbra
    let light = match blocked {
        0 => 0,
        b if b + below == 25 => 1,
        b => 100 + b,
    };
    (id, square, [light, u32::from(below == 25)])
}

#[test]
fn config_11_is_the_picture_it_was_known_by() {
    let file = std::io::BufReader::new(std::io::Cursor::new(include_bytes!("../data/config11-known.png")));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG file");
    let mut known = vec![0; (SIZE * SIZE * 3) as usize];
    let info = reader.next_frame(&mut known).expect("a whole PNG file");
    assert_eq!((info.width, info.height, info.color_type), (SIZE, SIZE, png::ColorType::Rgb));

    let scene = compile(&config11(SIZE, 2, 64));
    let film = picture(&scene, &firstlight::RenderSettings::default());
    let mut differences: Vec<Vec<f64>> = vec![Vec::new(); 10];
    for y in (6..SIZE - 6).step_by(STRIDE as usize) {
        for x in (6..SIZE - 6).step_by(STRIDE as usize) {
            let center = (x as f64 + 0.5, y as f64 + 0.5);
            let here = seen(&scene, center.0, center.1);
            let alike = |k: u32| {
                let (s, t) = ((k % 3) as f64 - 1.0, (k / 3) as f64 - 1.0);
                seen(&scene, center.0 + s * AROUND, center.1 + t * AROUND) == here
            };
            if here.2[0] >= 100 || !(0..9).all(alike) {
                continue;
            }
            let at = (y * SIZE + x) as usize;
            for c in 0..3 {
                // Cut off, as that program did
                let linear = (film.pixels[at][c] as f64).clamp(0.0, 1.0);
                let byte = (255.0 * pxfm::f_pow(linear, 1.0 / 2.2)).floor();
                differences[here.0 as usize].push((byte - known[at * 3 + c] as f64).abs());
            }
        }
    }
    for (id, differences) in differences.iter_mut().enumerate() {
        let n = differences.len();
        assert!(n > 300, "only {n} numbers of surface {id} were compared");
        differences.sort_by(f64::total_cmp);
        let median = differences[n / 2];
        let mean = differences.iter().sum::<f64>() / n as f64;
        println!("surface {id}: {n} numbers, median {median}, mean {mean:.3}, largest {}", differences[n - 1]);
        assert!(median <= 1.0 && mean <= 1.5, "surface {id}: median {median}, mean {mean} of {n} numbers");
    }
}

//! The table of measured deviations that the book publishes. It is made here, and since the bits of a picture are a
//! promise, so is the table: it has to be the page `docs/src/deviations.md`, word for word. `FIRSTLIGHT_BLESS=1` writes
//! the page, and the run still fails.

use std::f64::consts::PI;
use std::fmt::Write;

use firstlight::{Falloff, LightDesc, ParallelogramDesc, RectangleDesc, SampleSet};

use crate::analytic::{corners, first, irradiance, lambert, white};
use crate::area_lights::{DOWN, ball, disk, disk_overhead};
use crate::scenes::*;

const UP: V = [0.0, 1.0, 0.0];

/// One row: what, by its closed form, as rendered, and the largest relative deviation allowed.
struct Row {
    what: String,
    truth: f64,
    is: f64,
    allowed: f64,
}

fn row(what: impl Into<String>, truth: f64, is: f64, allowed: f64) -> Row {
    Row { what: what.into(), truth, is, allowed }
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    let floor = |light| irradiance([0.0; 3], UP, &[light]);
    // Points and directions
    let aslant = |d: f64| LightDesc::Point(point([0.6 * d, 0.8 * d, 0.0], 10.0));
    rows.push(row("point light, 10 cd, 2 m away, 53° above: I cos / d²", 10.0 * 0.8 / 4.0, floor(aslant(2.0)), 2e-6));
    rows.push(row("the same, 20 m away: a hundredth", 0.02, floor(aslant(20.0)), 2e-6));
    let sun = LightDesc::Directional(directional([-0.6, -0.8, 0.0], 3.0));
    rows.push(row("directional light, 3 lx, 53° above: E cos", 2.4, floor(sun), 2e-6));
    let angle = 12.0;
    let (cos, at) = (pxfm::f_cos(radians(angle)), 2.0 * pxfm::f_tan(radians(angle)));
    let fade = (cos - pxfm::f_cos(radians(20.0))) / (pxfm::f_cos(radians(5.0)) - pxfm::f_cos(radians(20.0)));
    let lamp = LightDesc::Spot(spot([0.0, 2.0, 0.0], [0.0; 3], 40.0, Some(10.0), 5.0));
    let truth = 5.0 * fade * fade * cos * cos * cos / 4.0;
    rows.push(row("spot light, cones 40° and 10°, at 12°", truth, irradiance([at, 0.0, 0.0], UP, &[lamp]), 2e-5));
    // The rectangle light, converging
    // The front is where a x b points: down
    let (center, a, b) = ([0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
    let truth = lambert(&corners(center, a, b), [0.0; 3], UP);
    for (set, n, allowed) in [
        (SampleSet::Sobol, 64, 2e-2),
        (SampleSet::Sobol, 400, 5e-3),
        (SampleSet::Sobol, 4096, 5e-4),
        (SampleSet::Sobol, 65536, 5e-5),
        (SampleSet::Grid, 400, 5e-3),
        (SampleSet::Grid, 65536, 2e-5),
    ] {
        let is = floor(LightDesc::Rectangle(rectangle(center, a, b, set, n)));
        rows.push(row(format!("rectangle light 2 x 2 at height 1, {n} points, `{}`", set.name()), truth, is, allowed));
    }
    let (center, a, b) = ([1.5, 2.0, -0.7], [1.2, 0.6, 0.0], [0.0, 0.0, 2.0]);
    let truth = lambert(&corners(center, a, b), [0.0; 3], UP);
    let is = floor(LightDesc::Rectangle(rectangle(center, a, b, SampleSet::Sobol, 4096)));
    rows.push(row("rectangle light aside and tilted, 4096 points, `sobol`", truth, is, 5e-4));
    let quarter = |x: f64, z: f64| rectangle([x, 1.0, z], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], SampleSet::Grid, 100);
    let quarters = [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)];
    let quarters = quarters.map(|(x, z)| LightDesc::Rectangle(quarter(x, z)));
    let whole =
        floor(LightDesc::Rectangle(rectangle([0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], SampleSet::Grid, 400)));
    rows.push(row("a 2 x 2 light in four parts, as the whole", whole, irradiance([0.0; 3], UP, &quarters), 2e-6));
    // Disk and sphere lights
    for (d, what) in [(0.0, "on its axis"), (1.5, "1.5 off its axis")] {
        let is = floor(LightDesc::Disk(disk([d, 2.0, 0.0], DOWN, 1.0, 4096)));
        let what = format!("disk light of radius 1 at height 2, {what}, 4096 points, `sobol`");
        rows.push(row(what, disk_overhead(1.0, 2.0, d), is, 5e-4));
    }
    let is = floor(LightDesc::Sphere(ball([0.6, 0.8, 0.0], 0.5, 4096)));
    let what = "sphere light of radius 0.5, 1 m away, 53° above, 4096 points, `sobol`";
    rows.push(row(what, PI * 0.25 * 0.8, is, 5e-3));
    // Shadows
    let shadow = white([0.0; 3], UP, 5.0).with_sphere(sphere([0.0, 2.0, 0.0], 1.0));
    let shadow = shadow.with_light(LightDesc::Point(point([0.0, 6.0, 0.0], 100.0)));
    let radius = first(1.4, 1.7, |r| probe(&shadow, [r, 0.5, 0.0], [r, 0.0, 0.0])[0] > 0.0);
    rows.push(row("hard shadow of a sphere on a plane: its radius", 1.5491933384829668, radius, 5e-6));
    let edge = ParallelogramDesc::new([0.0, 1.0, -50.0], [100.0, 0.0, 0.0], [0.0, 0.0, 100.0]);
    let lamp = rectangle([0.0, 2.0, 0.0], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0], SampleSet::Sobol, 4096);
    let lamp = LightDesc::Rectangle(RectangleDesc { falloff: Falloff::Constant, ..lamp });
    let behind = |scene: firstlight::SceneDesc| probe(&scene, [-0.2, 0.5, 0.0], [0.0; 3])[0] as f64 * PI;
    let open = behind(white([0.0; 3], UP, 1.0).with_light(lamp.clone()));
    let half = behind(white([0.0; 3], UP, 1.0).with_light(lamp).with_parallelogram(edge));
    rows.push(row("a straight edge before the middle of a light: half of it", 0.5, half / open, 1e-3));
    rows
}

fn page() -> String {
    let mut page = String::from(
        "# Measured deviations\n\n\
         What firstlight renders, beside what it should be on paper. Irradiance is in lux for lights of candela, lux, \
         or radiance; lengths are in metres. A test makes this table and compares it with this page: whoever builds \
         firstlight measures the same digits.\n\n\
         | what | closed form | rendered | relative deviation | allowed |\n|---|---|---|---|---|\n",
    );
    for Row { what, truth, is, allowed } in rows() {
        let deviation = (is - truth).abs() / truth;
        assert!(deviation <= allowed, "{what}: {is} is not {truth}: off by {deviation:e}");
        writeln!(page, "| {what} | {truth:.7} | {is:.7} | {deviation:.1e} | {allowed:.0e} |")
            .expect("a string takes it");
    }
    page.push_str(
        "\nLights of a fixed number of points have the error of that number: it shrinks with more points, and is not \
         noise.\n",
    );
    page
}

#[test]
fn the_published_deviations_are_those_measured() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/deviations.md");
    let (measured, published) = (page(), std::fs::read_to_string(&path).unwrap_or_default());
    if measured != published && std::env::var_os("FIRSTLIGHT_BLESS").is_some() {
        std::fs::write(&path, &measured).expect("the book's folder is there");
    }
    assert_eq!(measured, published, "FIRSTLIGHT_BLESS=1 writes the page");
}

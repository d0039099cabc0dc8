//! Materials of all kinds, on shapes of all kinds: every renderer has the same picture, and integrated light is that of
//! many points.

use firstlight::*;

use crate::buffers::scene;
use crate::converged::displayed;
use crate::scenes::{bits, every_ray, one_thread, picture};

/// Balls, a torus, a mesh and a floor, between an area light, a ball of light, a lamp and a sun.
fn every_kind(samples: &str) -> Scene {
    scene(&format!(
        r#"
        [render]
        width = 72
        height = 40
        antialiasing = 3
        ambient = {{ up = [0.2, 0.25, 0.3], down = [0.1, 0.08, 0.05] }}
        samples = {samples}
        [camera]
        position = [0, 2.5, 7]
        look_at = [0, 0.6, 0]
        fov_y_deg = 28
        [[light.rectangle]]
        center = [-2, 4, 2]
        e0 = [1.5, 0, 0]
        e1 = [0, 0.8, -0.8]
        strength = 6
        sides = "both"
        [[light.sphere]]
        center = [2.5, 2.5, 1.5]
        radius = 0.5
        strength = 3
        color = [0.6, 0.8, 1]
        [[light.point]]
        position = [0, 3, 4]
        strength = 0.3
        [[light.directional]]
        direction = [0.3, -1, -0.2]
        strength = 0.2
        [texture.checkerboard.two]
        counts = [7, 5]
        colors = [[0.9, 0.7, 0.3], [0.2, 0.3, 0.6]]
        [texture.checkerboard.strengths]
        counts = [6, 4]
        colors = [1, 0]
        [material.metallic-roughness.gold]
        base_color = [1, 0.77, 0.34]
        metallic = 1
        roughness = 0.35
        [material.metallic-roughness.plastic]
        base_color = [0.1, 0.3, 0.7]
        roughness = 0.2
        specular_color = [1, 0.8, 0.6]
        [material.metallic-roughness.lacquer]
        base_color = [0.6, 0.02, 0.02]
        roughness = 0.7
        clearcoat = 1
        clearcoat_roughness = 0.25
        [material.metallic-roughness.painted]
        base_color = {{ texture = "two" }}
        metallic = 0.5
        roughness = 0.6
        clearcoat = {{ texture = "strengths" }}
        clearcoat_roughness = 0.4
        emissive = [0.02, 0.05, 0.01]
        [material.metallic-roughness.mixed]
        base_color = {{ texture = "two" }}
        metallic = {{ texture = "strengths" }}
        roughness = 0.5
        occlusion = 0.5
        [material.unlit.sign]
        color = [0.3, 0.5, 0.1]
        [[plane]]
        point = [0, 0, 0]
        normal = [0, 1, 0]
        material = "mixed"
        [[sphere]]
        center = [-2.2, 0.6, 0]
        radius = 0.6
        material = "gold"
        [[sphere]]
        center = [-0.75, 0.6, 0]
        radius = 0.6
        material = "plastic"
        [[sphere]]
        center = [0.75, 0.6, 0]
        radius = 0.6
        material = "lacquer"
        [[sphere]]
        center = [2.2, 0.6, 0]
        radius = 0.6
        material = "painted"
        [[torus]]
        center = [0, 0.3, 1.6]
        major_radius = 0.5
        minor_radius = 0.2
        material = "lacquer"
        [[rectangle]]
        center = [-1.6, 1.6, -1]
        size = [1, 0.5]
        normal = [0.2, 0, 1]
        material = "sign"
        [[mesh]]
        positions = [[1, 0.1, 1.8], [2, 0.1, 1.6], [1.6, 0.9, 1.5], [1.4, 0.2, 2.2]]
        triangles = [[0, 1, 2], [0, 3, 2], [3, 1, 2]]
        smooth_deg = 80
        material = "painted"
        "#
    ))
}

#[test]
fn every_renderer_has_the_same_picture_of_materials_of_all_kinds() {
    let scene = every_kind("9");
    let plain = picture(&scene, &RenderSettings { reference: true, ..one_thread() });
    for simd in SimdLevel::available() {
        let threads = std::num::NonZeroUsize::new(2);
        assert!(bits(&plain) == bits(&picture(&scene, &RenderSettings { simd, threads, ..every_ray() })), "{simd:?}");
    }
}

#[test]
fn integrated_light_on_materials_of_all_kinds_is_that_of_many_points() {
    let (scene, many) = (every_kind("\"exact\""), every_kind("1024"));
    let (found, truth) = (picture(&scene, &one_thread()), picture(&many, &every_ray()));
    let mut squares = 0.0;
    let mut over = 0;
    for (found, truth) in found.pixels.iter().zip(&truth.pixels) {
        let [found, truth] = [*found, *truth].map(|pixel| displayed(&scene, pixel));
        let off = (0..3).map(|k| (found[k] - truth[k]).abs()).fold(0.0, f64::max);
        squares += off * off;
        over += usize::from(off > 1.0);
    }
    let rms = (squares / found.pixels.len() as f64).sqrt();
    assert!(rms < 0.2, "{rms} steps");
    assert!(over * 100 < found.pixels.len(), "{over} pixels are more than a step off");
}

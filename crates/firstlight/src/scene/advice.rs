//! What may surprise whoever looks at the picture of a compiled scene. Nothing of it is an error: a scene may well want
//! it so.

use pxfm::{f_acos, f_asin};

use super::geometry::{Geometry, PlacedTarget};
use super::{Scene, SceneDesc};
use crate::camera::Projection;
use crate::context::{CompileContext, show};
use crate::light::{Area, LightDesc, LightKind, Spot};
use crate::math::DVec3;
use crate::shape::Solid;

/// Camera rays along each side of the picture that look for something: first few, then many.
const RAYS: [u32; 2] = [24, 256];

/// Says what the scene as a whole may surprise with. `desc` is what it was made from, completed.
pub(super) fn advise(cx: &mut CompileContext, scene: &Scene, desc: &SceneDesc) {
    let seen = sees_something(scene);
    if scene.geometry.surfaces.is_empty() {
        if !seen {
            cx.advise("", "the scene has no shapes: its picture is the background", None);
        }
        return;
    }
    advise_light(cx, scene);
    if !seen && (scene.geometry.bounds().is_some() || !scene.geometry.unbounded.is_empty()) {
        advise_view(cx, scene, desc);
    }
    advise_directions(cx, scene);
}

/// Advises if a reflectance is more than all.
pub(super) fn advise_reflectance(cx: &mut CompileContext, field: &str, color: [f64; 3]) {
    let most = color.into_iter().fold(0.0, f64::max);
    if most > 1.0 {
        let hint = match most {
            2.0..=255.0 => "if these are bytes, write \"#rrggbb\", or divide them by 255",
            _ => "a reflectance is 0 to 1; a light has its strength",
        };
        cx.advise(field, format!("{} reflects more light than there is", show(&color)), Some(hint));
    }
}

/// Whether any of a grid of camera rays meets a shape or a light.
fn sees_something(scene: &Scene) -> bool {
    RAYS.into_iter().any(|rays| {
        let [columns, rows] = [scene.width, scene.height].map(|side| side.min(rays));
        // Through the middles of cells
        let at = |i: u32, cells: u32, side: u32| (i as f32 + 0.5) * (side as f32 / cells as f32);
        let mut places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        places.any(|(column, row)| {
            let (x, y) = (at(column, columns, scene.width), at(row, rows, scene.height));
            scene.intersect(&scene.camera.ray(x, y, 1.0).0).is_some()
        })
    })
}

/// Advises if every surface is black.
fn advise_light(cx: &mut CompileContext, scene: &Scene) {
    let shines = |c: &crate::color::Rgb| c.r > 0.0 || c.g > 0.0 || c.b > 0.0;
    if shines(&scene.ambient) || scene.lights.iter().any(|light| shines(&light.intensity)) {
        return;
    }
    let message = match scene.lights.len() {
        0 => "there is no light, and no ambient light: every surface is black",
        _ => "no light sends anything, and there is no ambient light: every surface is black",
    };
    let hint = "add a [[light.directional]] with a direction, or ambient to [render]";
    cx.advise("light", message, Some(hint));
}

/// Advises that nothing is in the picture.
fn advise_view(cx: &mut CompileContext, scene: &Scene, desc: &SceneDesc) {
    let name = scene.summary.camera.as_str();
    let path = if name.is_empty() { "camera".to_owned() } else { format!("camera.{name}") };
    if scene.geometry.surfaces.iter().all(|surface| !surface.visible) {
        cx.advise(&path, "nothing is in the picture: every shape has visible = false", None);
        return;
    }
    let frame = scene.camera.frame();
    let (eye, forward) = (frame.position, frame.forward.as_dvec3());
    let bounds = scene.geometry.bounds().map(|bounds| bounds.map(|corner| corner + scene.origin));
    let (least, most) = match bounds {
        Some(bounds) => (show(&bounds[0].to_array()), show(&bounds[1].to_array())),
        None => (String::new(), String::new()),
    };
    let lies = if least.is_empty() { String::new() } else { format!(", shapes lie from {least} to {most}") };
    let behind = bounds.is_some_and(|bounds| corners(bounds).all(|c| (c - eye).dot(forward) <= 0.0));
    let eye = show(&eye.to_array());
    let message = match behind && scene.geometry.unbounded.is_empty() {
        true => format!("nothing is in the picture: the camera at {eye} has everything behind it{lies}"),
        false => format!("no camera ray of {0} x {0} meets anything: the camera is at {eye}{lies}", RAYS[1]),
    };
    let hint = match desc.cameras.iter().find(|(known, _)| known == name) {
        Some((_, camera)) if camera.projection == Projection::Orthographic => {
            "position, look_at and height say what it sees; what is behind position is not seen"
        }
        _ => "position and look_at say where it is and what it looks at",
    };
    cx.advise(&path, message, Some(hint));
}

/// Advises if a light shines away from everything.
fn advise_directions(cx: &mut CompileContext, scene: &Scene) {
    // In scene order: kind by kind
    let mut numbers = LightDesc::KINDS.iter().map(|kind| (*kind, 0)).collect::<Vec<_>>();
    for (light, (kind, ..)) in scene.lights.iter().zip(&scene.summary.lights) {
        let Some((_, number)) = numbers.iter_mut().find(|(known, _)| known == kind) else { continue };
        let path = format!("light.{kind}[{number}]");
        *number += 1;
        match &light.kind {
            LightKind::Area(area) if faces_away(area, &scene.geometry) => {
                let message = "its front faces away from everything: it lights nothing";
                let hint = match kind {
                    &"rectangle" => "its front is where e0 x e1 points: exchange e0 and e1, or write sides = \"both\"",
                    _ => "turn its normal around, or write sides = \"both\"",
                };
                cx.advise(&path, message, Some(hint));
            }
            LightKind::Spot(spot) if misses(spot, &scene.geometry) => {
                let message = "everything is outside of its cone: it lights nothing";
                cx.advise(&path, message, Some("position and look_at say where it is and where it shines"));
            }
            _ => {}
        }
    }
}

/// Whether all shapes are behind a light that shines to one side.
fn faces_away(area: &Area, geometry: &Geometry) -> bool {
    let Some((p, n)) = area.front() else { return false };
    // By the length of coordinates, for what touches the light's plane
    let room = |q: DVec3| 1e-6 * (q - p).abs().max_element().max(p.abs().max_element() * 1e-6);
    let is_behind = |q: DVec3| (q - p).dot(n) <= room(q);
    let planes = geometry.unbounded.iter().map(|placed| &geometry.placed[*placed as usize]);
    let mut planes = planes.filter_map(|placed| match placed.target {
        PlacedTarget::Solid(solid) => match &geometry.solids[solid as usize] {
            Solid::Plane(plane) => Some((placed.placement, plane.place())),
            _ => None,
        },
        _ => None,
    });
    geometry.bounds().into_iter().flat_map(corners).all(is_behind)
        && planes.all(|(placement, (point, normal))| {
            let normal = placement.normal(normal).normalize_or_zero();
            let point = placement.world_from_object.transform_point3(point);
            normal.cross(n).length() < 1e-6 && is_behind(point)
        })
}

/// Whether all shapes are outside of a cone of light.
fn misses(spot: &Spot, geometry: &Geometry) -> bool {
    let Some([low, high]) = geometry.bounds().filter(|_| geometry.unbounded.is_empty()) else { return false };
    let (radius, way) = ((high - low).length() * 0.5, (low + high) * 0.5 - spot.position.as_dvec3());
    let distance = way.length();
    if distance <= radius {
        return false;
    }
    let angle = f_acos((way.dot(spot.axis.as_dvec3()) / distance).clamp(-1.0, 1.0));
    angle > f_acos((1.0 - spot.outer as f64).clamp(-1.0, 1.0)) + f_asin(radius / distance)
}

/// The corners of a box.
fn corners([low, high]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |corner| {
        let pick = |bit: u32, a: f64, b: f64| if corner >> bit & 1 == 1 { b } else { a };
        DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    })
}

#[cfg(test)]
mod tests {
    use crate::context::MemoryAssets;
    use crate::scene::text::Parsed;
    use crate::scene::{CompileOptions, ModelSettings, SceneDesc};

    /// What is said of a scene, strictly compiled.
    fn said(text: &str) -> Vec<String> {
        said_with(text, &MemoryAssets::default())
    }

    fn said_with(text: &str, assets: &MemoryAssets) -> Vec<String> {
        let options = CompileOptions { strict: true, ..CompileOptions::default() };
        let compiled = SceneDesc::parse("s.toml", text.as_bytes(), assets).compile(assets, &options);
        let compiled = compiled.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(compiled.warnings, []);
        compiled.advice.iter().map(ToString::to_string).collect()
    }

    const BALL: &str = "[camera]\nposition = [0, 0, 5]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n";
    const LIGHT: &str = "[[light.directional]]\ndirection = [-1, -1, -1]\n";

    #[test]
    fn a_scene_as_it_should_be_needs_no_advice() {
        assert_eq!(said(&format!("{BALL}{LIGHT}")), [""; 0]);
        assert_eq!(said(&format!("{BALL}[render]\nambient = 0.1\n")), [""; 0]);
        for builtin in crate::scene::builtin_scenes() {
            assert_eq!(said(builtin.text), [""; 0], "{}", builtin.name);
        }
    }

    #[test]
    fn a_scene_in_the_dark() {
        let hint = "add a [[light.directional]] with a direction, or ambient to [render]";
        assert_eq!(
            said(BALL),
            [format!("s.toml:1:1: light: there is no light, and no ambient light: every surface is black; {hint}")]
        );
        let dark = format!("{BALL}[[light.point]]\nposition = [0, 3, 0]\nstrength = 0\n");
        let light = "light: no light sends anything, and there is no ambient light: every surface is black";
        assert_eq!(said(&dark).len(), 1);
        assert!(said(&dark)[0].ends_with(&format!("{light}; {hint}")), "{:?}", said(&dark));
        assert_eq!(
            said("[camera]\nposition = [0, 0, 5]\n"),
            ["s.toml:1:1: the scene has no shapes: its picture is the background"]
        );
    }

    #[test]
    fn nothing_in_the_picture() {
        let away = BALL.replace("[0, 0, 5]", "[0, 0, 5]\nlook_at = [0, 0, 9]") + LIGHT;
        assert_eq!(
            said(&away),
            ["s.toml:1:1: camera: nothing is in the picture: the camera at [0, 0, 5] has everything behind it, \
              shapes lie from [-1, -1, -1] to [1, 1, 1]; position and look_at say where it is and what it looks at"]
        );
        let past = BALL.replace("[0, 0, 5]", "[0, 0, 5]\nlook_at = [0, 5, 0]") + LIGHT;
        assert_eq!(
            said(&past),
            ["s.toml:1:1: camera: no camera ray of 256 x 256 meets anything: the camera is at [0, 0, 5], shapes \
              lie from [-1, -1, -1] to [1, 1, 1]; position and look_at say where it is and what it looks at"]
        );
        // As small as a pixel, but there
        let small = BALL.replace("radius = 1", "radius = 0.02") + LIGHT;
        assert_eq!(said(&small), [""; 0]);
        let unseen = BALL.replace("radius = 1", "radius = 1\nvisible = false") + LIGHT;
        assert_eq!(said(&unseen), ["s.toml:1:1: camera: nothing is in the picture: every shape has visible = false"]);
    }

    #[test]
    fn lights_that_shine_away_from_everything() {
        let lamp = |e0: &str, e1: &str| {
            format!("{BALL}{LIGHT}[[light.rectangle]]\ncenter = [0, 3, 0]\ne0 = {e0}\ne1 = {e1}\n")
        };
        let up = lamp("[0, 0, 1]", "[1, 0, 0]");
        assert_eq!(
            said(&up),
            ["s.toml:8:1: light.rectangle[0]: its front faces away from everything: it lights nothing; its front \
              is where e0 x e1 points: exchange e0 and e1, or write sides = \"both\""]
        );
        assert_eq!(said(&lamp("[1, 0, 0]", "[0, 0, 1]")), [""; 0]);
        assert_eq!(said(&format!("{up}sides = \"both\"\n")), [""; 0]);
        // Above it a ceiling, a plane above, a plane below
        assert_eq!(said(&format!("{up}[[parallelogram]]\np = [0, 4, 0]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\n")), [""; 0]);
        assert_eq!(said(&format!("{up}[[plane]]\npoint = [0, 4, 0]\n")), [""; 0]);
        assert_eq!(said(&format!("{up}[[plane]]\npoint = [0, -1, 0]\n")).len(), 1);
        assert_eq!(said(&format!("{up}[[plane]]\npoint = [0, -1, 0]\nnormal = [0.1, 1, 0]\n")), [""; 0]);
        let disk = format!("{BALL}{LIGHT}[[light.disk]]\ncenter = [0, 3, 0]\nnormal = [0, 1, 0]\nradius = 1\n");
        assert!(said(&disk)[0].contains("light.disk[0]: its front faces away from everything"), "{:?}", said(&disk));
        let spot =
            |at: &str| format!("{BALL}{LIGHT}[[light.spot]]\nposition = [0, 3, 0]\nlook_at = {at}\ncone_deg = 20\n");
        assert!(said(&spot("[9, 3, 0]"))[0].contains("light.spot[0]: everything is outside of its cone"));
        assert_eq!(said(&spot("[0.5, 0, 0]")), [""; 0]);
    }

    #[test]
    fn reflectances_above_one() {
        let material = |color: &str| format!("{BALL}{LIGHT}[material.phong.m]\n{color}\n");
        assert_eq!(
            said(&material("diffuse = [255, 128, 0]")),
            ["s.toml:9:11: material.phong.m.diffuse: [255, 128, 0] reflects more light than there is; if these are \
              bytes, write \"#rrggbb\", or divide them by 255"]
        );
        assert_eq!(
            said(&material("specular = 1.5")),
            ["s.toml:9:12: material.phong.m.specular: [1.5, 1.5, 1.5] reflects more light than there is; a \
              reflectance is 0 to 1; a light has its strength"]
        );
        assert_eq!(said(&material("diffuse = 1")), [""; 0]);
        let points = |colors: &str| {
            said(&format!("{BALL}{LIGHT}[[point_set]]\npositions = [[0, 0, 0], [1, 0, 0]]\ncolors = {colors}\n"))
        };
        assert!(
            points("[[0, 0, 0], [0, 200, 0]]")[0].contains("point_set[0]: the colours of its vertices go up to 200: ")
        );
        let are_bytes =
            |most: &str| points(&format!("[[0, 0, 0], [{most}, 0, 0]]"))[0].contains("; are they 0 to 255?");
        assert_eq!(["1.5", "2", "255", "256"].map(are_bytes), [false, true, true, false]);
        assert_eq!(points("[[0, 0, 0], [0, 1, 0]]"), [""; 0]);
    }

    #[test]
    fn angles_that_look_like_radians() {
        let fov = |deg: &str| {
            said(&format!("{}{LIGHT}", BALL.replace("[0, 0, 5]", &format!("[0, 0, 5]\nfov_y_deg = {deg}"))))
        };
        assert_eq!(
            fov("0.785"),
            ["s.toml:3:13: camera.fov_y_deg: 0.785 degrees are little: as radians they would be 44.98 degrees; \
                 angles are in degrees"]
        );
        assert_eq!((fov("1"), fov("3.5")), (vec![], vec![]));
        let spot = |more: &str| said(&format!("{BALL}{LIGHT}[[light.spot]]\nposition = [0, 3, 0]\n{more}\n"));
        assert!(
            spot("cone_deg = 0.6981")[0]
                .contains("cone_deg: 0.6981 degrees are little: as radians they would be 40.00")
        );
        assert!(spot("inner_cone_deg = 0.5")[0].contains("inner_cone_deg: 0.5 degrees are little"));
        let turned = |turn: &str| {
            said(&format!("{}{LIGHT}", BALL.replace("radius = 1", &format!("radius = 1\ntransform = {{ {turn} }}"))))
        };
        assert_eq!(
            turned("rotate_deg = [0, 1.5708, 0]"),
            ["s.toml:6:28: sphere[0].transform.rotate_deg: [0, 1.5708, 0] looks like radians: in degrees it would \
              be [0, 90, 0]; angles are in degrees"]
        );
        assert!(turned("rotate_axis = [0, 1, 0], angle_deg = -3.14159")[0].contains("in degrees it would be -180"));
        assert_eq!(turned("rotate_deg = [0, 1.5, 0]"), [""; 0]);
        assert_eq!(turned("rotate_deg = [0.3, 1.5708, 0]"), [""; 0]);
        assert_eq!(turned("rotate_deg = [0, 45, 0]"), [""; 0]);
    }

    const POINT_MESH: &str = "v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n";

    #[test]
    fn meshes_without_size() {
        let mesh = |positions: &str| {
            said(&format!("{BALL}{LIGHT}[[mesh]]\npositions = {positions}\ntriangles = [[0, 1, 2]]\n"))
        };
        let told = mesh("[[1, 2, 3], [1, 2, 3], [1, 2, 3]]");
        assert!(told[0].contains("it has no size, all of its 1 triangles are at [1, 2, 3]: nothing of it"), "{told:?}");
        let told = mesh("[[1, 2, 3], [2, 3, 4], [3, 4, 5]]");
        assert!(told[0].contains("none of its 1 triangles has an area"), "{told:?}");
        assert_eq!(mesh("[[1, 2, 3], [2, 3, 4], [3, 4, 6]]"), [""; 0]);
    }

    #[test]
    fn models_are_spoken_of_by_their_names() {
        let of = |obj: &str| {
            let mut assets = MemoryAssets::default();
            assets.files.insert("a.obj".into(), obj.into());
            let parsed = Parsed::of_model("folder/a.obj", "a.obj", &ModelSettings::default());
            let options = CompileOptions { light: true, ..CompileOptions::default() };
            match parsed.compile(&assets, &options) {
                Ok(compiled) => {
                    let all = compiled.warnings.iter().chain(&compiled.advice);
                    all.map(ToString::to_string).collect::<Vec<_>>()
                }
                Err(error) => error.faults.iter().map(ToString::to_string).collect(),
            }
        };
        assert_eq!(
            of(POINT_MESH),
            ["folder/a.obj: it has no size, all of its 1 triangles are at [1, 2, 3]: nothing of it can be seen; \
              look at it in the program that wrote it"]
        );
        assert_eq!(
            of("v nan 2 3\nv 1 2 inf\nv 1 nan 3\nf 1 2 3\n"),
            ["folder/a.obj: none of its 1 triangles has a corner that is finite: nothing of it can be seen; look \
              at it in the program that wrote it"]
        );
        assert_eq!(
            of("v 1 2 3\n"),
            ["folder/a.obj: holds 1 points and no faces; points are shown by [[point_set]], as spheres; PLY files \
                 can hold them"]
        );
        assert_eq!(
            of("v 1 2 x\n"),
            ["folder/a.obj:1: v: `x` where number 3 is needed; a position has 3 numbers, texture coordinates have \
                 1 to 3, a normal has 3"]
        );
        assert_eq!(
            of("glTF\u{2}\0\0\0"),
            ["folder/a.obj: looks like a binary glTF model (GLB), not like a mesh; that kind is not read yet; \
                 export it as PLY, STL or OBJ"]
        );
        let many: String = (0..9).map(|i| format!("usemtl m{i}\nf 1 2 3\n")).collect();
        assert_eq!(
            of(&format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl {}\nf 1 2 3\n{many}", "x".repeat(100))),
            ["folder/a.obj: names materials that are not described: \"xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...\", \
              \"m0\", \"m1\", \"m2\", \"m3\", \"m4\" and 4 more; their faces have the mesh's own material; a scene \
              describes one as [material.phong.NAME]"]
        );
    }
}

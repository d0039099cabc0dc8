//! What may surprise whoever looks at the picture of a compiled scene. Nothing of it is an error: a scene may well want
//! it so.

use pxfm::{f_acos, f_asin};

use super::geometry::{Geometry, PlacedTarget};
use super::{Scene, SceneDesc};
use crate::camera::Projection;
use crate::context::{CompileContext, show};
use crate::light::{Area, LightDesc, LightKind, Spot};
use crate::material::Material;
use crate::math::{DVec3, Ray, UNIT_ROUNDOFF};
use crate::parallel;
use crate::shape::{RayDifferential, Solid};

/// Camera rays along each side of the picture that look for something first: most often they find it.
const FEW_RAYS: u64 = 24;
/// Of more camera rays than this a regular part is asked whether anything is there.
const MOST_RAYS: u64 = 1 << 25;
/// Pixels around what is projected, for the rounding of rays.
const AROUND: f64 = 1.0;

/// Says what the scene as a whole may surprise with. `desc` is what it was made from, completed; `has_studio`: its
/// lights are those of a studio, which nobody placed.
pub(super) fn advise(cx: &mut CompileContext, scene: &Scene, desc: &SceneDesc, has_studio: bool) {
    let search = Search::of(scene);
    if scene.geometry.surfaces.is_empty() {
        if !search.met {
            cx.advise("", "the scene has no shapes: its picture is the background", None);
        }
        return;
    }
    advise_light(cx, scene);
    advise_emission(cx, scene, desc);
    advise_catchers(cx, scene);
    // The shadows on catchers may be what is to be seen, but not where a camera was found for what casts them
    let may_show_shadows = scene.catchers.is_some()
        && (scene.choices.framing.is_none() || scene.geometry.surfaces.iter().all(|surface| !surface.visible));
    if !search.met && !may_show_shadows && (scene.geometry.bounds().is_some() || !scene.geometry.unbounded.is_empty()) {
        advise_view(cx, scene, desc, &search);
    }
    if !has_studio {
        advise_directions(cx, scene);
    }
    advise_digits(cx, scene);
}

/// Advises if shadows on catchers darken what is black.
fn advise_catchers(cx: &mut CompileContext, scene: &Scene) {
    if scene.catchers.is_some() && !scene.transparent && scene.background.is_black() {
        let message = "shadow catchers darken what is behind them, and the background is black";
        cx.advise("render.background", message, Some("with transparent = true the shadow is the picture's alpha"));
    }
}

/// Places are known well enough if they are known to this part of a pixel.
const PART_OF_A_PIXEL: f64 = 1e-4;
/// And they are if they are known as well as those that are no farther from where coordinates are counted than this
/// many times their distance from the camera: 32 bits hold no more of a picture of many rows.
const FAR_VIEWS: f64 = 16.0;

/// Advises if 32 bits are too few for much of what the camera sees.
fn advise_digits(cx: &mut CompileContext, scene: &Scene) {
    let (frame, [_, half]) = (scene.camera.frame(), scene.camera.film_half_size().map(f64::from));
    let [across, down] = [scene.width, scene.height].map(|side| FEW_RAYS.min(side.into()));
    let at = |i: u64, cells: u64, side: u32| ((i as f64 + 0.5) * f64::from(side) / cells as f64) as f32;
    let place = |cell: u64| {
        let (x, y) = (at(cell % across, across, scene.width), at(cell / across, down, scene.height));
        let ray = scene.camera.local_ray(x, y, 1.0).0;
        let hit = scene.intersect_local(&ray)?;
        let p = ray.o.as_dvec3() + ray.d.as_dvec3() * hit.t;
        // How wide a pixel is there
        let depth = match scene.camera.projection() {
            Projection::Perspective => frame.near + frame.forward.as_dvec3().dot(p - frame.start.as_dvec3()),
            Projection::Orthographic => 1.0,
        };
        let rounding = p.abs().max_element() * f64::from(UNIT_ROUNDOFF);
        let pixel = depth * 2.0 * half / f64::from(scene.height);
        let distance = (p - frame.position + frame.origin).length();
        let enough = (PART_OF_A_PIXEL * pixel).max(FAR_VIEWS * distance * f64::from(UNIT_ROUNDOFF));
        Some((rounding > enough, [rounding, pixel]))
    };
    let places: Vec<(bool, [f64; 2])> = (0..across * down).filter_map(place).collect();
    let coarse = || places.iter().filter_map(|(is_coarse, sizes)| is_coarse.then_some(sizes));
    let Some([rounding, pixel]) = coarse().max_by(|a, b| (a[0] / a[1]).total_cmp(&(b[0] / b[1]))) else { return };
    // Something that is in the way of the lens is not what the picture is about
    if coarse().count() * 10 > places.len() {
        let message = format!(
            "it sees what is known to {rounding:.1e} m, where a pixel is {pixel:.1e} m wide: 32 bits have no more \
             digits so far from where coordinates are counted"
        );
        let hint = "coordinates are counted from what the camera of the scene looks at: let its look_at be near to \
                    what is seen, or move the scene to the origin";
        cx.advise("camera", message, Some(hint));
    }
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

/// Whether any camera ray meets a shape or a light.
struct Search {
    met: bool,
    /// How many were asked, where those of the few that go first met nothing.
    rays: u64,
    /// Whether these were all that could meet anything.
    is_all: bool,
    /// Whether any of what a camera can see may lie within the picture.
    is_framed: bool,
}

impl Search {
    /// Asks few camera rays, then all that can meet anything.
    fn of(scene: &Scene) -> Search {
        let sides = [scene.width, scene.height].map(|side| [0, side]);
        let [few_wide, few_high] = [scene.width, scene.height].map(|side| FEW_RAYS.min(side.into()));
        if meets(scene, sides, [few_wide, few_high]) {
            return Search { met: true, rays: few_wide * few_high, is_all: false, is_framed: true };
        }
        let Some(sides) = framed(scene) else {
            return Search { met: false, rays: 0, is_all: true, is_framed: false };
        };
        let all = sides.map(|[start, end]| u64::from(end - start) * u64::from(scene.antialiasing));
        // A square grid of as many as may be asked, where that is not enough for all
        let most = MOST_RAYS.isqrt();
        let is_all = all[0] * all[1] <= MOST_RAYS;
        let cells = if is_all { all } else { all.map(|side| side.min(most)) };
        Search { met: meets(scene, sides, cells), rays: cells[0] * cells[1], is_all, is_framed: true }
    }
}

/// Whether a camera ray meets something, be it only a veil.
fn shows(scene: &Scene, ray: &Ray) -> bool {
    let end = scene.intersect_local(ray);
    end.is_some() || scene.first_opacity(ray, &RayDifferential::default(), None) > 0.0
}

/// Whether a ray through the middle of any of so many cells, across and down, of a part of the picture meets something.
fn meets(scene: &Scene, sides: [[u32; 2]; 2], cells: [u64; 2]) -> bool {
    let at = |i: u64, axis: usize| {
        let [start, end] = sides[axis].map(f64::from);
        (start + (i as f64 + 0.5) * (end - start) / cells[axis] as f64) as f32
    };
    let misses = |row: usize| {
        let y = at(row as u64, 1);
        (0..cells[0]).all(|column| !shows(scene, &scene.camera.local_ray(at(column, 0), y, 1.0).0))
    };
    !parallel::all(cells[1] as usize, 4, misses)
}

/// The columns and the rows of pixels that what can be seen lies in, or all where that is not known; `None` if nothing
/// lies in the picture.
fn framed(scene: &Scene) -> Option<[[u32; 2]; 2]> {
    let geometry = &scene.geometry;
    let all = [scene.width, scene.height].map(|side| [0, side]);
    let is_lamp_seen = |area: &&Area| area.visible;
    let lamps = scene.lights.iter().filter_map(|light| light.area()).filter(is_lamp_seen);
    let lamps = lamps.map(|area| area.shape.bounds()).reduce(|[low, high], [a, b]| [low.min(a), high.max(b)]);
    let is_shape_seen = geometry.surfaces.iter().any(|surface| surface.visible);
    // If any camera ray meets an infinite plane, so does a ray through a corner of the film: the condition is linear
    // over the film
    let [width, height] = all.map(|[_, end]| end as f32);
    let of_film = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)];
    let is_met = |(x, y): (f32, f32)| scene.intersect_local(&scene.camera.local_ray(x, y, 1.0).0).is_some();
    if is_shape_seen && !geometry.unbounded.is_empty() && of_film.into_iter().any(is_met) {
        return Some(all);
    }
    let boxes: Vec<_> = geometry.bounds().filter(|_| is_shape_seen).into_iter().chain(lamps).collect();
    let ahead = |p: DVec3| scene.camera.local_project(p).filter(|(_, depth)| *depth > 0.0);
    let seen = |corners: [DVec3; 2]| -> Option<[[u32; 2]; 2]> {
        let places: Vec<_> = self::corners(corners).filter_map(ahead).map(|(pixel, _)| pixel).collect();
        match places.len() {
            0 => return None,
            8 => {}
            // Partly behind the camera
            _ => return Some(all),
        }
        let side = |axis: usize, length: u32| {
            let [low, high] = places.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| {
                [low.min(place[axis]), high.max(place[axis])]
            });
            let within = |pixel: f64| pixel.clamp(0.0, f64::from(length)) as u32;
            let [start, end] = [within((low - AROUND).floor()), within((high + AROUND).ceil())];
            (start < end).then_some([start, end])
        };
        Some([side(0, scene.width)?, side(1, scene.height)?])
    };
    let joined = |a: [[u32; 2]; 2], b: [[u32; 2]; 2]| [0, 1].map(|i| [a[i][0].min(b[i][0]), a[i][1].max(b[i][1])]);
    boxes.into_iter().filter_map(seen).reduce(joined)
}

/// Advises if every surface is black.
fn advise_light(cx: &mut CompileContext, scene: &Scene) {
    let shines = |c: &crate::color::Rgb| c.r > 0.0 || c.g > 0.0 || c.b > 0.0;
    if !scene.ambient.is_black()
        || scene.lights.iter().any(|light| shines(&light.intensity))
        || scene.materials.iter().any(Material::is_emissive)
    {
        return;
    }
    let message = match scene.lights.len() {
        0 => "there is no light, and no ambient light: every surface is black",
        _ => "no light sends anything, and there is no ambient light: every surface is black",
    };
    let hint = "add a [[light.directional]] with a direction, or ambient to [render]";
    cx.advise("light", message, Some(hint));
}

/// Advises that surfaces that emit light are no lights.
fn advise_emission(cx: &mut CompileContext, scene: &Scene, desc: &SceneDesc) {
    let is_emissive = |(material, _): &(&Material, _)| !material.common.emissive.factor.is_black();
    let mut emissive = scene.materials.iter().zip(&desc.materials).filter(is_emissive).map(|(_, of)| of);
    let Some((name, first)) = emissive.next() else { return };
    let materials = match emissive.count() {
        0 => "the material emits".to_owned(),
        1 => "this material and another one emit".to_owned(),
        more => format!("this material and {more} others emit"),
    };
    let hint = "add a light of the same shape, with visible = false, where they should light the scene";
    let path = format!("material.{}.{name}.emissive", first.kind());
    cx.advise(&path, format!("{materials} light that is seen, and that lights nothing"), Some(hint));
}

/// Advises that nothing is in the picture.
fn advise_view(cx: &mut CompileContext, scene: &Scene, desc: &SceneDesc, search: &Search) {
    let name = scene.summary.camera.as_str();
    let path = if name.is_empty() { "camera".to_owned() } else { format!("camera.{name}") };
    if scene.geometry.surfaces.iter().all(|surface| !surface.visible) {
        cx.advise(&path, "nothing is in the picture: every shape has visible = false", None);
        return;
    }
    let frame = scene.camera.frame();
    let (eye, forward) = (frame.position, frame.forward.as_dvec3());
    // Without the ground of a studio
    let bounds = scene.summary.bounds.map(|bounds| bounds.map(DVec3::from));
    let (least, most) = match bounds {
        Some(bounds) => (show(&bounds[0].to_array()), show(&bounds[1].to_array())),
        None => (String::new(), String::new()),
    };
    let lies = if least.is_empty() { String::new() } else { format!(", shapes lie from {least} to {most}") };
    let behind = bounds.is_some_and(|bounds| corners(bounds).all(|c| (c - eye).dot(forward) <= 0.0));
    let eye = show(&eye.to_array());
    let message = match behind && scene.geometry.unbounded.is_empty() {
        true => format!("nothing is in the picture: the camera at {eye} has everything behind it{lies}"),
        false => {
            let of = if search.is_all { String::new() } else { format!(" of {} that were asked", search.rays) };
            let thin = match search.is_framed {
                true => "; what is thinner than the distance between camera rays can fall between them",
                false => "",
            };
            format!("no camera ray{of} meets anything: the camera is at {eye}{lies}{thin}")
        }
    };
    let hint = match desc.cameras.iter().find(|(known, _)| known == name) {
        // The camera was found for it, and looks at it
        _ if scene.choices.framing.is_some() => {
            "more pixels (--size), more camera rays in each (--aa) or another side (--view) may show it"
        }
        Some((_, camera)) if camera.projection == Projection::Orthographic => {
            "position, look_at and height say what it sees; what is behind position is not seen"
        }
        _ if search.is_framed => {
            "position and look_at say where it is and what it looks at; more pixels or more camera rays in each \
             (antialiasing) may show what is thin"
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
    use crate::scene::{CompileOptions, Framing, SceneDesc, StudioSettings, View};

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
    fn emission_lights_nothing() {
        let shining = "[material.phong.a]\nemissive = 2\n[material.unlit.b]\nemissive = [0, 1, 0]\n\
                       [material.unlit.c]\ncolor = 3\n";
        let hint = "add a light of the same shape, with visible = false, where they should light the scene";
        let text = "this material and another one emit light that is seen, and that lights nothing";
        // Without lights they are not black either
        for (light, line) in [(LIGHT, 9), ("", 7)] {
            let expected = format!("s.toml:{line}:12: material.phong.a.emissive: {text}; {hint}");
            assert_eq!(said(&format!("{BALL}{light}{shining}")), [expected]);
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
            ["s.toml:1:1: camera: no camera ray meets anything: the camera is at [0, 0, 5], shapes \
              lie from [-1, -1, -1] to [1, 1, 1]; position and look_at say where it is and what it looks at"]
        );
        // As small as a pixel, but there
        let small = BALL.replace("radius = 1", "radius = 0.02") + LIGHT;
        assert_eq!(said(&small), [""; 0]);
        // Smaller than a pixel: all 16 camera rays of each are asked, and meet it, or fall beside it
        // At 5 m, where half the film is tan(45 / 2 degrees) = sqrt(2) - 1 high
        let pixel = |i: f64, sub: f64| ((2.0 * (i + sub) / 1024.0 - 1.0) * (2f64.sqrt() - 1.0)) * 5.0;
        let tiny = |x: f64, radius: f64| {
            let center = format!("center = [{x}, {}, 0]", -pixel(300.0, 0.125));
            said(
                &(BALL.replace("center = [0, 0, 0]", &center).replace("radius = 1", &format!("radius = {radius}"))
                    + LIGHT),
            )
        };
        assert_eq!(tiny(pixel(700.0, 0.125), 1e-4), [""; 0]);
        let [told] = &tiny(pixel(700.0, 0.25), 1e-4)[..] else { panic!() };
        for words in [
            "camera: no camera ray meets anything: the camera is at [0, 0, 5]",
            "; what is thinner than the distance between camera rays can fall between them; position and look_at say",
            "more pixels or more camera rays in each (antialiasing) may show what is thin",
        ] {
            assert!(told.contains(words), "{told}");
        }
        let unseen = BALL.replace("radius = 1", "radius = 1\nvisible = false") + LIGHT;
        assert_eq!(said(&unseen), ["s.toml:1:1: camera: nothing is in the picture: every shape has visible = false"]);
    }

    #[test]
    fn a_veil_is_in_the_picture() {
        let veil = "[material.unlit.veil]\ncolor = 1\nalpha_mode = \"blend\"\nalpha = 0.2\n";
        let ball = BALL.replace("radius = 1", "radius = 1\nmaterial = \"veil\"");
        assert_eq!(said(&format!("{ball}{LIGHT}{veil}")), [""; 0]);
        let clear = said(&format!("{ball}{LIGHT}{}", veil.replace("0.2", "0")));
        assert!(clear.iter().any(|told| told.contains("no camera ray meets anything")), "{clear:?}");
    }

    #[test]
    fn a_model_that_falls_between_camera_rays() {
        // A needle along the line of sight of the camera that is found for it
        let mut assets = MemoryAssets::default();
        assets.files.insert("a.obj".into(), "v 0 0 0\nv 0 0 1\nv 1e-5 0 0\nf 1 2 3\n".into());
        let told = |antialiasing: u32| {
            let mut parsed = Parsed::of_model("a.obj", "a.obj", &StudioSettings::default());
            parsed.desc.render.antialiasing = antialiasing;
            (parsed.desc.render.width, parsed.desc.render.height) = (32, 32);
            let framing =
                Framing { view: View::from_name("right").expect("is one"), margin: 0.1, ..Framing::default() };
            let options =
                CompileOptions { studio: Some(StudioSettings::default()), framing, ..CompileOptions::default() };
            let compiled = parsed.compile(&assets, &options).unwrap_or_else(|error| panic!("{error}"));
            compiled.advice.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        let [words] = &told(2)[..] else { panic!("{:?}", told(2)) };
        assert!(words.starts_with("a.obj: camera: no camera ray meets anything: the camera is at ["), "{words}");
        let end = "can fall between them; more pixels (--size), more camera rays in each (--aa) or another side \
                   (--view) may show it";
        assert!(words.ends_with(end), "{words}");
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
    fn too_few_digits_for_what_is_seen() {
        // A ball at map coordinates, its camera, and what else there is
        let map = |camera: &str, rest: &str| {
            said(&format!(
                "{LIGHT}[camera]\n{camera}\n[[sphere]]\ncenter = [450000, 120, -5400000]\nradius = 2\n{rest}"
            ))
        };
        let near = "position = [450000, 123, -5399988]\nlook_at = [450000, 120, -5400000]";
        let (marker, floor) = (
            "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n",
            "[[disk]]\ncenter = [450000, 100, -5400000]\nradius = 1e5\n",
        );
        for rest in ["", marker, floor, "[[plane]]\n", &format!("{marker}{floor}[[plane]]\n")] {
            assert_eq!(map(near, rest), [""; 0], "{rest}");
        }
        // It looks at a place far beyond, and sees the ball before it
        let beyond = "position = [450000, 123, -5399988]\nlook_at = [450000, -4499877, -23399988]\nfov_y_deg = 20";
        assert_eq!(map(beyond, ""), [""; 0]);
        let told = map(beyond, marker);
        assert!(told.len() == 1 && told[0].contains("32 bits have no more digits so far from"), "{told:?}");
        // From far away a pixel is large
        let above = "position = [0, 5e6, 0]\nlook_at = [0, 0, -1e6]\nup = [0, 0, -1]\nfov_y_deg = 120";
        assert_eq!(map(above, "[[disk]]\ncenter = [0, 0, 0]\nradius = 1e7\n"), [""; 0]);
    }

    #[test]
    fn models_are_spoken_of_by_their_names() {
        let of = |obj: &str| {
            let mut assets = MemoryAssets::default();
            assets.files.insert("a.obj".into(), obj.into());
            let parsed = Parsed::of_model("folder/a.obj", "a.obj", &StudioSettings::default());
            let options = CompileOptions { studio: Some(StudioSettings::default()), ..CompileOptions::default() };
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
            ["folder/a.obj: looks like a binary glTF model (GLB), not like a mesh; give it as a model (.glb, .gltf), \
                 or name it as the file of a [[model]]"]
        );
        let many: String = (0..9).map(|i| format!("usemtl m{i}\nf 1 2 3\n")).collect();
        let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        assert_eq!(of(&format!("{corners}{many}")), [""; 0], "without an MTL file nothing is amiss");
        assert_eq!(
            of(&format!("mtllib a.mtl\n{corners}{many}")),
            [
                "folder/a.obj: \"a.mtl\": there is no such file of materials; its faces are of a light gray; an OBJ \
                 file needs its MTL files beside it",
                "folder/a.obj: 9 of its materials are described in no MTL file, \"m0\" for one; their faces are of a \
                 light gray"
            ]
        );
        // What is compiled twice, with the ground, is told once
        assert_eq!(of("v 0 0 0 255 0 0\nv 1 0 0 0 9 0\nv 0 1 0 0 0 9\nf 1 2 3\n").len(), 1);
    }
}

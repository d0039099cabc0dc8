//! The studio: what a model by itself is shown in.
//!
//! Three area lights, a ground that takes their shadow, ambient light that is brighter from above, and a light gray
//! background; or less of it. Lights are placed around the sphere that holds the model, and turned with the camera, so
//! that each view is lit from the same side.

use super::SceneDesc;
use crate::describe::node::{ReadText, Syntax};
use crate::describe::read::{Faults, Reader};
use crate::describe::{ColorDesc, FilePath, NameMap, Table, TextValue, node, table, words};
use crate::light::{DirectionalDesc, LightDesc, RectangleDesc};
use crate::material::{AmbientDesc, AmbientGradientDesc, MaterialDesc, ShadowCatcherDesc};
use crate::math::DVec3;
use crate::model::clay;
use crate::shape::{ModelDesc, ParallelogramDesc, ShapeDesc, UpAxis};

use super::DisplayEncoding;

words! {
    /// What a model by itself is lit by.
    pub enum Studio {
        /// Three area lights, and a ground that takes their shadow.
        Soft = "soft",
        /// Two directional lights, of which one casts shadows: the quickest.
        Hard = "hard",
        /// No light: every material shows its colour.
        Flat = "flat",
        /// As `soft`, with every material a light warm gray.
        Clay = "clay",
        /// The lights of the file, and nothing else.
        None = "none",
    }
}

table! {
    /// How a model by itself is shown.
    pub struct StudioSettings {
        /// What it is lit by.
        pub studio: Studio = Studio::Soft,
        /// Whether it stands on a ground that takes its shadow; without it, in the studios `soft` and `clay`.
        pub ground: Option<bool> = None,
        /// The axis of the file that points upwards; see [`ModelDesc::up`].
        pub up: Option<UpAxis> = None,
        /// Makes normals smooth where faces meet at less than this angle, in degrees, 0 to 180; see
        /// [`ModelDesc::smooth_deg`].
        pub smooth_deg: Option<f64> = None,
        /// The name of a variant of a glTF file.
        pub variant: Option<String> = None,
        /// The number of a scene of a glTF file, from 0 on.
        pub scene: Option<u32> = None,
        /// The name or number of an animation of a glTF file, which plays with the time of the scene; without it the
        /// model is at rest.
        pub animation: Option<String> = None,
        /// Whether the cameras of a glTF file are cameras of the scene.
        pub cameras: bool = false,
    }
}

/// The place that a studio is set up around.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    /// The middle of the sphere that holds the model, and its radius.
    pub middle: DVec3,
    pub radius: f64,
    /// The height of the lowest point of the model.
    pub lowest: f64,
}

/// The name of the material of the ground.
const GROUND: &str = "studio ground";
/// The name of the material of models in the studio `clay`.
const CLAY: &str = "studio clay";

/// A light of the studio: where it is seen from the model, how large it is in radii of the model, how far away, and the
/// share of white that it makes on a white wall that faces it.
struct Lamp {
    name: &'static str,
    /// From the direction of the camera to the right, and above the horizon, in degrees.
    azimuth_deg: f64,
    elevation_deg: f64,
    size: [f64; 2],
    strength: f64,
}

/// From the middle of the model to each light, in radii.
const DISTANCE: f64 = 4.0;

const KEY: Lamp = Lamp { name: "key", azimuth_deg: -50.0, elevation_deg: 48.0, size: [2.2, 2.2], strength: 0.75 };
const FILL: Lamp = Lamp { name: "fill", azimuth_deg: 55.0, elevation_deg: 30.0, size: [3.0, 2.6], strength: 0.22 };
const RIM: Lamp = Lamp { name: "rim", azimuth_deg: 160.0, elevation_deg: 42.0, size: [1.2, 2.0], strength: 0.45 };

/// Light from all around, above and below.
const AMBIENT: [f64; 2] = [0.42, 0.2];
/// What is behind models.
const BACKGROUND: f64 = 0.78;
/// How dark the ground is where no light of the studio arrives: 0 to 1.
const GROUND_ALPHA: f64 = 0.7;
/// Half of a side of the ground, in radii.
const GROUND_REACH: f64 = 14.0;
/// In display steps: larger than that of scenes, since nothing is compared with these pictures.
const TOLERANCE: f64 = 8.0;

impl Lamp {
    /// Towards the light, unit; `facing` is the azimuth of the camera.
    fn direction(&self, facing: f64) -> DVec3 {
        let (around, front) = pxfm::f_sincos(facing + self.azimuth_deg.to_radians());
        let (above, level) = pxfm::f_sincos(self.elevation_deg.to_radians());
        DVec3::new(around * level, above, front * level)
    }

    /// As an area light around the stage.
    fn rectangle(&self, stage: &Stage, facing: f64) -> LightDesc {
        let towards = self.direction(facing);
        let [width, height] = self.size.map(|size| size * stage.radius);
        let away = DISTANCE * stage.radius;
        let mut light = RectangleDesc::new((stage.middle + towards * away).to_array());
        light.name = Some(self.name.to_owned());
        light.size = Some([width, height]);
        light.look_at = Some(stage.middle.to_array());
        // Irradiance pi on a wall that faces it is white: L A / d^2 = pi strength
        light.strength = std::f64::consts::PI * self.strength * away * away / (width * height);
        light.visible = false;
        LightDesc::Rectangle(light)
    }

    /// The same from one direction.
    fn directional(&self, facing: f64, shadows: bool) -> LightDesc {
        let mut light = DirectionalDesc::new((-self.direction(facing)).to_array());
        light.name = Some(self.name.to_owned());
        light.strength = std::f64::consts::PI * self.strength;
        light.shadows = shadows;
        LightDesc::Directional(light)
    }
}

impl StudioSettings {
    fn has_ground(&self) -> bool {
        self.ground.unwrap_or(matches!(self.studio, Studio::Soft | Studio::Clay))
    }

    /// The lights and the ground around a stage that is looked at from the direction `looked`.
    pub(super) fn set_up(&self, stage: &Stage, looked: DVec3) -> (Vec<LightDesc>, Option<ShapeDesc>) {
        let facing = pxfm::f_atan2(looked.x, looked.z);
        let stage = &Stage { radius: stage.radius.max(1e-6 * (1.0 + stage.middle.length())), ..*stage };
        let lights = match self.studio {
            Studio::Soft | Studio::Clay => [KEY, FILL, RIM].iter().map(|lamp| lamp.rectangle(stage, facing)).collect(),
            Studio::Hard => {
                [(KEY, true), (FILL, false)].iter().map(|(lamp, shadows)| lamp.directional(facing, *shadows)).collect()
            }
            Studio::Flat | Studio::None => Vec::new(),
        };
        let ground = self.has_ground().then(|| {
            let half = GROUND_REACH * stage.radius;
            let corner = [stage.middle.x - half, stage.lowest, stage.middle.z - half];
            // Up is e0 x e1
            let mut ground = ParallelogramDesc::new(corner, [0.0, 0.0, 2.0 * half], [2.0 * half, 0.0, 0.0]);
            ground.name = Some("ground".to_owned());
            ground.material = Some(GROUND.to_owned());
            ground.casts_shadow = false;
            ground.single_sided = true;
            ShapeDesc::Parallelogram(ground)
        });
        (lights, ground)
    }

    /// As receipts say it.
    pub(crate) fn to_json(&self) -> String {
        TextValue::Table(self.write()).to_json()
    }

    /// What a receipt says; `None` if that is none.
    pub(crate) fn from_json(text: &str) -> Option<Self> {
        let ReadText { root, .. } = node::parse(text, Syntax::Json, &|_| false);
        let mut faults = Faults::default();
        let settings = Reader::new(0, text, "", &mut faults).table(&root?, "a studio");
        faults.list.is_empty().then_some(settings)
    }
}

impl SceneDesc {
    /// A scene that shows a model: one `[[model]]`, no camera and no light. Compile it with
    /// [`CompileOptions::studio`](crate::CompileOptions::studio), which adds those.
    pub fn of_model(file: &str, settings: &StudioSettings) -> Self {
        let mut model = ModelDesc::new(FilePath(file.to_owned()));
        let StudioSettings { studio, ground: _, up, smooth_deg, variant, scene, animation, cameras } = settings.clone();
        (model.up, model.smooth_deg, model.variant) = (up, smooth_deg, variant);
        (model.scene, model.animation, model.cameras) = (scene, animation, cameras);
        model.materials = NameMap::default();
        model.lights = studio == Studio::None;
        model.unlit = studio == Studio::Flat;
        let mut desc = SceneDesc::default();
        if studio == Studio::Clay {
            desc.materials.push((CLAY.to_owned(), clay(false)));
            model.material = Some(CLAY.to_owned());
        }
        if settings.has_ground() {
            desc.materials.push((GROUND.to_owned(), ground_material()));
        }
        desc.shapes.push(ShapeDesc::Model(model));
        desc.render.background = ColorDesc::gray(BACKGROUND);
        desc.render.tolerance = TOLERANCE;
        let [up, down] = AMBIENT.map(ColorDesc::gray);
        if !matches!(studio, Studio::Flat | Studio::None) {
            desc.render.ambient = AmbientDesc::Gradient(AmbientGradientDesc { up, down });
            desc.render.display = DisplayEncoding::Neutral;
        }
        desc
    }
}

/// The material of the ground.
fn ground_material() -> MaterialDesc {
    MaterialDesc::ShadowCatcher(ShadowCatcherDesc { alpha: GROUND_ALPHA, ..ShadowCatcherDesc::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn receipts_say_all_of_it() {
        let all = StudioSettings {
            studio: Studio::Clay,
            ground: Some(false),
            up: Some(UpAxis::Z),
            smooth_deg: Some(12.5),
            variant: Some("\"red\"".to_owned()),
            scene: Some(3),
            animation: Some("walk".to_owned()),
            cameras: true,
        };
        for settings in [StudioSettings::default(), all] {
            assert_eq!(StudioSettings::from_json(&settings.to_json()), Some(settings));
        }
        for wrong in ["", "x", "3", "{ \"studio\": \"dark\" }", "{ \"light\": true }"] {
            assert_eq!(StudioSettings::from_json(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn lights_are_around_the_model_and_turn_with_the_camera() {
        let stage = Stage { middle: DVec3::new(10.0, 5.0, -3.0), radius: 2.0, lowest: 4.0 };
        let of = |studio, looked| StudioSettings { studio, ..StudioSettings::default() }.set_up(&stage, looked);
        for (looked, turned) in [(DVec3::Z, 0.0), (DVec3::X, 90.0), (DVec3::new(0.0, 7.0, -1.0), 180.0)] {
            let (lights, ground) = of(Studio::Soft, looked);
            assert_eq!(lights.len(), 3);
            for (light, lamp) in lights.iter().zip([&KEY, &FILL, &RIM]) {
                let LightDesc::Rectangle(light) = light else { panic!("is a rectangle") };
                let towards = DVec3::from(light.center) - stage.middle;
                assert!((towards.length() - DISTANCE * stage.radius).abs() < 1e-9);
                let azimuth = pxfm::f_atan2(towards.x, towards.z).to_degrees() - turned - lamp.azimuth_deg;
                assert!((azimuth / 360.0 - (azimuth / 360.0).round()).abs() < 1e-9, "{azimuth}");
                // White on a white wall that faces it: L A / d^2 = pi strength, whatever the size of the model
                let [width, height] = light.size.expect("has one");
                let arrives = light.strength * width * height / towards.length_squared();
                assert!((arrives / std::f64::consts::PI - lamp.strength).abs() < 1e-9);
            }
            let Some(ShapeDesc::Parallelogram(ground)) = ground else { panic!("has a ground") };
            assert_eq!((ground.p[1], ground.e0[1], ground.e1[1]), (4.0, 0.0, 0.0));
            assert!(DVec3::from(ground.e0).cross(DVec3::from(ground.e1)).y > 0.0);
        }
        let (lights, ground) = of(Studio::Hard, DVec3::Z);
        let shadows = lights.iter().map(|light| matches!(light, LightDesc::Directional(light) if light.shadows));
        assert_eq!(shadows.collect::<Vec<_>>(), [true, false]);
        assert_eq!(ground, None);
        assert_eq!(of(Studio::Flat, DVec3::Z), (Vec::new(), None));
    }
}

//! What a scene is given that it does not say: a camera that sees all of it, and for a bare model a studio.

use super::outline::ShapeOutline;
use super::studio::{Stage, StudioSettings};
use super::{Scene, SceneDesc};
use crate::camera::CameraDesc;
use crate::light::LightDesc;
use crate::math::DVec3;
use crate::shape::ShapeDesc;

/// The direction that an automatic camera looks from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Around the y axis, in degrees, from -360 to 360: 0 is in front, on the side of +z, and 90 on the right, on the
    /// side of +x.
    pub azimuth_deg: f64,
    /// Above the horizon, in degrees, from -90 to 90.
    pub elevation_deg: f64,
}

impl View {
    /// The views that have names.
    pub const NAMED: [(&str, View); 9] = [
        ("front", View::new(0.0, 0.0)),
        ("back", View::new(180.0, 0.0)),
        ("left", View::new(-90.0, 0.0)),
        ("right", View::new(90.0, 0.0)),
        // The same
        ("side", View::new(90.0, 0.0)),
        ("top", View::new(0.0, 90.0)),
        ("bottom", View::new(0.0, -90.0)),
        // Along the diagonal of a cube: the elevation is atan(1 / sqrt 2)
        ("iso", View::new(45.0, 35.264389682754654)),
        ("three-quarter", View::THREE_QUARTER),
    ];

    /// From the front, a little from the right and from above: the default.
    const THREE_QUARTER: View = View::new(35.0, 20.0);

    /// From these angles, in degrees.
    pub const fn new(azimuth_deg: f64, elevation_deg: f64) -> Self {
        View { azimuth_deg, elevation_deg }
    }

    /// The view called `name`.
    pub fn from_name(name: &str) -> Option<View> {
        View::NAMED.iter().find(|(known, _)| *known == name).map(|(_, view)| *view)
    }

    /// The view of that number, from 0 on, of `count` that a turntable shows, of which this is number 0: the camera
    /// goes around the y axis in steps of 360 / `count` degrees, towards the right.
    #[must_use]
    pub fn turned(self, number: u32, count: u32) -> View {
        let azimuth = self.azimuth_deg + 360.0 * f64::from(number % count.max(1)) / f64::from(count.max(1));
        View { azimuth_deg: if azimuth > 360.0 { azimuth - 360.0 } else { azimuth }, ..self }
    }

    /// Towards the camera, and what is up in its picture: both unit.
    fn directions(&self) -> [DVec3; 2] {
        let [(around, front), (above, level)] = [self.azimuth_deg, self.elevation_deg].map(sin_cos_deg);
        let back = DVec3::new(around * level, above, front * level);
        // From straight above the far side is up, from straight below the near side
        let steep = DVec3::new(around, 0.0, front) * -above.signum();
        [back, if level.abs() < MIN_LEVEL { steep } else { DVec3::Y }]
    }
}

impl Default for View {
    /// Three quarters: from the front, from the right and from above.
    fn default() -> Self {
        View::THREE_QUARTER
    }
}

/// How an automatic camera frames what it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// Where it looks from.
    pub view: View,
    /// What is left free at least on each side of the picture, as a part of its shorter side: 0 to 0.45.
    pub margin: f64,
    /// How far the eye is, in metres, from the middle of the box around what is seen, which it then looks at: see
    /// [`Scene::turntable_distance`]. `None`: as near as the margin lets it be, with the outline in the middle of the
    /// picture.
    pub distance: Option<f64>,
    /// The moment at which what moves is framed, in seconds: 0, so that the camera stands still in all moments. That
    /// of a single picture frames it as it is there.
    pub time: f64,
}

impl Framing {
    /// The widest margin.
    pub const MAX_MARGIN: f64 = 0.45;
    /// The least and the largest distance.
    pub(super) const DISTANCES: [f64; 2] = [1e-30, 1e30];
}

impl Default for Framing {
    fn default() -> Self {
        Framing { view: View::default(), margin: 0.04, distance: None, time: 0.0 }
    }
}

/// What a scene was given because it lacks it. A description with all of it added means the same picture, without
/// anything being found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Added {
    /// A camera that sees all shapes, where the scene has no camera.
    pub camera: Option<CameraDesc>,
    /// The lights of a studio, where one was asked for.
    pub lights: Vec<LightDesc>,
    /// The ground of a studio.
    pub ground: Option<ShapeDesc>,
}

impl Added {
    /// Adds it to the description.
    pub fn add_to(&self, desc: &mut SceneDesc) {
        desc.cameras.extend(self.camera.iter().map(|camera| (String::new(), camera.clone())));
        desc.lights.extend(self.lights.iter().cloned());
        desc.shapes.extend(self.ground.iter().cloned());
        desc.sort();
    }
}

/// The vertical field of view of the camera that is given to a scene without one.
const FOV_Y_DEG: f64 = 30.0;
/// From the eye to the nearest part of what it sees, at least, in lengths of the box around it.
const NEAREST: f64 = 0.02;
/// Views with a cosine of the elevation below this are straight from above or from below.
const MIN_LEVEL: f64 = 1e-5;

impl SceneDesc {
    /// What it lacks. `seen` is what a camera sees; `None` where that is not known, and then nothing is found.
    pub(super) fn lacks(
        &self,
        seen: Option<&ShapeOutline>,
        framing: &Framing,
        studio: Option<&StudioSettings>,
    ) -> Added {
        let mut added = Added::default();
        let Some(seen) = seen else { return added };
        let bounds = seen.bounds();
        // A bare model is always shown, whatever is in its file
        let shown = bounds.or(studio.map(|_| [DVec3::NEG_ONE, DVec3::ONE]));
        if let (true, Some(shown)) = (self.cameras.is_empty(), shown) {
            let size = [self.render.width, self.render.height].map(|n| f64::from(n.max(1)));
            let support = |d: DVec3| if bounds.is_some() { seen.support(d) } else { cube(d) };
            let mut camera = framing_of(&support, shown, framing, size);
            for place in [&mut camera.position, &mut camera.look_at] {
                *place = (DVec3::from(*place) + seen.origin).to_array();
            }
            added.camera = Some(camera);
        }
        if let (Some(studio), Some([low, high])) = (studio, shown) {
            let camera = added.camera.as_ref().or(self.cameras.first().map(|(_, camera)| camera));
            let looked = camera.map_or(DVec3::Z, |camera| DVec3::from(camera.position) - DVec3::from(camera.look_at));
            let middle = (low + high) * 0.5 + seen.origin;
            let stage = Stage { middle, radius: ((high - low) * 0.5).length(), lowest: low.y + seen.origin.y };
            (added.lights, added.ground) = studio.set_up(&stage, looked);
            // What is empty stands on nothing
            added.ground = added.ground.filter(|_| bounds.is_some());
        }
        added
    }
}

impl Scene {
    /// The least [distance](Framing::distance) at which all of `count` views of a turntable, of which `framing.view` is
    /// the first, hold what is seen within their margins: so that it keeps its size and its place while it turns.
    /// `None` where there is nothing that has an end.
    pub fn turntable_distance(&self, framing: &Framing, count: u32) -> Option<f64> {
        let seen = ShapeOutline::new(&self.geometry, self.origin);
        let bounds = seen.bounds()?;
        let size = [self.width, self.height].map(f64::from);
        let of_view = |number| {
            let framing = Framing { view: framing.view.turned(number, count), ..*framing };
            Aim::new(&|d| seen.support(d), bounds, &framing, size).distance()
        };
        (0..count.max(1)).map(of_view).reduce(f64::max)
    }
}

/// The support function of the cube between -1 and 1.
fn cube(d: DVec3) -> f64 {
    d.abs().element_sum()
}

/// Sine and cosine, exact for right angles.
fn sin_cos_deg(angle: f64) -> (f64, f64) {
    match angle.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        angle => pxfm::f_sincos(angle.to_radians()),
    }
}

/// The nearest camera that sees all of a thing within its margins, with the thing in the middle of the picture.
/// `support(d)` is the most that `d` . x is over the thing, `bounds` a box around it, `size` that of the picture.
///
/// In the camera's directions right, up and back, with the eye at c, a point x is within the picture where
/// |x.right - c.right| <= t (c.back - x.back), with t the tangent of half the field of view inside of the margins. So
/// the two planes through the eye that bound it are those that touch the thing in the directions (1, t) and (-1, t) of
/// (right, back), and the eye is where they cross: that is the nearest eye for this direction. The one for up and down
/// gives another distance; the larger holds, and in the other direction the eye is moved to where the thing's outline
/// leaves the same on both sides.
fn framing_of(support: &dyn Fn(DVec3) -> f64, bounds: [DVec3; 2], framing: &Framing, size: [f64; 2]) -> CameraDesc {
    let aim = Aim::new(support, bounds, framing, size);
    let Aim { back, up, middle, .. } = aim;
    let (eye, look_at) = match framing.distance {
        Some(away) => (middle + back * away, middle),
        None => aim.nearest(),
    };
    let mut camera = CameraDesc::new(eye.to_array());
    camera.look_at = look_at.to_array();
    camera.up = up.to_array();
    camera.fov_y_deg = Some(FOV_Y_DEG);
    camera
}

/// A thing, and the directions from which it is looked at.
struct Aim<'a> {
    support: &'a dyn Fn(DVec3) -> f64,
    /// The middle of the box around the thing: far from the origin nothing is lost.
    middle: DVec3,
    /// The length of the box.
    largest: f64,
    /// Towards the eye.
    back: DVec3,
    /// What the camera is told is up.
    up: DVec3,
    /// To the right and up in the picture, each with the tangent of half the field of view within the margins.
    across: [(DVec3, f64); 2],
}

impl<'a> Aim<'a> {
    fn new(support: &'a dyn Fn(DVec3) -> f64, bounds: [DVec3; 2], framing: &Framing, size: [f64; 2]) -> Self {
        let [back, up] = framing.view.directions();
        let right = up.cross(back).normalize();
        let up_there = back.cross(right);
        let tan_y = pxfm::f_tan(FOV_Y_DEG.to_radians() * 0.5);
        let margin = framing.margin * size[0].min(size[1]);
        let [width, height] = size.map(|side| (side - 2.0 * margin) / size[1] * tan_y);
        let middle = (bounds[0] + bounds[1]) * 0.5;
        let largest = (bounds[1] - bounds[0]).max_element();
        Aim { support, middle, largest, back, up, across: [(right, width), (up_there, height)] }
    }

    /// The most that `d` . x is over the thing, from its middle.
    fn reach(&self, d: DVec3) -> f64 {
        (self.support)(d) - self.middle.dot(d)
    }

    /// How far the planes that touch the thing on both sides are from the middle.
    fn touching(&self, across: DVec3, tan: f64) -> [f64; 2] {
        [self.reach(across + self.back * tan), self.reach(-across + self.back * tan)]
    }

    /// The least distance along `back` at which nothing of the thing lies in the eye: the tip of a needle, or what has
    /// no size at all.
    fn clear(&self) -> f64 {
        self.reach(self.back) + (NEAREST * self.largest).max(1e-6 * (1.0 + self.middle.abs().max_element()))
    }

    /// The nearest eye, and what it looks at.
    fn nearest(&self) -> (DVec3, DVec3) {
        let apart = |(across, tan): (DVec3, f64)| self.touching(across, tan).iter().sum::<f64>() / (2.0 * tan);
        let [right, up] = self.across;
        let away = apart(right).max(apart(up)).max(self.clear());
        let centre = |(across, tan): (DVec3, f64)| {
            let over = |tan| self.touching(across, tan).iter().sum::<f64>() - 2.0 * tan * away;
            let [one, other] = self.touching(across, outline(tan, over));
            across * ((one - other) * 0.5)
        };
        let axis = self.middle + centre(right) + centre(up);
        let (front, rear) = (self.reach(self.back), -self.reach(-self.back));
        (axis + self.back * away, axis + self.back * ((front + rear) * 0.5))
    }

    /// The nearest that an eye is that looks at the middle.
    fn distance(&self) -> f64 {
        let of = |(across, tan): (DVec3, f64)| {
            let [one, other] = self.touching(across, tan);
            one.max(other) / tan
        };
        let [right, up] = self.across;
        of(right).max(of(up)).max(self.clear())
    }
}

/// The tangent from 0 to `most` at which `over`, which is convex and falls from 0 or more to 0 or less, is 0: that of
/// the angle at which the outline is seen on both sides.
fn outline(most: f64, over: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, most);
    let (mut at_low, mut at_high) = (over(low), over(high));
    let enough = at_low * 1e-12;
    if !(at_low > 0.0) || !(at_high < -enough) {
        return if at_low > 0.0 { most } else { 0.0 };
    }
    // False position; an end that stays counts for half (the Illinois method)
    let mut stayed = 0;
    for _ in 0..100 {
        let tan = (low * at_high - high * at_low) / (at_high - at_low);
        let there = over(tan);
        if there.abs() <= enough || !(tan > low && tan < high) {
            return tan;
        }
        if there > 0.0 {
            (low, at_low) = (tan, there);
            if stayed > 0 {
                at_high *= 0.5;
            }
            stayed = 1;
        } else {
            (high, at_high) = (tan, there);
            if stayed < 0 {
                at_low *= 0.5;
            }
            stayed = -1;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where points are in a picture of the size, in parts of it from the left and from the top: the least and the
    /// most.
    fn shown(camera: &CameraDesc, points: &[DVec3], size: [f64; 2]) -> [[f64; 2]; 2] {
        let eye = DVec3::from(camera.position);
        let forward = (DVec3::from(camera.look_at) - eye).normalize();
        let right = forward.cross(camera.up.into()).normalize();
        let up = right.cross(forward);
        let tan = pxfm::f_tan(FOV_Y_DEG.to_radians() * 0.5);
        let mut found = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for point in points {
            let q = *point - eye;
            let depth = q.dot(forward);
            assert!(depth > 0.0);
            let at = [q.dot(right) / (depth * tan * size[0] / size[1]), -q.dot(up) / (depth * tan)];
            for (found, at) in found.iter_mut().zip(at) {
                let at = 0.5 + 0.5 * at;
                *found = [found[0].min(at), found[1].max(at)];
            }
        }
        found
    }

    #[test]
    fn the_outline_is_in_the_middle_and_touches_its_margin() {
        let mut random = crate::shape::check::Random::new(7);
        let mut views: Vec<View> = View::NAMED.iter().map(|(_, view)| *view).collect();
        views.push(View::default());
        views.extend((0..40).map(|_| View::new(random.between(-360.0, 360.0), random.between(-90.0, 90.0))));
        let mut held_off = 0;
        for (i, view) in views.iter().enumerate() {
            // Points in boxes of many proportions, near the origin and far from it
            let half =
                DVec3::new(random.magnitude(0.1, 10.0), random.magnitude(0.1, 10.0), random.magnitude(0.1, 10.0));
            let from = if i % 3 == 0 { DVec3::new(1e5, -3e4, 2e5) } else { DVec3::ZERO };
            let mut between =
                || DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            let points: Vec<DVec3> = (0..5 + i).map(|_| from + between() * half).collect();
            let low = points.iter().copied().reduce(DVec3::min).unwrap_or_default();
            let high = points.iter().copied().reduce(DVec3::max).unwrap_or_default();
            let support = |d: DVec3| points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max);
            for (size, margin) in [([300.0, 300.0], 0.04), ([400.0, 100.0], 0.0), ([100.0, 300.0], 0.2)] {
                let framing = Framing { view: *view, margin, ..Framing::default() };
                let camera = framing_of(&support, [low, high], &framing, size);
                let [x, y] = shown(&camera, &points, size);
                let free = [0, 1].map(|axis| margin * size[0].min(size[1]) / size[axis]);
                // Equal on both sides, and nowhere less than asked; in one direction exactly that
                let over = [x[0] - free[0], y[0] - free[1]];
                assert!((x[0] - (1.0 - x[1])).abs() < 1e-6, "{view:?} {size:?}: {x:?}");
                assert!((y[0] - (1.0 - y[1])).abs() < 1e-6, "{view:?} {size:?}: {y:?}");
                assert!(over.iter().all(|o| *o > -1e-6), "{view:?} {size:?}: {over:?}");
                let eye = DVec3::from(camera.position);
                let back = (eye - DVec3::from(camera.look_at)).normalize();
                let before = eye.dot(back) - support(back);
                let is_held_off = before < NEAREST * (high - low).max_element() * (1.0 + 1e-6);
                held_off += usize::from(is_held_off);
                assert!(is_held_off || over.iter().any(|o| *o < 1e-6), "{view:?} {size:?}: {over:?}");
            }
        }
        assert!(held_off < views.len() / 2, "{held_off}");
    }

    #[test]
    fn a_ball_is_seen_as_round_as_it_is() {
        // The cone around a ball of radius 1 at the distance d has the sine 1 / d
        let support = |d: DVec3| d.length();
        let framing = Framing { view: View::new(0.0, 0.0), margin: 0.1, ..Framing::default() };
        let camera = framing_of(&support, [DVec3::NEG_ONE, DVec3::ONE], &framing, [200.0, 100.0]);
        let tan = 0.8 * pxfm::f_tan(FOV_Y_DEG.to_radians() * 0.5);
        let distance = (1.0 + 1.0 / (tan * tan)).sqrt();
        assert!((DVec3::from(camera.position) - DVec3::new(0.0, 0.0, distance)).length() < 1e-12, "{camera:?}");
        assert_eq!(DVec3::from(camera.look_at), DVec3::ZERO);
    }

    #[test]
    fn a_point_and_a_line_along_the_view_have_a_camera() {
        for (low, high) in [(DVec3::ONE, DVec3::ONE), (DVec3::NEG_Z, DVec3::Z)] {
            let support = |d: DVec3| low.dot(d).max(high.dot(d));
            let camera = framing_of(
                &support,
                [low, high],
                &Framing { view: View::new(0.0, 0.0), ..Framing::default() },
                [9.0, 9.0],
            );
            assert!(camera.position[2] > high.z && camera.look_at[2] < camera.position[2], "{camera:?}");
        }
    }

    #[test]
    fn views_are_where_their_names_say() {
        for (name, back, up) in [
            ("front", DVec3::Z, DVec3::Y),
            ("back", DVec3::NEG_Z, DVec3::Y),
            ("left", DVec3::NEG_X, DVec3::Y),
            ("right", DVec3::X, DVec3::Y),
            ("top", DVec3::Y, DVec3::NEG_Z),
            ("bottom", DVec3::NEG_Y, DVec3::Z),
        ] {
            assert_eq!(View::from_name(name).map(|view| view.directions()), Some([back, up]), "{name}");
        }
        let iso = View::from_name("iso").map(|view| view.directions()[0]).unwrap_or_default();
        assert!((iso - DVec3::ONE.normalize()).length() < 1e-15);
        // Turned by as much as the camera goes around
        assert_eq!(View::new(90.0, 90.0).directions(), [DVec3::Y, DVec3::NEG_X]);
        assert_eq!(View::from_name("above"), None);
    }

    #[test]
    fn a_turntable_holds_what_is_seen_from_all_its_sides() {
        let points = [[3.0, 0.0, 0.2], [-1.0, 2.0, 0.0], [0.5, -1.0, -0.1], [2.0, 1.0, 0.3]].map(DVec3::from);
        let low = points.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let high = points.iter().copied().reduce(DVec3::max).unwrap_or_default();
        let support = |d: DVec3| points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max);
        for (first, count, size) in [
            (View::default(), 7, [300.0, 300.0]),
            (View::new(-350.0, -40.0), 4, [400.0, 100.0]),
            (View::new(0.0, 90.0), 3, [9.0, 9.0]),
        ] {
            let framing = Framing { view: first, margin: 0.1, ..Framing::default() };
            let of = |number| Framing { view: first.turned(number, count), ..framing };
            let all = (0..count).map(|number| Aim::new(&support, [low, high], &of(number), size).distance());
            let distance = all.fold(0.0, f64::max);
            let free = [0, 1].map(|axis| 0.1 * size[0].min(size[1]) / size[axis]);
            let mut least = f64::INFINITY;
            for number in 0..count {
                let camera =
                    framing_of(&support, [low, high], &Framing { distance: Some(distance), ..of(number) }, size);
                let middle = (low + high) * 0.5;
                assert!((DVec3::from(camera.look_at) - middle).length() < 1e-12);
                assert!(((DVec3::from(camera.position) - middle).length() - distance).abs() < 1e-12 * distance);
                let [x, y] = shown(&camera, &points, size);
                for ([a, b], free) in [x, y].into_iter().zip(free) {
                    least = least.min(a - free).min(1.0 - b - free);
                }
            }
            // No nearer eye would do
            assert!((-1e-9..1e-9).contains(&least), "{first:?} {size:?}: {least}");
        }
    }

    #[test]
    fn a_turntable_goes_all_around() {
        let view = View::new(300.0, 10.0);
        assert_eq!([0, 1, 2, 3].map(|k| view.turned(k, 4).azimuth_deg), [300.0, 30.0, 120.0, 210.0]);
        assert_eq!((view.turned(4, 4), view.turned(7, 0).elevation_deg), (view, 10.0));
    }
}

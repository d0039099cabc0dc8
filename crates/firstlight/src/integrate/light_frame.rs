//! Flat lights, and their coordinates from a point.

use std::f32::consts::PI;

use crate::light::way_error;
use crate::material::ShadingPoint;
use crate::math::{DVec3, UNIT_ROUNDOFF, Vec3};

/// The part of the square [-1, 1]^2 of its own coordinates that a flat light fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outline {
    /// All of it.
    Parallelogram,
    /// x^2 + y^2 <= 1.
    Disk,
    /// The same, standing for the visible part of a sphere: weights are those of the sphere's area. Integrated over
    /// longitude x' and latitude y', with the poles in the plane of the disk: x = cos y' sin x', y = sin y'.
    Sphere,
}

/// A flat light: the points c + x a + y b.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlatLight {
    /// The middle, in metres, world space.
    pub c: DVec3,
    /// The vectors from the middle to x = 1 and to y = 1.
    pub a: Vec3,
    pub b: Vec3,
    /// Unit normal of the front.
    pub n: Vec3,
    /// `a`, `b` and `n` in f64.
    pub(super) deep: [DVec3; 3],
    /// The length of `a`, and `a` as a unit vector.
    pub la: f32,
    pub ua: Vec3,
    /// The part of `b` along `a`; the length of the rest, and its unit vector.
    pub skew: f32,
    pub lb: f32,
    pub ub: Vec3,
    pub outline: Outline,
    /// Whether irradiance falls with the square of the distance and the cosine at the light.
    pub physical: bool,
    /// Whether the back emits as well.
    pub both_sides: bool,
    /// Factor of the radiance.
    pub times: f32,
    /// Of [`Outline::Sphere`]: radius over distance of the middle; and the power of the point (the squared length of a
    /// tangent) if the far half counts as well, else 0.
    pub ratio: f32,
    pub behind2: f32,
}

impl FlatLight {
    /// `a` and `b` are not parallel; `n` is the unit normal of the front.
    pub fn new(c: DVec3, a: DVec3, b: DVec3, n: DVec3, outline: Outline, physical: bool, both_sides: bool) -> Self {
        let (la, ua) = (a.length(), a.normalize());
        let skew = b.dot(ua);
        let across = b - ua * skew;
        FlatLight {
            c,
            a: a.as_vec3(),
            b: b.as_vec3(),
            n: n.as_vec3(),
            deep: [a, b, n],
            la: la as f32,
            ua: ua.as_vec3(),
            skew: skew as f32,
            lb: across.length() as f32,
            ub: across.normalize().as_vec3(),
            outline,
            physical,
            both_sides,
            times: 1.0,
            ratio: 0.0,
            behind2: 0.0,
        }
    }

    /// Unit normal of the front, in f64.
    pub fn normal(&self) -> DVec3 {
        self.deep[2]
    }

    /// In metres: the rounding of its points in f32, within which the side of its plane is not known.
    pub fn rounding(&self) -> f64 {
        let reach = self.c.abs() + self.deep[0].abs() + self.deep[1].abs();
        reach.element_sum() * f64::from(32.0 * UNIT_ROUNDOFF)
    }

    /// The factor of dx dy: an area (physical), or a part of the whole.
    pub(super) fn measure(&self) -> f32 {
        let area = match self.outline {
            Outline::Parallelogram => 4.0,
            Outline::Disk => PI,
            Outline::Sphere => 4.0 * PI,
        };
        self.times * if self.physical { self.la * self.lb } else { 1.0 / area }
    }
}

/// c + x X + y Y: a quantity that is linear over a light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Linear {
    pub c: f32,
    pub x: f32,
    pub y: f32,
}

/// As a part of the light's half size: for closer points the coordinates' origin is the nearest place, since from the
/// middle, numbers would cancel.
pub(super) const NEAR: f32 = 0.03;

/// Coordinates of a flat light from one point: l = l0 + x a + y b is the vector from the point to a place.
///
/// The origin of (x, y) is the light's middle or, if the point is close, the nearest place: numbers around it are
/// small, and so is their rounding.
///
/// Distances are computed in a frame of the light's plane, where nothing cancels near it: |l|^2 = (fa + la x + skew
/// y)^2 + (fb + lb y)^2 + height^2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightFrame {
    /// The origin, from the middle.
    pub origin: [f32; 2],
    /// First and last x and y of the light's square: -1 and 1 from the middle.
    pub x: [f32; 2],
    pub y: [f32; 2],
    pub l0: Vec3,
    pub a: Vec3,
    pub b: Vec3,
    pub fa: f32,
    pub la: f32,
    pub skew: f32,
    pub fb: f32,
    pub lb: f32,
    /// Distance of the point from the light's plane.
    pub height: f32,
    /// Distance of the point in front of an emitting side; infinite if both sides emit.
    pub facing: f32,
    /// ns.l
    pub cos: Linear,
    /// The height of l above the horizon, less its rounding: [`crate::light::Light::floor`].
    pub horizon: Linear,
    /// wo.l
    pub out: Linear,
    pub cos_o: f32,
    pub ns: Vec3,
    pub wo: Vec3,
    /// See [`FlatLight::measure`].
    pub measure: f32,
    /// See [`FlatLight::ratio`].
    pub ratio: f32,
    pub behind2: f32,
}

impl LightFrame {
    pub fn new(light: &FlatLight, at: &ShadingPoint) -> LightFrame {
        let l0 = (light.c - at.p.as_dvec3()).as_vec3();
        let side = -light.n.dot(l0);
        let linear = |v: Vec3| Linear { c: v.dot(l0), x: v.dot(light.a), y: v.dot(light.b) };
        let (cos, mut horizon) = (linear(at.ns), linear(at.horizon));
        horizon.c -= at.horizon.abs().dot(way_error(light.c.as_vec3(), light.a.abs() + light.b.abs(), at.p, at.error));
        let view = LightFrame {
            origin: [0.0; 2],
            x: [-1.0, 1.0],
            y: [-1.0, 1.0],
            l0,
            a: light.a,
            b: light.b,
            fa: l0.dot(light.ua),
            la: light.la,
            skew: light.skew,
            fb: l0.dot(light.ub),
            lb: light.lb,
            height: side.abs(),
            facing: if light.both_sides { f32::INFINITY } else { side },
            cos,
            horizon,
            out: linear(at.wo),
            cos_o: at.ns.dot(at.wo),
            ns: at.ns,
            wo: at.wo,
            measure: light.measure(),
            ratio: light.ratio,
            behind2: light.behind2,
        };
        if view.nearest() < NEAR * view.la.max(view.lb) { view.near(light, at) } else { view }
    }

    /// The same with the nearest place as origin.
    fn near(self, light: &FlatLight, at: &ShadingPoint) -> LightFrame {
        let [a, b, n] = light.deep;
        let middle = light.c - at.p.as_dvec3();
        let (ua, ub) = (a.normalize(), (b - a * (a.dot(b) / a.length_squared())).normalize());
        let (skew, lb) = (b.dot(ua), b.dot(ub));
        // As f32 knows it
        let place = |w: f64| f64::from(w.clamp(-1.0, 1.0) as f32);
        let y = place(-middle.dot(ub) / lb);
        let x = place(-(middle.dot(ua) + y * skew) / a.length());
        let [x, y] = match light.outline {
            Outline::Parallelogram => [x, y],
            Outline::Disk | Outline::Sphere => {
                let outside = (x * x + y * y).sqrt().max(1.0);
                [place(x / outside), place(y / outside)]
            }
        };
        let l0 = middle + a * x + b * y;
        let side = -n.dot(l0);
        let linear = |v: Vec3| {
            let v = v.as_dvec3();
            Linear { c: v.dot(l0) as f32, x: v.dot(a) as f32, y: v.dot(b) as f32 }
        };
        let mut horizon = linear(at.horizon);
        horizon.c -= at.horizon.abs().dot(at.error.0 + l0.abs().as_vec3() * UNIT_ROUNDOFF);
        LightFrame {
            origin: [x as f32, y as f32],
            x: [(-1.0 - x) as f32, (1.0 - x) as f32],
            y: [(-1.0 - y) as f32, (1.0 - y) as f32],
            l0: l0.as_vec3(),
            fa: l0.dot(ua) as f32,
            fb: l0.dot(ub) as f32,
            height: side.abs() as f32,
            facing: if light.both_sides { f32::INFINITY } else { side as f32 },
            cos: linear(at.ns),
            horizon,
            out: linear(at.wo),
            ..self
        }
    }

    /// Lower bound of the distance to the light's square, in metres.
    pub fn nearest(&self) -> f32 {
        let gap = |foot: f32, [low, high]: [f32; 2]| (foot - low).max(-foot - high).max(0.0);
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        let lean = self.skew.abs() * y1.max(-y0);
        let across = gap(self.fa, [self.la * -x0 + lean, self.la * x1 + lean]);
        let along = gap(self.fb, [self.lb * -y0, self.lb * y1]);
        (across * across + along * along + self.height * self.height).sqrt()
    }

    /// The viewer's direction reflected at the shading normal.
    pub fn mirror(&self) -> Option<Vec3> {
        let m = self.ns * (2.0 * self.cos_o) - self.wo;
        let length = m.length();
        (length > 0.5).then(|| m / length)
    }
}

//! A flat light, and how one point sees it.

use crate::material::Lobe;
use crate::math::{DVec3, Vec3};

/// What a flat light fills of the square [-1, 1]^2 of its own coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outline {
    /// All of it: a rectangle, or what a transform made of one.
    Parallelogram,
    /// x^2 + y^2 <= 1.
    Disk,
}

/// A flat light: the points c + x a + y b.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlatLight {
    /// The middle, in metres, world space.
    pub c: DVec3,
    /// From the middle to where x is 1.
    pub a: Vec3,
    /// From the middle to where y is 1.
    pub b: Vec3,
    /// Unit normal of the front.
    pub n: Vec3,
    /// The length of `a`, and `a` as a unit vector.
    pub la: f32,
    pub ua: Vec3,
    /// The part of `b` along `a`; the length of what is left of it, and that as a unit vector.
    pub skew: f32,
    pub lb: f32,
    pub ub: Vec3,
    pub outline: Outline,
    /// Whether light weakens with the square of the distance and the cosine at the light.
    pub physical: bool,
    /// Whether the side behind emits as well.
    pub both_sides: bool,
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
            la: la as f32,
            ua: ua.as_vec3(),
            skew: skew as f32,
            lb: across.length() as f32,
            ub: across.normalize().as_vec3(),
            outline,
            physical,
            both_sides,
        }
    }
}

/// A point that asks for light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub p: Vec3,
    /// Light from below this plane does not count.
    pub horizon: Vec3,
    /// Shading normal.
    pub ns: Vec3,
    /// To the viewer.
    pub wo: Vec3,
    pub lobe: Lobe,
}

/// c + x X + y Y: a quantity that changes linearly over a light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Linear {
    pub c: f32,
    pub x: f32,
    pub y: f32,
}

impl Linear {
    #[inline(always)]
    pub fn at(&self, x: f32, y: f32) -> f32 {
        self.c + x * self.x + y * self.y
    }

    /// The least over the square.
    #[inline(always)]
    pub fn min(&self) -> f32 {
        self.c - self.x.abs() - self.y.abs()
    }

    /// The greatest over the square.
    #[inline(always)]
    pub fn max(&self) -> f32 {
        self.c + self.x.abs() + self.y.abs()
    }
}

/// A flat light as one point sees it: l = l0 + x a + y b leads from the point to the light.
///
/// Distances are computed in a frame of the light's plane, where nothing cancels near it:
/// |l|^2 = (fa + la x + skew y)^2 + (fb + lb y)^2 + height^2.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub l0: Vec3,
    pub a: Vec3,
    pub b: Vec3,
    pub fa: f32,
    pub la: f32,
    pub skew: f32,
    pub fb: f32,
    pub lb: f32,
    /// Of the point above the light's plane.
    pub height: f32,
    /// ns.l
    pub cos: Linear,
    /// The height of l above the horizon.
    pub horizon: Linear,
    /// wo.l
    pub out: Linear,
    pub cos_o: f32,
    pub ns: Vec3,
    pub wo: Vec3,
    pub lobe: Lobe,
    pub physical: bool,
    pub outline: Outline,
    /// What dx dy is multiplied with: an area (physical), or a share of the whole.
    pub measure: f32,
}

impl View {
    /// `None` where no light arrives: the side that faces the point does not emit, or the light is below the horizon.
    pub fn new(light: &FlatLight, at: &Receiver) -> Option<View> {
        let l0 = (light.c - at.p.as_dvec3()).as_vec3();
        let side = -light.n.dot(l0);
        if !light.both_sides && !(side > 0.0) {
            return None;
        }
        let height = side.abs();
        if light.physical && height == 0.0 {
            return None;
        }
        let linear = |v: Vec3| Linear { c: v.dot(l0), x: v.dot(light.a), y: v.dot(light.b) };
        let (cos, horizon) = (linear(at.ns), linear(at.horizon));
        if !(cos.max() > 0.0 && horizon.max() > 0.0) {
            return None;
        }
        let area = match light.outline {
            Outline::Parallelogram => 4.0,
            Outline::Disk => std::f32::consts::PI,
        };
        Some(View {
            l0,
            a: light.a,
            b: light.b,
            fa: l0.dot(light.ua),
            la: light.la,
            skew: light.skew,
            fb: l0.dot(light.ub),
            lb: light.lb,
            height,
            cos,
            horizon,
            out: linear(at.wo),
            cos_o: at.ns.dot(at.wo),
            ns: at.ns,
            wo: at.wo,
            lobe: at.lobe,
            physical: light.physical,
            outline: light.outline,
            measure: if light.physical { light.la * light.lb } else { 1.0 / area },
        })
    }

    /// The way to the point (x, y) of the light.
    #[inline(always)]
    pub fn l(&self, x: f32, y: f32) -> Vec3 {
        self.l0 + self.a * x + self.b * y
    }

    /// The ways to the corners of the square, around.
    pub fn corners(&self) -> [Vec3; 4] {
        [self.l(-1.0, -1.0), self.l(1.0, -1.0), self.l(1.0, 1.0), self.l(-1.0, 1.0)]
    }

    /// Whether all of the light is above the horizon.
    #[inline(always)]
    pub fn is_above_horizon(&self) -> bool {
        self.cos.min() > 0.0 && self.horizon.min() > 0.0
    }
}

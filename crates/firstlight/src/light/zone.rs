//! Places that ask for light together.

use crate::material::Lobe;
use crate::math::{Arc, Vec3};

/// A ball of places, with all that bounds what they make of light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Zone {
    /// In metres, world space.
    pub center: Vec3,
    /// All places are as near to `center`.
    pub reach: f32,
    /// Unit, in the middle of all their shading normals and horizons.
    pub n: Vec3,
    /// How far those are from `n`, at most.
    pub turn: Arc,
    /// Unit, the direction that the middle of a highlight comes from.
    pub mirror: Vec3,
    /// How far the directions of all highlights are from `mirror`, at most.
    pub blur: Arc,
    /// Unit, to the viewer; how far others are from it.
    pub wo: Vec3,
    pub wo_turn: Arc,
    /// The highlight all share.
    pub lobe: Lobe,
}

/// What a highlight is, at most, in some directions, and how fast it changes as the direction turns: 1 over radians,
/// and over their square.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Highlight {
    pub most: f32,
    pub slope: f32,
    pub curve: f32,
}

impl Zone {
    /// What highlights are for light from the directions that are within `spread` of `d` (unit).
    pub fn highlight(&self, d: Vec3, spread: Arc) -> Highlight {
        let off = Arc::between(d, self.mirror);
        let (nearest, farthest) = (off.minus(spread).minus(self.blur), off.plus(spread).plus(self.blur));
        match &self.lobe {
            Lobe::None => Highlight::default(),
            Lobe::Phong(lobe) => {
                let at = |cos: f32| self.lobe.eval(0.0, 0.0, -cos.max(0.0));
                let sin = if farthest.cos > 0.0 { farthest.sin } else { 1.0 };
                Highlight::of_power(lobe.exponent(), at, nearest.cos, sin, [1.0, 1.0])
            }
            Lobe::BlinnPhong(lobe) => {
                // The half vector is off the normal by half of what the light is off the mirror's direction
                let half = |arc: Arc| (0.5 * (1.0 + arc.cos)).max(0.0).sqrt();
                let at = |cos: f32| {
                    let twice = 2.0 * cos.max(0.0) * cos.max(0.0) - 1.0;
                    self.lobe.eval(1.0 + twice, 0.0, twice)
                };
                let sin = (0.5 * (1.0 - farthest.cos)).max(0.0).sqrt();
                // 1 / |wi + wo|: how fast the half vector turns with the light
                let apart = Arc::between(d, self.wo).plus(spread).plus(self.wo_turn);
                let k = 1.0 / (2.0 * half(apart)).max(1e-3);
                Highlight::of_power(lobe.exponent(), at, half(nearest), sin, [k, 2.0 * k + 3.0 * k * k])
            }
        }
    }
}

impl Highlight {
    /// cos^s, whose value `at` gives, for cosines up to `cos` and sines up to `sin` of the angle between two
    /// directions. One moves as the light does, at a rate of up to `rates[0]`, and is bent by up to `rates[1]`.
    fn of_power(s: f32, at: impl Fn(f32) -> f32, cos: f32, sin: f32, rates: [f32; 2]) -> Highlight {
        let most = at(cos).min(1.0) * 1.0001;
        if !(s >= 2.0) {
            // Nothing bounds how fast it changes where it begins
            return Highlight { most, slope: f32::INFINITY, curve: f32::INFINITY };
        }
        // cos^(s - 2), at most
        let below = |cos: f32| at(cos) / (cos * cos);
        let steep = below(cos.max(0.3)).min(1.0) * 1.001;
        // |d cos^s| = s cos^(s - 1) sin <= sqrt(s); |d^2 cos^s| <= s cos^(s - 2) max(cos^2, (s - 1) sin^2) <= s
        let slope = (s * steep * sin).min(s.sqrt());
        let curve = (s * steep * (s * sin * sin).max(1.0)).min(s);
        let [k, bent] = rates;
        // The way to a light bends as the light moves straight
        Highlight { most, slope: slope * k, curve: curve * k * k + slope * (bent + k) }
    }
}

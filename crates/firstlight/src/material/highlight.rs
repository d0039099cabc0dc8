//! What highlights are, at most, and how fast they change.

/// What a highlight is, at most, in some directions, and how fast it changes as the direction turns: 1 over radians,
/// and over their square.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Highlight {
    pub most: f32,
    pub slope: f32,
    pub curve: f32,
}

impl Highlight {
    /// cos^s, whose value `at` gives, for cosines up to `cos` and sines up to `sin` of the angle between two
    /// directions. One moves as the light does, at a rate of up to `rates[0]`, and is bent by up to `rates[1]`.
    pub(super) fn of_power(s: f32, at: impl Fn(f32) -> f32, cos: f32, sin: f32, rates: [f32; 2]) -> Highlight {
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

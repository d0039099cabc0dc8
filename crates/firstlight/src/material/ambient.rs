//! Ambient light: a colour from all sides, or a gradient from above to below.

use std::sync::LazyLock;

use serde_json::{Value as Json, json};

use super::GgxLobe;
use crate::color::Rgb;
use crate::context::CompileContext;
use crate::describe::node::Node;
use crate::describe::read::Reader;
use crate::describe::{ColorDesc, TableInfo, TextValue, Value, table};
use crate::math::Vec3;
use crate::shape::SurfaceInteraction;

table! {
    /// Ambient light that changes with the direction: from a direction d it is down + (up - down) (1 + d.y) / 2.
    pub struct AmbientGradientDesc {
        /// From straight above; 0 or more in each channel.
        pub up: ColorDesc,
        /// From straight below; 0 or more in each channel.
        pub down: ColorDesc,
    }
}

/// Ambient light as a scene may say it: a colour, or `{ up = ..., down = ... }`.
#[derive(Clone, Debug, PartialEq)]
pub enum AmbientDesc {
    /// The same from all sides.
    Uniform(ColorDesc),
    /// From one colour above to another below.
    Gradient(AmbientGradientDesc),
}

impl From<ColorDesc> for AmbientDesc {
    /// The same from all sides.
    fn from(color: ColorDesc) -> Self {
        AmbientDesc::Uniform(color)
    }
}

impl AmbientDesc {
    pub(crate) fn compile(&self, cx: &mut CompileContext) -> Ambient {
        match self {
            AmbientDesc::Uniform(color) => {
                let color = cx.color("ambient", *color);
                Ambient::new(color, color)
            }
            AmbientDesc::Gradient(AmbientGradientDesc { up, down }) => {
                Ambient::new(cx.color("ambient.up", *up), cx.color("ambient.down", *down))
            }
        }
    }
}

impl Value for AmbientDesc {
    fn words() -> String {
        format!("{} or {{ up = ..., down = ... }}", ColorDesc::words())
    }

    fn plural() -> String {
        format!("{} or {{ up = ..., down = ... }}", ColorDesc::plural())
    }

    fn schema() -> Json {
        json!({ "anyOf": [ColorDesc::schema(), AmbientGradientDesc::schema()] })
    }

    fn tables() -> Vec<TableInfo> {
        AmbientGradientDesc::tables()
    }

    fn placeholder() -> Self {
        AmbientDesc::Uniform(ColorDesc::BLACK)
    }

    fn read(node: &Node, reader: &mut Reader<'_>) -> Option<Self> {
        match node.entries() {
            Some(_) => AmbientGradientDesc::read(node, reader).map(AmbientDesc::Gradient),
            None => ColorDesc::read(node, reader).map(AmbientDesc::Uniform),
        }
    }

    fn write(&self) -> TextValue {
        match self {
            AmbientDesc::Uniform(color) => color.write(),
            AmbientDesc::Gradient(gradient) => Value::write(gradient),
        }
    }
}

/// Ambient light: from a direction d it is `mean` + `slope` d.y, linear Rec. 709.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ambient {
    /// The mean of the light from above and that from below.
    pub mean: Rgb,
    /// Half of what comes from above more than from below.
    pub slope: Rgb,
}

impl Ambient {
    /// From straight above, and from straight below.
    pub(crate) fn new(up: Rgb, down: Rgb) -> Ambient {
        if up == down {
            return Ambient { mean: up, slope: Rgb::BLACK };
        }
        Ambient { mean: (up + down) * 0.5, slope: (up + down * -1.0) * 0.5 }
    }

    /// What the answer of a [`Bsdf`](super::Bsdf) is multiplied with: the light itself where it is the same from all
    /// sides, else 1: then the answer is that to the light.
    #[inline(always)]
    pub(crate) fn unit(&self) -> Rgb {
        if self.is_uniform() { self.mean } else { Rgb::WHITE }
    }

    /// The answer to a unit of light that is reflected by `diffuse` around the normal, and by `specular` around the
    /// mirrored direction to the viewer.
    #[inline(always)]
    pub(super) fn answer(&self, view: &ViewGeometry, diffuse: Rgb, specular: Rgb) -> Rgb {
        if self.is_uniform() {
            return diffuse + specular;
        }
        let from = |d: Vec3| self.mean + self.slope * d.y;
        from(view.ns) * diffuse + from(view.mirror()) * specular
    }

    /// Whether it is the same from all sides.
    #[inline(always)]
    pub(crate) fn is_uniform(&self) -> bool {
        self.slope == Rgb::BLACK
    }

    /// Whether there is none.
    pub(crate) fn is_black(&self) -> bool {
        *self == Ambient::default()
    }
}

/// The directions at a surface that decide its answer to ambient light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewGeometry {
    /// Shading normal of the diffuse part.
    pub ns: Vec3,
    /// That of the highlight.
    pub lobe_ns: Vec3,
    /// To the viewer.
    pub wo: Vec3,
}

impl ViewGeometry {
    /// With one normal for both parts.
    pub fn new(ns: Vec3, wo: Vec3) -> ViewGeometry {
        ViewGeometry { ns, lobe_ns: ns, wo }
    }

    /// Of a surface below its coat.
    #[inline(always)]
    pub fn of(si: &SurfaceInteraction) -> ViewGeometry {
        ViewGeometry { ns: si.ns, lobe_ns: si.lobe_ns, wo: si.wo }
    }

    /// Of the coat of a surface.
    pub fn of_coat(si: &SurfaceInteraction) -> ViewGeometry {
        ViewGeometry::new(si.coat_ns, si.wo)
    }

    /// n.wo of the highlight, 0 or more.
    pub fn cos_o(&self) -> f32 {
        self.lobe_ns.dot(self.wo).max(0.0)
    }

    /// The direction to the viewer, mirrored by the highlight.
    pub fn mirror(&self) -> Vec3 {
        self.lobe_ns * (2.0 * self.lobe_ns.dot(self.wo)) - self.wo
    }
}

/// Steps of the table of [`GgxLobe::white_albedo`] along roughness and along n.wo.
const STEPS: usize = 32;
/// Polar angles and azimuths of half vectors in the quadrature of each entry.
const POINTS: usize = 32;

/// The f0 part and the f90 part of the light of a white hemisphere, by roughness, then by n.wo, both from 0 to 1.
static WHITE_ALBEDO: LazyLock<Vec<[[f32; 2]; STEPS]>> = LazyLock::new(|| {
    let at = |step: usize| step as f32 / (STEPS - 1) as f32;
    let row = |roughness: usize| {
        let lobe = GgxLobe::new(at(roughness), 0.0);
        std::array::from_fn(|cos_o| lobe.integrate_white(f64::from(at(cos_o)).max(MIN_COS), POINTS))
    };
    (0..STEPS).map(row).collect()
});

/// Of n.wo in the table.
const MIN_COS: f64 = 1e-3;

impl GgxLobe {
    /// The parts of the light of a white hemisphere of unit irradiance over pi: f0's and f90's, by a table.
    pub(super) fn white_albedo(&self, cos_o: f32) -> [f32; 2] {
        let place = |x: f32| {
            let x = x.clamp(0.0, 1.0) * (STEPS - 1) as f32;
            let first = (x as usize).min(STEPS - 2);
            (first, x - first as f32)
        };
        let ((i, s), (j, t)) = (place(self.alpha.sqrt()), place(cos_o));
        let mix = |a: [f32; 2], b: [f32; 2], f: f32| [a[0] + (b[0] - a[0]) * f, a[1] + (b[1] - a[1]) * f];
        let row = |i: usize| mix(WHITE_ALBEDO[i][j], WHITE_ALBEDO[i][j + 1], t);
        mix(row(i), row(i + 1), s)
    }

    /// The same by a quadrature of so many polar angles, and as many azimuths, of the half vector.
    fn integrate_white(&self, cos_o: f64, points: usize) -> [f32; 2] {
        let (alpha2, sin_o) = (f64::from(self.alpha) * f64::from(self.alpha), (1.0 - cos_o * cos_o).sqrt());
        let azimuth = |spoke: usize| (spoke as f64 + 0.5) / points as f64 * std::f64::consts::PI;
        let cosines: Vec<f64> = (0..points).map(|spoke| pxfm::f_cos(azimuth(spoke))).collect();
        let mut sums = [0.0f64; 2];
        for ring in 0..points {
            // The part of the distribution closer to the normal is 1 - v^2: so rings are denser towards the horizon
            let v = (ring as f64 + 0.5) / points as f64;
            let cos_h2 = v * v / (v * v + alpha2 * (1.0 - v * v));
            let (cos_h, sin_h) = (cos_h2.sqrt(), (1.0 - cos_h2).max(0.0).sqrt());
            let t = cos_h2 * (alpha2 - 1.0) + 1.0;
            // pi times the density of half vectors
            let density = alpha2 * cos_h / (t * t);
            for cos_phi in &cosines {
                let cos_oh = sin_o * sin_h * cos_phi + cos_o * cos_h;
                let cos_i = 2.0 * cos_oh * cos_h - cos_o;
                if cos_i > 0.0 && cos_oh > 0.0 {
                    let cos_io = 2.0 * cos_oh * cos_oh - 1.0;
                    let [_, parts @ ..] = self.eval(cos_i as f32, cos_o as f32, cos_io as f32);
                    for (sum, part) in sums.iter_mut().zip(parts) {
                        *sum += 2.0 * v * f64::from(part) * 4.0 * cos_oh / density;
                    }
                }
            }
        }
        sums.map(|sum| (sum / (points * points) as f64) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows: alpha; columns: n.wo = 1, 0.8, 0.5, 0.2, 0.1. Values by an integration over directions of light.
    const ALBEDO: [(f32, [f32; 5]); 5] = [
        (1.0, [0.30685, 0.35126, 0.45069, 0.64165, 0.76022]),
        (0.5625, [0.62689, 0.63026, 0.66318, 0.77200, 0.84837]),
        (0.25, [0.91581, 0.89727, 0.85727, 0.84816, 0.89162]),
        (0.1, [0.98832, 0.98457, 0.96928, 0.90456, 0.88346]),
        (0.01, [1.00000, 0.99990, 0.99972, 0.99840, 0.99369]),
    ];

    #[test]
    fn a_white_mirror_of_microfacets_reflects_what_is_known() {
        for (alpha, row) in ALBEDO {
            let lobe = GgxLobe { alpha, grazing: 1.0 };
            for (cos_o, expected) in [1.0, 0.8, 0.5, 0.2, 0.1].into_iter().zip(row) {
                let [near, grazing] = lobe.integrate_white(cos_o, 1000);
                // The cosines of narrow lobes are rounded to 32 bits
                let allowed = if alpha < 0.1 { 2e-3 } else { 1e-4 };
                assert!((near + grazing - expected).abs() < allowed, "{alpha}, {cos_o}: {} {expected}", near + grazing);
            }
        }
    }

    #[test]
    fn the_table_is_near_the_quadrature() {
        for roughness in [0.0, 0.13, 0.4, 0.77, 1.0] {
            let lobe = GgxLobe::new(roughness, 1.0);
            for cos_o in [0.11f32, 0.31, 0.5, 0.83, 1.0] {
                let exact = lobe.integrate_white(f64::from(cos_o).max(MIN_COS), 400);
                let table = lobe.white_albedo(cos_o);
                for (exact, table) in exact.into_iter().zip(table) {
                    assert!((exact - table).abs() < 0.02, "{roughness} {cos_o}: {exact} {table}");
                }
            }
        }
    }
}

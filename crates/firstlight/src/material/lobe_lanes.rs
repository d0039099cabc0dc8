//! The lobes of sixteen points of one kind, each with its own numbers in its lane.

use fearless_simd::{f32x16, prelude::*};

use super::{BlinnPhongLobe, GgxLobe, LOBE_NUMBERS, Lobe, LobeKind, PhongLobe};
use crate::math::{ExponentLanes, LANES};

/// Lobes of one kind, lane by lane.
#[derive(Clone, Debug)]
pub(crate) enum LobeLanes {
    /// No highlight.
    None,
    /// The exponents.
    Phong(ExponentLanes),
    /// Half the exponents.
    BlinnPhong(ExponentLanes),
    /// Alpha, and what is transmitted less at grazing angles.
    Ggx([[f32; LANES]; LOBE_NUMBERS]),
}

impl LobeLanes {
    /// One lobe in all lanes.
    #[inline(always)]
    pub fn of(lobe: &Lobe) -> LobeLanes {
        LobeLanes::new(lobe.kind(), lobe.numbers().map(|number| [number; LANES]))
    }

    /// Lobes with these [numbers](Lobe::numbers).
    #[inline]
    pub fn new(kind: Option<LobeKind>, numbers: [[f32; LANES]; LOBE_NUMBERS]) -> LobeLanes {
        match kind {
            None => LobeLanes::None,
            Some(LobeKind::Phong) => LobeLanes::Phong(ExponentLanes::new(numbers[0])),
            Some(LobeKind::BlinnPhong) => LobeLanes::BlinnPhong(ExponentLanes::new(numbers[0].map(|s| 0.5 * s))),
            Some(LobeKind::Ggx) => LobeLanes::Ggx(numbers),
        }
    }

    /// [`Lobe::sharpness`], lane by lane.
    #[inline(always)]
    pub fn sharpness<S: Simd>(&self, cos_o: f32x16<S>) -> f32x16<S> {
        let simd = cos_o.token();
        let slow = (cos_o * cos_o).max(simd.splat_f32x16(0.01));
        match self {
            LobeLanes::None => simd.splat_f32x16(0.0),
            LobeLanes::Phong(powers) => f32x16::simd_from(simd, *powers.values()) * 0.5,
            LobeLanes::BlinnPhong(powers) => f32x16::simd_from(simd, *powers.values()) * 0.25 / slow,
            LobeLanes::Ggx([alpha, _]) => {
                let alpha = f32x16::simd_from(simd, *alpha);
                0.5 / (alpha * alpha) / slow
            }
        }
    }

    /// Calls `put` with the number of each moment that the lobe has and its values: [`Lobe::eval`] times `weight` in so
    /// many times sixteen lanes, with the same bits.
    #[inline(always)]
    pub fn for_each_moment<S: Simd, const N: usize>(
        &self,
        cos_i: [f32x16<S>; N],
        cos_o: f32x16<S>,
        cos_io: [f32x16<S>; N],
        weight: [f32x16<S>; N],
        mut put: impl FnMut(usize, [f32x16<S>; N]),
    ) {
        let highlight = match self {
            LobeLanes::None => return put(0, products(cos_i, weight)),
            LobeLanes::Ggx(numbers) => {
                let numbers = numbers.map(|number| f32x16::simd_from(cos_o.token(), number));
                let [base, rest, grazing] = GgxLobe::eval_lanes(numbers, cos_i, cos_o, cos_io);
                put(0, products(base, weight));
                put(1, products(rest, weight));
                return put(2, products(grazing, weight));
            }
            LobeLanes::Phong(powers) => PhongLobe::eval_lanes(powers, cos_i, cos_o, cos_io),
            LobeLanes::BlinnPhong(powers) => BlinnPhongLobe::eval_lanes(powers, cos_i, cos_o, cos_io),
        };
        put(0, products(cos_i, weight));
        put(1, products(highlight, weight));
    }
}

#[inline(always)]
fn products<S: Simd, const N: usize>(one: [f32x16<S>; N], other: [f32x16<S>; N]) -> [f32x16<S>; N] {
    std::array::from_fn(
        #[inline(always)]
        |i| one[i] * other[i],
    )
}

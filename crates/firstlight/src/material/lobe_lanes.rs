//! The lobes of sixteen points of one kind, each with its own parameters in its lane.

use fearless_simd::{f32x16, prelude::*};

use super::{BlinnPhongLobe, Lobe, LobeKind, MOMENTS, PhongLobe};
use crate::math::{ExponentLanes, LANES};

/// Lobes of one kind, lane by lane.
#[derive(Clone, Debug)]
pub(crate) struct LobeLanes {
    /// `None`: no highlight.
    kind: Option<LobeKind>,
    /// The powers that the kind raises its cosine to.
    powers: ExponentLanes,
}

impl LobeLanes {
    /// One lobe in all lanes.
    #[inline(always)]
    pub fn of(lobe: &Lobe) -> LobeLanes {
        LobeLanes::new(lobe.kind(), [lobe.shininess(); LANES])
    }

    /// Lobes with these exponents.
    #[inline]
    pub fn new(kind: Option<LobeKind>, shininess: [f32; LANES]) -> LobeLanes {
        let power = |shininess: f32| match kind {
            None => 0.0,
            Some(LobeKind::Phong) => shininess,
            Some(LobeKind::BlinnPhong) => 0.5 * shininess,
        };
        LobeLanes { kind, powers: ExponentLanes::new(shininess.map(power)) }
    }

    /// How many moments are not always 0.
    #[inline(always)]
    pub fn moment_count(&self) -> usize {
        if self.kind.is_none() { 1 } else { MOMENTS }
    }

    /// [`Lobe::sharpness`], lane by lane.
    #[inline(always)]
    pub fn sharpness<S: Simd>(&self, cos_o: f32x16<S>) -> f32x16<S> {
        let simd = cos_o.token();
        let powers = f32x16::simd_from(simd, *self.powers.values());
        match self.kind {
            None => simd.splat_f32x16(0.0),
            Some(LobeKind::Phong) => powers * 0.5,
            Some(LobeKind::BlinnPhong) => powers * 0.25 / (cos_o * cos_o).max(simd.splat_f32x16(0.01)),
        }
    }

    /// [`Lobe::moments`] in so many times sixteen lanes: the same bits.
    #[inline(always)]
    pub fn moments<S: Simd, const N: usize>(
        &self,
        cos_i: [f32x16<S>; N],
        cos_o: f32x16<S>,
        cos_io: [f32x16<S>; N],
        weight: [f32x16<S>; N],
    ) -> [[f32x16<S>; N]; MOMENTS] {
        let times = |v: [f32x16<S>; N]| std::array::from_fn(|i| v[i] * weight[i]);
        let highlight = match self.kind {
            None => return [times(cos_i), [cos_o.token().splat_f32x16(0.0); N]],
            Some(LobeKind::Phong) => PhongLobe::eval_lanes(&self.powers, cos_i, cos_o, cos_io),
            Some(LobeKind::BlinnPhong) => BlinnPhongLobe::eval_lanes(&self.powers, cos_i, cos_o, cos_io),
        };
        [times(cos_i), times(highlight)]
    }
}

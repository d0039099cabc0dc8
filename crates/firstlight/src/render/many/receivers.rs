//! Bounds of the patches of a block, and of their colours.

use super::MAX_COLORS;
use super::patch::Patch;
use crate::light::ReceiverBounds;
use crate::material::{Bsdf, Lobe, ShadingPoint};
use crate::math::{Arc, DirectionCone, Vec3};
use crate::render::cut::ReceiverColors;
use crate::scene::Scene;
use crate::shape::BumpShadowing;
use crate::visibility::Viewpoint;

/// Whether two patches can have one cut.
pub(super) fn is_alike(a: &Patch, b: &Patch) -> bool {
    a.point.surface == b.point.surface && a.point.bsdf.lobe == b.point.bsdf.lobe && a.point.ns.dot(b.point.ns) > 0.0
}

pub(super) fn receiver(patch: &Patch) -> (Viewpoint, f32, bool) {
    (Viewpoint::of(&patch.point), patch.point.reach, patch.point.turn > 0.0)
}

/// The direction that the middle of a highlight comes from.
pub(super) fn mirror(point: &ShadingPoint) -> Vec3 {
    point.ns * (2.0 * point.ns.dot(point.wo)) - point.wo
}

/// The bounds of some patches of one surface and one lobe.
pub(super) fn receiver_bounds<'p>(patches: impl Iterator<Item = &'p Patch> + Clone, eye: Vec3) -> ReceiverBounds {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (mut n, mut m, mut w) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    let (mut lobe, mut is_bumpy) = (Lobe::None, false);
    for Patch { point, .. } in patches.clone() {
        (low, high) = (low.min(point.p), high.max(point.p));
        (n, m, w) = (n + point.ns, m + mirror(point), w + point.wo);
        lobe = point.bsdf.lobe;
        is_bumpy |= point.bump_shadowing != BumpShadowing::default();
    }
    let center = low + (high - low) * 0.5;
    let (n, m, w) = (n.normalize_or(Vec3::Y), m.normalize_or(Vec3::Y), w.normalize_or(Vec3::Y));
    let (mut radius, mut turn, mut blur, mut wo_turn) = (0.0f32, 0.0f32, 0.0f32, 0.0f32);
    for Patch { point, .. } in patches {
        let ShadingPoint { reach: around, turn: turns, .. } = *point;
        let swing = around / (point.p - eye).length().max(around).max(f32::MIN_POSITIVE);
        radius = radius.max((point.p - center).length() + around);
        turn = turn.max((point.ns - n).length().max((point.horizon - n).length()) + turns);
        blur = blur.max((mirror(point) - m).length() + 2.0 * turns + swing);
        wo_turn = wo_turn.max((point.wo - w).length() + swing);
    }
    let cone = |axis: Vec3, chord: f32| DirectionCone { axis, angle: Arc::of_chord(chord) };
    ReceiverBounds {
        center,
        radius,
        normals: cone(n, turn),
        mirrors: cone(m, blur),
        wo: cone(w, wo_turn),
        lobe,
        is_bumpy,
    }
}

pub(super) fn receiver_colors(scene: &Scene, bsdf: &Bsdf) -> ReceiverColors {
    ReceiverColors { base: bsdf.base(&scene.ambient), known: bsdf.colors.cosine(), error: bsdf.colors }
}

/// The colours of some patches, each once; beyond [`MAX_COLORS`] the bounds of the rest are one entry.
pub(super) fn colors<'p>(scene: &Scene, patches: impl Iterator<Item = &'p Patch>) -> Vec<ReceiverColors> {
    let mut colors: Vec<ReceiverColors> = Vec::with_capacity(MAX_COLORS);
    for patch in patches {
        let new = receiver_colors(scene, &patch.point.bsdf);
        if colors.contains(&new) {
            continue;
        }
        match colors.get_mut(MAX_COLORS - 1) {
            None => colors.push(new),
            Some(last) => {
                let (base, known) = (last.base.min(new.base), last.known.min(new.known));
                *last = ReceiverColors { base, known, error: last.error.max(new.error) };
            }
        }
    }
    colors
}

//! Patches that are looked at together: their zone and their colours.

use super::TONES;
use super::patch::Patch;
use crate::light::Zone;
use crate::material::{Bsdf, Lobe, ShadingPoint};
use crate::math::{Arc, Vec3};
use crate::render::cut::Tone;
use crate::scene::Scene;
use crate::visibility::Viewpoint;

/// Whether two patches can be looked at together.
pub(super) fn is_alike(a: &Patch, b: &Patch) -> bool {
    a.point.surface == b.point.surface && a.point.bsdf.lobe == b.point.bsdf.lobe && a.point.ns.dot(b.point.ns) > 0.0
}

pub(super) fn standing(Patch { point, .. }: &Patch) -> (Viewpoint, f32, bool) {
    (Viewpoint::of(point), point.reach, point.turn > 0.0)
}

/// The direction that the middle of a highlight comes from.
pub(super) fn mirror(ShadingPoint { ns, wo, .. }: &ShadingPoint) -> Vec3 {
    *ns * (2.0 * ns.dot(*wo)) - *wo
}

/// The zone of some patches, of one surface and one highlight.
pub(super) fn zone<'p>(patches: impl Iterator<Item = &'p Patch> + Clone, eye: Vec3) -> Zone {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (mut n, mut m, mut w) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    let mut lobe = Lobe::None;
    for Patch { point, .. } in patches.clone() {
        (low, high) = (low.min(point.p), high.max(point.p));
        (n, m, w) = (n + point.ns, m + mirror(point), w + point.wo);
        lobe = point.bsdf.lobe;
    }
    let center = low + (high - low) * 0.5;
    let (n, m, w) = (n.normalize_or(Vec3::Y), m.normalize_or(Vec3::Y), w.normalize_or(Vec3::Y));
    let (mut reach, mut turn, mut blur, mut wo_turn) = (0.0f32, 0.0f32, 0.0f32, 0.0f32);
    for Patch { point, .. } in patches {
        let ShadingPoint { reach: around, turn: turns, .. } = *point;
        let swing = around / (point.p - eye).length().max(around).max(f32::MIN_POSITIVE);
        reach = reach.max((point.p - center).length() + around);
        turn = turn.max((point.ns - n).length().max((point.horizon - n).length()) + turns);
        blur = blur.max((mirror(point) - m).length() + 2.0 * turns + swing);
        wo_turn = wo_turn.max((point.wo - w).length() + swing);
    }
    Zone {
        center,
        reach,
        n,
        turn: Arc::of_chord(turn),
        mirror: m,
        blur: Arc::of_chord(blur),
        wo: w,
        wo_turn: Arc::of_chord(wo_turn),
        lobe,
    }
}

pub(super) fn tone(scene: &Scene, bsdf: &Bsdf) -> Tone {
    Tone { base: scene.ambient * bsdf.ambient, known: bsdf.colors.cosine(), error: bsdf.colors }
}

/// The colours of some patches: each once, or where they are too many the rest as one.
pub(super) fn tones<'p>(scene: &Scene, patches: impl Iterator<Item = &'p Patch>) -> Vec<Tone> {
    let mut tones: Vec<Tone> = Vec::with_capacity(TONES);
    for patch in patches {
        let new = tone(scene, &patch.point.bsdf);
        let same = |tone: &Tone| tone.known == new.known && tone.error == new.error && tone.base == new.base;
        if tones.iter().any(same) {
            continue;
        }
        if tones.len() < TONES {
            tones.push(new);
            continue;
        }
        let last = &mut tones[TONES - 1];
        *last =
            Tone { base: last.base.min(new.base), known: last.known.min(new.known), error: last.error.max(new.error) };
    }
    tones
}

//! Where a camera's film is in front of it.

use fearless_simd::{f32x16, prelude::*};

use crate::context::CompileContext;
use crate::math::Vec2;

/// A film in front of a camera: at distance 1 from the eye of a pinhole camera, in metres for an orthographic one.
#[derive(Clone, Copy, Debug)]
pub struct FilmPlane {
    /// Half its width and half its height.
    pub half: Vec2,
    /// How far its middle is to the right of the line of sight and above it, in widths and heights of the film.
    pub shift: Vec2,
    /// In pixels.
    size: Vec2,
    /// Twice the place on the line of sight, in pixels from the upper left corner: `size`, without a shift.
    axis: Vec2,
}

/// The farthest that a film may be shifted, in widths and heights of it.
const MAX_SHIFT: f64 = 100.0;

impl FilmPlane {
    /// Of `width` x `height` pixels.
    pub(super) fn compile(cx: &mut CompileContext, shift: [f64; 2], half_height: f64, width: u32, height: u32) -> Self {
        if !shift.iter().all(|s| s.abs() <= MAX_SHIFT) {
            let message = format!("{} is outside [-100, 100]", crate::context::show(&shift));
            cx.error("shift", message, Some("in widths and heights of the film: 0.5 moves it by half its size"));
        }
        let (w, h, [right, up]) = (width as f64, height as f64, shift);
        Self {
            half: Vec2::new((half_height * w / h) as f32, half_height as f32),
            shift: Vec2::new(right as f32, up as f32),
            size: Vec2::new(width as f32, height as f32),
            axis: Vec2::new((w * (1.0 - 2.0 * right)) as f32, (h * (1.0 + 2.0 * up)) as f32),
        }
    }

    /// The place on the film at `x`, `y` in pixels from its upper left corner: to the right of the line of sight, and
    /// above.
    #[inline(always)]
    pub(super) fn place(&self, x: f32, y: f32) -> [f32; 2] {
        // 2 x / W - 1 and 1 - 2 y / H, with one rounding each: places that mirror each other on the film have rays that
        // do
        let right = (2.0 * x - self.axis.x) / self.size.x * self.half.x;
        let above = (self.axis.y - 2.0 * y) / self.size.y * self.half.y;
        [right, above]
    }

    /// The same for sixteen places: the same bits.
    #[inline(always)]
    pub(super) fn place_lanes<S: Simd>(&self, x: f32x16<S>, y: f32x16<S>) -> [f32x16<S>; 2] {
        let right = (x * 2.0 - self.axis.x) / self.size.x * self.half.x;
        let above = (self.axis.y - y * 2.0) / self.size.y * self.half.y;
        [right, above]
    }

    /// How that changes over `step` pixels to the right, and over as many down.
    #[inline(always)]
    pub(super) fn steps(&self, step: f32) -> [f32; 2] {
        [2.0 * step / self.size.x * self.half.x, -2.0 * step / self.size.y * self.half.y]
    }
}

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
    /// The intrinsics as they were said in pixels, where they were.
    pub(super) said: Option<[f64; 4]>,
}

/// The farthest that a film may be shifted, in widths and heights of it.
const MAX_SHIFT: f64 = 100.0;
/// The least and the largest focal length in pixels.
const MIN_FOCAL_PX: f64 = 0.01;
const MAX_FOCAL_PX: f64 = 1e10;

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
            said: None,
        }
    }

    /// Of `width` x `height` pixels, by the focal lengths and the principal point (the middle of the film if `None`) of
    /// a calibrated camera, in pixels.
    ///
    /// A point (X, Y, Z) before the camera, with Y down, is at x = fx X / Z + cx and y = fy Y / Z + cy. So the film at
    /// distance 1 is W / fx wide and H / fy high, and its middle (W / 2 - cx) / fx to the right of the line of sight.
    pub(super) fn from_pixels(
        cx: &mut CompileContext,
        [fx, fy]: [f64; 2],
        point: Option<[f64; 2]>,
        width: u32,
        height: u32,
    ) -> Self {
        let (w, h) = (width as f64, height as f64);
        let [px, py] = point.unwrap_or([0.5 * w, 0.5 * h]);
        for (i, focal) in [fx, fy].into_iter().enumerate() {
            let hint = "in pixels, as fx and fy of a camera matrix";
            cx.between(&format!("focal_length_px[{i}]"), focal, MIN_FOCAL_PX, MAX_FOCAL_PX, Some(hint));
        }
        let (right, up) = (0.5 - px / w, py / h - 0.5);
        if !(right.abs() <= MAX_SHIFT && up.abs() <= MAX_SHIFT) {
            let message = format!("{} is more than 100 pictures away", crate::context::show(&[px, py]));
            cx.error("principal_point_px", message, Some("in pixels from the upper left corner of the picture"));
        }
        Self {
            half: Vec2::new((0.5 * w / fx) as f32, (0.5 * h / fy) as f32),
            shift: Vec2::new(right as f32, up as f32),
            size: Vec2::new(width as f32, height as f32),
            axis: Vec2::new((2.0 * px) as f32, (2.0 * py) as f32),
            said: Some([fx, fy, px, py]),
        }
    }

    /// fx, fy, cx and cy of the camera matrix of a film at distance 1, in pixels.
    pub(super) fn intrinsics(&self) -> [f64; 4] {
        let [[hx, hy], [right, up], [w, h]] = [self.half, self.shift, self.size].map(|v| v.to_array().map(f64::from));
        self.said.unwrap_or([0.5 * w / hx, 0.5 * h / hy, w * (0.5 - right), h * (0.5 + up)])
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

    /// The place in pixels from its upper left corner that lies so far to the right of the line of sight, and above it:
    /// the way back from [`place`](Self::place).
    pub(super) fn pixel(&self, right: f64, above: f64) -> [f64; 2] {
        let [half, size, axis] = [self.half, self.size, self.axis].map(|v| v.as_dvec2());
        [0.5 * (axis.x + right / half.x * size.x), 0.5 * (axis.y - above / half.y * size.y)]
    }

    /// How that changes over `step` pixels to the right, and over as many down.
    #[inline(always)]
    pub(super) fn steps(&self, step: f32) -> [f32; 2] {
        [2.0 * step / self.size.x * self.half.x, -2.0 * step / self.size.y * self.half.y]
    }
}

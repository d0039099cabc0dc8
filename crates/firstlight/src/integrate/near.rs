//! Points of a light that is very near: as many where it is near as where it is far, so that they send alike.

use pxfm::{f_exp, f_log};

use super::view::{FlatView, Outline};

/// How the points of the unit square are spread over a light: rows by the hyperbolic sine of their parameter, in the
/// distance of the point; and places along a row in the same way, in the distance of the row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    outline: Outline,
    origin: [f64; 2],
    height2: f64,
    /// Along the light's edges; see [`FlatView`].
    feet: [f64; 2],
    lengths: [f64; 2],
    skew: f64,
    rows: Stretch,
}

/// The numbers between two, `width` times the hyperbolic sine of what goes evenly.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    width: f64,
    from: f64,
    length: f64,
}

impl Stretch {
    fn new(width: f64, [low, high]: [f64; 2]) -> Stretch {
        let from = asinh(low / width);
        Stretch { width, from, length: asinh(high / width) - from }
    }

    /// The number at a share of the way, and how fast it grows there.
    fn at(&self, share: f64) -> [f64; 2] {
        let [up, down] = [1.0, -1.0].map(|sign| f_exp(sign * (self.from + self.length * share)));
        [self.width * 0.5 * (up - down), self.width * 0.5 * (up + down) * self.length]
    }
}

fn asinh(x: f64) -> f64 {
    f_log(x.abs() + (x * x + 1.0).sqrt()).copysign(x)
}

impl Near {
    /// `None` if the light is not very near, or the point is on it.
    pub fn new(view: &FlatView) -> Option<Near> {
        let distance = f64::from(view.l0.length());
        if !view.is_near || !(distance > 0.0) {
            return None;
        }
        let lengths = [view.la, view.lb].map(f64::from);
        let height = f64::from(view.height).max(1e-3 * distance);
        Some(Near {
            outline: view.outline,
            origin: view.origin.map(f64::from),
            height2: height * height,
            feet: [view.fa, view.fb].map(f64::from),
            lengths,
            skew: f64::from(view.skew),
            rows: Stretch::new(distance / lengths[1], view.y.map(f64::from)),
        })
    }

    /// Where a point of the unit square lies on the light, and for how much of it it stands: 1 if all do for as much.
    pub fn place(&self, [u, v]: [f32; 2]) -> ([f32; 2], f32) {
        let [y, dy] = self.rows.at(f64::from(v));
        let (reach, area) = match self.outline {
            Outline::Parallelogram => (1.0, 4.0),
            Outline::Disk | Outline::Sphere => {
                let row = y + self.origin[1];
                ((1.0 - row * row).max(0.0).sqrt(), std::f64::consts::PI)
            }
        };
        let [la, lb] = self.lengths;
        let across = y * lb + self.feet[1];
        let foot = -(self.feet[0] + y * self.skew) / la;
        let width = (across * across + self.height2).sqrt() / la;
        let ends = [-reach, reach].map(|end| end - self.origin[0] - foot);
        let [x, dx] = Stretch::new(width, ends).at(f64::from(u));
        ([(x + foot) as f32, y as f32], (dx * dy / area) as f32)
    }
}

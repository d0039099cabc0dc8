//! Where the coordinates of a space are counted from, so that 32 bits of them are enough.

use super::DVec3;

/// Boxes that are farther from 0 than so many times their size are counted from their own middle. Below it, 32 bits
/// tell apart the 262,144th part of the size: less than half of a hundredth of a pixel of a large picture.
const FAR: f64 = 64.0;

/// A point is farther from 0 than this, in metres.
const FAR_POINT: f64 = 65536.0;

/// What to take off every coordinate of a space in which all is within this box: 0 unless all of it is far from 0. In
/// whole steps of about the size of the box, so that numbers keep their digits.
pub(crate) fn origin_for([low, high]: [DVec3; 2]) -> DVec3 {
    let (center, size) = ((low + high) * 0.5, (high - low).max_element());
    let far = center.abs().max_element();
    // What has no size needs no small digits, but it may have lost its size by being far
    let is_far = if size > 0.0 { far > size * FAR } else { far > FAR_POINT };
    if !(is_far && far.is_finite()) {
        return DVec3::ZERO;
    }
    // The power of two below the size, not finer than f64 has digits
    let step = size.max(far * f64::EPSILON * 16.0).max(f64::MIN_POSITIVE);
    let step = f64::from_bits(step.to_bits() & (0x7ff << 52));
    (center / step).round() * step
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(center: DVec3, size: f64) -> DVec3 {
        origin_for([center - size * 0.5, center + size * 0.5])
    }

    #[test]
    fn what_is_near_stays() {
        for (center, size) in [(0.0, 1.0), (5.0, 1.0), (63.0, 1.0), (1e-9, 1e-10), (1e8, 1e7), (0.0, 0.0), (3.0, 0.0)] {
            assert_eq!(of(DVec3::splat(center), size), DVec3::ZERO, "{center} {size}");
        }
        assert_eq!(of(DVec3::splat(f64::NAN), 1.0), DVec3::ZERO);
        assert_eq!(of(DVec3::splat(f64::INFINITY), 1.0), DVec3::ZERO);
        // A planet under a camera, a floor that is large
        assert_eq!(of(DVec3::new(0.0, -6.4e6, 0.0), 12.8e6), DVec3::ZERO);
    }

    #[test]
    fn what_is_far_is_counted_from_its_middle() {
        for center in [DVec3::new(5e6, 0.3, -2e6), DVec3::new(1e8 + 0.1, 1e8, 0.0), DVec3::splat(-2.4e8)] {
            for size in [0.001, 0.7, 1.0, 13.0, 1e4] {
                let origin = of(center, size);
                assert!((origin - center).abs().max_element() <= size * 0.5 + 1e-6, "{center} {size}: {origin}");
                // Its digits are few: what is taken off is known exactly
                let step = origin / size;
                assert!((step.round() - step).abs().max_element() < 0.5, "{origin}");
            }
        }
        // One point
        assert!((of(DVec3::splat(1e8), 0.0) - 1e8).abs().max_element() < 1e-6);
    }
}

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
    rounded(center, size)
}

/// What a camera looks at is far from the origin if it is farther from there than this many times the distance of the
/// camera: 32 bits do not resolve a thousandth of a pixel there.
const FAR_VIEW: f64 = 8.0;

/// What to take off every coordinate of a scene whose shapes are best counted from `of_shapes`, and whose camera, at
/// `eye`, looks at `target`: the same, unless `target` is far from there, beside how far the camera sees. A floor of
/// 100 km, or something at the origin of a map, takes no digits from what the camera is near to then; what is far from
/// the camera is known to as small a part of a pixel.
pub(crate) fn origin_of_view(of_shapes: DVec3, eye: DVec3, target: DVec3) -> DVec3 {
    let distance = (target - eye).length();
    let is_far = (target - of_shapes).abs().max_element() > distance * FAR_VIEW;
    if is_far && target.is_finite() && distance > 0.0 { rounded(target, distance) } else { of_shapes }
}

/// A place in whole steps of the power of two below a size, not finer than f64 has digits.
fn rounded(place: DVec3, size: f64) -> DVec3 {
    let step = size.max(place.abs().max_element() * f64::EPSILON * 16.0).max(f64::MIN_POSITIVE);
    let step = f64::from_bits(step.to_bits() & (0x7ff << 52));
    (place / step).round() * step
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
    fn what_a_camera_is_near_to_keeps_its_digits() {
        let (town, here) = (DVec3::new(450_000.0, 120.0, -5_400_000.0), DVec3::new(0.0, 3.0, 12.0));
        // Shapes of all sizes and places around leave the origin at 0; the view moves it
        let origin = origin_of_view(DVec3::ZERO, town + here, town);
        assert!((origin - town).abs().max_element() <= 8.0, "{origin}");
        assert_eq!(origin_of_view(DVec3::ZERO, here, DVec3::ZERO), DVec3::ZERO);
        assert_eq!(origin_of_view(DVec3::ZERO, here + 60.0, DVec3::splat(60.0)), DVec3::ZERO);
        // Shapes that are near to it, and what cannot be told
        assert_eq!(origin_of_view(town - 9.0, town + here, town), town - 9.0);
        assert_eq!(origin_of_view(here, town, town), here);
        assert_eq!(origin_of_view(here, town, DVec3::splat(f64::NAN)), here);
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

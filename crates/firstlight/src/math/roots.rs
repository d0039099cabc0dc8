//! Roots of functions of one variable, in f64.

/// Steps of [`bracketed`] after which the bracket has shrunk as far as it can.
const MAX_STEPS: usize = 128;

/// The root of `f` between `low` and `high`, where it has different signs: Newton's steps, and halving wherever one of
/// them leaves the bracket or shrinks it too slowly. `f` answers with its value and its slope.
///
/// Never leaves the bracket, whatever the slopes say, and always ends.
pub(crate) fn bracketed(low: f64, high: f64, low_is_negative: bool, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    // `negative` and `positive` are the ends by the sign of `f` there
    let (mut negative, mut positive) = if low_is_negative { (low, high) } else { (high, low) };
    let mut x = 0.5 * (low + high);
    let mut last_step = (high - low).abs();
    for _ in 0..MAX_STEPS {
        let (value, slope) = f(x);
        if value == 0.0 {
            return x;
        }
        *(if value < 0.0 { &mut negative } else { &mut positive }) = x;
        let newton = x - value / slope;
        let inside = (newton - negative) * (newton - positive) < 0.0;
        let next = if inside && (newton - x).abs() <= 0.5 * last_step { newton } else { 0.5 * (negative + positive) };
        last_step = (next - x).abs();
        if next == x || last_step <= f64::EPSILON * 0.5 * x.abs() {
            return next;
        }
        x = next;
    }
    x
}

/// The real roots of x^3 + p x + q between `low` and `high`, rising; a double one may be found once, twice or not at
/// all. Answers with the number of them and the roots.
pub(crate) fn depressed_cubic(p: f64, q: f64, low: f64, high: f64) -> (usize, [f64; 3]) {
    let f = |x: f64| (x * (x * x + p) + q, 3.0 * x * x + p);
    // Between its turning points the cubic rises or falls
    let turn = if p < 0.0 { (p / -3.0).sqrt() } else { 0.0 };
    let ends = [low, (-turn).clamp(low, high), turn.clamp(low, high), high];
    let (mut count, mut roots) = (0, [0.0; 3]);
    for piece in ends.windows(2) {
        let starts_negative = f(piece[0]).0 < 0.0;
        if starts_negative != (f(piece[1]).0 < 0.0) {
            roots[count] = bracketed(piece[0], piece[1], starts_negative, f);
            count += 1;
        }
    }
    (count, roots)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brackets_hold_against_misleading_slopes() {
        // Slopes that are zero, wrong, infinite, no number
        for slope in [0.0, -1.0, 1e-300, f64::INFINITY, f64::NAN] {
            let root = bracketed(-1.0, 5.0, true, |x| (x - 0.3, slope));
            assert!((root - 0.3).abs() < 1e-15, "{slope}: {root}");
            let root = bracketed(-1.0, 5.0, false, |x| (0.3 - x, slope));
            assert!((root - 0.3).abs() < 1e-15, "{slope}: {root}");
        }
        // Triple roots, where Newton's method crawls
        assert!(bracketed(-1.0, 2.0, true, |x| (x * x * x, 3.0 * x * x)).abs() < 1e-15);
    }

    #[test]
    fn cubics_have_the_roots_they_were_made_from() {
        for a in [-3.0, -1.0, 0.5, 2.0] {
            for b in [-2.5, 0.25, 1.75] {
                let c = -a - b;
                let (count, roots) = depressed_cubic(a * b + b * c + c * a, -a * b * c, -10.0, 10.0);
                let mut expected = [a, b, c];
                expected.sort_by(f64::total_cmp);
                assert_eq!(count, 3);
                for (root, expected) in roots.iter().zip(expected) {
                    assert!((root - expected).abs() < 1e-14, "{roots:?} {expected:?}");
                }
            }
        }
        // One real root, and one outside the interval
        let (count, roots) = depressed_cubic(1.0, -2.0, -10.0, 10.0);
        assert!(count == 1 && (roots[0] - 1.0).abs() < 1e-15);
        assert_eq!(depressed_cubic(1.0, -2.0, -10.0, 0.5).0, 0);
        assert_eq!(depressed_cubic(0.0, 0.0, -1.0, 1.0).0, 1);
    }
}

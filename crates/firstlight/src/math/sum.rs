//! The order of sums.

/// Partial sums, and lanes of the vectors that fill them.
pub const LANES: usize = 16;

/// A sum whose order is part of the definition of a picture: term `k` goes into partial `k mod 16`, and the partials
/// are joined in one fixed tree, so that sixteen lanes and one give the same bits.
#[derive(Clone, Copy, Debug)]
pub struct LaneSum([f32; LANES]);

impl LaneSum {
    /// Nothing yet.
    #[inline(always)]
    pub const fn new() -> Self {
        LaneSum([0.0; LANES])
    }

    /// From partials that were filled elsewhere in the same order.
    #[inline(always)]
    pub fn from_partials(partials: [f32; LANES]) -> Self {
        LaneSum(partials)
    }

    /// Adds term `k`.
    #[inline(always)]
    pub fn add(&mut self, k: usize, term: f32) {
        self.0[k % LANES] += term;
    }

    /// Joins the partials: i with i + 8, then + 4, + 2, + 1.
    #[inline(always)]
    pub fn total(&self) -> f32 {
        let p = &self.0;
        let eight = |i: usize| p[i] + p[i + 8];
        let four = |i: usize| eight(i) + eight(i + 4);
        let two = |i: usize| four(i) + four(i + 2);
        two(0) + two(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_is_the_documented_one() {
        // Numbers for which another order gives other bits
        let terms: Vec<f32> = (0..40).map(|k| 1.0 / (1.0 + k as f32) * if k % 3 == 0 { 1e4 } else { 1.0 }).collect();
        let mut sum = LaneSum::new();
        for (k, t) in terms.iter().enumerate() {
            sum.add(k, *t);
        }
        let mut p = [0.0f32; 16];
        for (k, t) in terms.iter().enumerate() {
            p[k % 16] += t;
        }
        let mut width = 8;
        while width > 0 {
            for i in 0..width {
                p[i] += p[i + width];
            }
            width /= 2;
        }
        assert_eq!(sum.total().to_bits(), p[0].to_bits());
        assert_ne!(sum.total(), terms.iter().sum::<f32>(), "these terms do not tell orders apart");
    }
}

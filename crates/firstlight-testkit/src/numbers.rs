//! Random numbers, the same for the same seed on every machine.

/// A repeatable stream of random numbers.
///
/// Source: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014: SplitMix64.
#[derive(Clone)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x6a09_e667_f3bc_c909)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 up to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// From `low` to `high`, each factor as likely as the next.
    pub fn scale(&mut self, low: f64, high: f64) -> f64 {
        pxfm::f_exp(self.between(pxfm::f_log(low), pxfm::f_log(high)))
    }

    /// A whole number below `n`.
    pub fn below(&mut self, n: u32) -> u32 {
        (self.bits() % n as u64) as u32
    }

    pub fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u32) as usize]
    }

    /// Each coordinate from -`reach` to `reach`.
    pub fn vector(&mut self, reach: f64) -> [f64; 3] {
        [0; 3].map(|_| self.between(-reach, reach))
    }

    /// A unit vector, every direction as likely.
    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = self.vector(1.0);
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.1 && length <= 1.0 {
                return v.map(|x| x * (1.0 / length));
            }
        }
    }
}

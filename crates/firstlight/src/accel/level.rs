//! The instruction set, chosen at run time.

use fearless_simd::Level;

use crate::describe::words;

words! {
    /// The vector instructions the fast renderer uses, the slowest first. All give the same bits.
    pub enum SimdLevel {
        /// The best this processor has.
        Auto = "auto",
        /// None: plain numbers.
        Fallback = "fallback",
        /// x86-64's own, 4 lanes.
        Sse2 = "sse2",
        /// x86-64-v2, 4 lanes.
        Sse42 = "sse4.2",
        /// x86-64-v3, 8 lanes.
        Avx2 = "avx2",
        /// 16 lanes.
        Avx512 = "avx512",
        /// 64-bit Arm, 4 lanes.
        Neon = "neon",
    }
}

impl SimdLevel {
    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        self.try_token().is_some()
    }

    /// The levels that this processor has, the slowest first, without `Auto`.
    pub fn available() -> Vec<SimdLevel> {
        Self::ALL.iter().copied().filter(|level| *level != SimdLevel::Auto && level.is_available()).collect()
    }

    /// What `Auto` means here; any other level is itself.
    pub fn resolve(self) -> SimdLevel {
        match self {
            SimdLevel::Auto => Self::available().last().copied().unwrap_or(SimdLevel::Fallback),
            level => level,
        }
    }

    /// The proof that the processor has it, which `dispatch!` asks for.
    pub(crate) fn token(self) -> Level {
        self.try_token().unwrap_or(Level::baseline())
    }

    #[cfg(target_arch = "x86_64")]
    fn try_token(self) -> Option<Level> {
        let detected = Level::new();
        match self {
            SimdLevel::Auto => Some(detected),
            SimdLevel::Fallback => Some(Level::fallback()),
            SimdLevel::Neon => None,
            SimdLevel::Sse2 => detected.as_sse2().map(Level::Sse2),
            SimdLevel::Sse42 => detected.as_sse4_2().map(Level::Sse4_2),
            SimdLevel::Avx2 => detected.as_avx2().map(Level::Avx2),
            SimdLevel::Avx512 => detected.as_avx512().map(Level::Avx512),
        }
    }

    #[cfg(target_arch = "aarch64")]
    fn try_token(self) -> Option<Level> {
        let detected = Level::new();
        match self {
            SimdLevel::Auto => Some(detected),
            SimdLevel::Fallback => Some(Level::fallback()),
            SimdLevel::Neon => detected.as_neon().map(Level::Neon),
            _ => None,
        }
    }

    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    fn try_token(self) -> Option<Level> {
        matches!(self, SimdLevel::Auto | SimdLevel::Fallback).then(Level::fallback)
    }
}

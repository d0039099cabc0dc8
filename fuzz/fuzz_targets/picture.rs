//! Reads hostile pictures: `cargo +nightly fuzz run -s none picture`.
//!
//! A panic inside a decoder is caught by the library, and no failure here. To look for such panics, so that they can be
//! refused before the decoder sees them, set `FUZZ_DECODERS`: then each ends the run, as every other panic does.

#![no_main]

use firstlight_testkit::hostile_picture;

libfuzzer_sys::fuzz_target!(
    init: hostile_picture::pass_over_decoders(),
    |data: &[u8]| hostile_picture::check(data)
);

//! Reads hostile scene text: `cargo +nightly fuzz run -s none scene_text`.

#![no_main]

use firstlight_testkit::hostile_text;

libfuzzer_sys::fuzz_target!(|data: &[u8]| hostile_text::check(data));

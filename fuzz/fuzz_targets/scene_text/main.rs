//! Reads hostile scene text: `cargo +nightly fuzz run scene_text`.

#![no_main]

mod check;

libfuzzer_sys::fuzz_target!(|data: &[u8]| check::scene_text(data));

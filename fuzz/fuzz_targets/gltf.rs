//! Shows hostile glTF files: `cargo +nightly fuzz run -s none gltf`.

#![no_main]

use firstlight_testkit::{hostile_model, hostile_picture};

libfuzzer_sys::fuzz_target!(
    init: hostile_picture::pass_over_decoders(),
    |data: &[u8]| hostile_model::check_bytes("gltf", data)
);

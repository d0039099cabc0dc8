//! Reads hostile PLY files: `cargo +nightly fuzz run -s none ply`.

#![no_main]

use firstlight::MeshFormat;
use firstlight_testkit::hostile_mesh;

libfuzzer_sys::fuzz_target!(|data: &[u8]| hostile_mesh::check(MeshFormat::Ply, data));

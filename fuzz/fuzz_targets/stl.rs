//! Reads hostile STL files: `cargo +nightly fuzz run -s none stl`.

#![no_main]

use firstlight::MeshFormat;
use firstlight_testkit::hostile_mesh;

libfuzzer_sys::fuzz_target!(|data: &[u8]| hostile_mesh::check(MeshFormat::Stl, data));

//! Reads hostile OBJ files: `cargo +nightly fuzz run -s none obj`.

#![no_main]

use firstlight::MeshFormat;
use firstlight_testkit::hostile_mesh;

libfuzzer_sys::fuzz_target!(|data: &[u8]| hostile_mesh::check(MeshFormat::Obj, data));

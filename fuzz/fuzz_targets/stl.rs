//! Reads hostile STL files: `cargo +nightly fuzz run stl`.

#![no_main]

mod mesh;

libfuzzer_sys::fuzz_target!(|data: &[u8]| mesh::mesh(firstlight::MeshFormat::Stl, data));

//! Reads hostile PLY files: `cargo +nightly fuzz run ply`.

#![no_main]

mod mesh;

libfuzzer_sys::fuzz_target!(|data: &[u8]| mesh::mesh(firstlight::MeshFormat::Ply, data));

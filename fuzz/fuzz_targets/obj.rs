//! Reads hostile OBJ files: `cargo +nightly fuzz run obj`.

#![no_main]

mod mesh;

libfuzzer_sys::fuzz_target!(|data: &[u8]| mesh::mesh(firstlight::MeshFormat::Obj, data));

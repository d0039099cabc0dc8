//! What the library promises, from outside.

mod course;
mod docs;
mod far;
mod files;
mod framing;
mod fuzz_corpus;
mod golden;
mod hostile_models;
mod house;
mod images;
mod invalid;
mod mtl;
mod queries;
mod receipts;
mod reference;
mod roundtrip;
mod scene_blocks;

//! What the library promises, from outside.

mod course;
mod fuzz_corpus;
mod golden;
mod invalid;
mod reference;
mod roundtrip;

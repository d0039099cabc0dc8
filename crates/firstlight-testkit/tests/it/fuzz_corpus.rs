//! Replays what fuzzing starts from and what it found, by the same check.

use std::path::Path;

use firstlight_testkit::{hostile_model, hostile_picture, hostile_text};

/// Checks each input of a folder of the corpus.
fn replay(folder: &str, check: impl Fn(&[u8])) {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(folder);
    let mut inputs = 0;
    for entry in std::fs::read_dir(corpus).unwrap() {
        check(&std::fs::read(entry.unwrap().path()).unwrap());
        inputs += 1;
    }
    assert!(inputs >= 10, "{inputs} inputs");
}

#[test]
fn nothing_in_the_corpus_breaks_the_reader() {
    replay("scene_text", hostile_text::check);
}

/// Panics of decoders among them, which are caught; a failure would name the check.
#[test]
fn no_picture_in_the_corpus_does_harm() {
    replay("picture", hostile_picture::check);
}

#[test]
fn no_model_in_the_corpus_does_harm() {
    for kind in ["gltf", "glb", "mtl"] {
        replay(kind, |bytes| hostile_model::check_bytes(kind, bytes));
    }
}

//! Replays what fuzzing starts from and what it found, by the same check.

use std::path::Path;

use firstlight_testkit::hostile_text;

#[test]
fn nothing_in_the_corpus_breaks_the_reader() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/scene_text");
    let mut inputs = 0;
    for entry in std::fs::read_dir(corpus).unwrap() {
        hostile_text::check(&std::fs::read(entry.unwrap().path()).unwrap());
        inputs += 1;
    }
    assert!(inputs >= 10, "{inputs} inputs");
}

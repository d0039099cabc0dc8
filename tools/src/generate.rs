//! `cargo xtask generate`: the files that are made from the code.

use crate::{Outcome, root, write};

pub fn run(check: bool) -> Outcome {
    let files = [("docs/src/reference.md", firstlight::reference()), ("docs/scene.schema.json", firstlight::schema())];
    for (name, text) in files {
        let path = root().join(name);
        if std::fs::read_to_string(&path).is_ok_and(|there| there == text) {
            continue;
        }
        if check {
            return Err(format!("{name} is not what the code says; run `cargo xtask generate`"));
        }
        write(&path, text.as_bytes())?;
        eprintln!("wrote {name}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_files_are_what_the_code_says() {
        assert_eq!(super::run(true), Ok(()));
    }
}

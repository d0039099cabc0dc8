//! `firstlight scenes`: what is built in.

use firstlight::builtin_scenes;

use crate::args::ScenesArgs;
use crate::report::{Failure, answer};

/// Lists the built-in scenes, or prints the text of one.
///
/// # Errors
/// There is no scene of that name.
pub fn run(args: &ScenesArgs) -> Result<(), Failure> {
    let scenes = builtin_scenes();
    let Some(name) = &args.name else {
        let width = scenes.iter().map(|scene| scene.name.len()).max().unwrap_or(0);
        let list: String = scenes.iter().map(|scene| format!("{:width$}  {}\n", scene.name, scene.title)).collect();
        return answer(&list);
    };
    match scenes.iter().find(|scene| scene.name == name) {
        Some(scene) => answer(scene.text),
        None => {
            let (near, names) = near_and_all(name);
            Err(Failure::Usage(format!("no built-in scene is called {name:?}; {near}they are {names}")))
        }
    }
}

/// What else `name` may have meant: `did you mean "config11"? ` or nothing, and the names of all built-in scenes.
pub fn near_and_all(name: &str) -> (String, String) {
    let names: Vec<&str> = builtin_scenes().iter().map(|scene| scene.name).collect();
    let nearest = names.iter().map(|known| (edits(name, known), known)).min_by_key(|(edits, _)| *edits);
    let near = match nearest {
        Some((edits, known)) if edits <= 2 => format!("did you mean {known:?}? "),
        _ => String::new(),
    };
    (near, names.join(", "))
}

/// How many characters to insert, remove or change to make one word of the other.
fn edits(from: &str, to: &str) -> usize {
    // For each length of the beginning of `to`, the edits from the beginning of `from` so far
    let mut row: Vec<usize> = (0..=to.chars().count()).collect();
    for (i, a) in from.chars().enumerate() {
        let (mut left, mut diagonal) = (i + 1, i);
        let mut places = row.iter_mut();
        if let Some(first) = places.next() {
            *first = left;
        }
        for (b, above) in to.chars().zip(places) {
            let change = diagonal + usize::from(a != b);
            diagonal = *above;
            left = change.min(left + 1).min(diagonal + 1);
            *above = left;
        }
    }
    row.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        for (from, to, n) in
            [("", "", 0), ("", "abc", 3), ("abc", "", 3), ("conifg11", "config11", 2), ("kitten", "sitting", 3)]
        {
            assert_eq!(edits(from, to), n, "{from} {to}");
        }
    }
}

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
            let names: Vec<&str> = scenes.iter().map(|scene| scene.name).collect();
            Err(Failure::Usage(format!("no built-in scene is called {name:?}; they are {}", names.join(", "))))
        }
    }
}

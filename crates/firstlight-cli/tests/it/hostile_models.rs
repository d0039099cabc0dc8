//! Models that are damaged at random: the program shows them or says what is wrong, and leaves nothing behind.

use std::fs;
use std::process::Command;

use firstlight_testkit::Random;
use firstlight_testkit::damaged::{ModelFiles, models};

use crate::common::{Folder, Ran, ran, size_of};

/// Memory that the program may have, in KiB.
const MEMORY: u64 = 2 << 20;

/// A folder with the files of a model; now and then another thing has the name of one of them.
fn folder_of(model: &ModelFiles, random: &mut Random) -> Folder {
    let folder = Folder::new();
    for (name, bytes) in &model.files {
        let path = folder.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        match random.below(30) {
            0 if *name != model.model => fs::create_dir(path).unwrap(),
            #[cfg(unix)]
            1 if *name != model.model => {
                let target = random.pick(&["/etc/passwd", "/dev/zero", "nowhere", "."]);
                std::os::unix::fs::symlink(target, path).unwrap();
            }
            _ => fs::write(path, bytes).unwrap(),
        }
    }
    folder
}

fn render(folder: &Folder, model: &str) -> Ran {
    let args = ["render", model, "--studio", "hard", "--size", "8x8", "--aa", "1", "--threads", "2", "-o", "out.png"];
    let program = folder.command(args);
    if !cfg!(target_os = "linux") {
        return ran({ program }.output().unwrap());
    }
    // An allocation beyond it would end the program by a signal
    let mut limited = Command::new("sh");
    limited.args(["-c", &format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"")]);
    limited.arg(program.get_program()).args(program.get_args()).current_dir(folder.path(""));
    ran(limited.output().unwrap())
}

#[test]
fn damaged_models_are_shown_or_refused_and_leave_nothing() {
    let (models, mut shown) = (models(), 0);
    for seed in 0..40 {
        let mut random = Random::new(1_000_000 + seed);
        let model = models[seed as usize % models.len()].damaged(&mut random);
        let folder = folder_of(&model, &mut random);
        let before = folder.names();
        let start = std::time::Instant::now();
        let ran = render(&folder, &model.model);
        let what = format!("seed {seed}, {}: {:?}: {}", model.model, ran.code, ran.stderr);
        assert!(start.elapsed().as_secs() < 20, "{what}");
        assert!(ran.stdout.is_empty() && !ran.stderr.contains("panicked"), "{what}");
        match ran.code {
            Some(0) => {
                shown += 1;
                assert_eq!(size_of(&folder.path("out.png")), (8, 8), "{what}");
                fs::remove_file(folder.path("out.png")).unwrap();
            }
            Some(1) => assert!(ran.stderr.contains(&model.model), "{what}"),
            _ => panic!("{what}"),
        }
        assert_eq!(folder.names(), before, "{what}");
    }
    assert!((4..=36).contains(&shown), "{shown} are shown");
}

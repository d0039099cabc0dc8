//! Interrupted and killed: the old file or none.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};

use crate::common::Folder;

/// The program in this folder, with signals as a shell's foreground has them: whoever started the tests may ignore some, as `nohup`
/// does, and that is inherited.
fn listening(folder: &Folder) -> Command {
    let program = env!("CARGO_BIN_EXE_firstlight");
    let resets = Command::new("env").args(["--default-signal=INT,TERM,HUP", "true"]).output();
    let mut command = if resets.is_ok_and(|output| output.status.success()) {
        let mut command = Command::new("env");
        command.args(["--default-signal=INT,TERM,HUP", program]);
        command
    } else {
        Command::new(program)
    };
    command.current_dir(folder.path("")).stdin(Stdio::null());
    command
}

/// A render that is under way, and would be for a long time. Its tiles are quick, so that it can stop soon.
struct Long {
    child: Child,
    stderr: BufReader<ChildStderr>,
}

impl Long {
    fn begin(folder: &Folder) -> Self {
        folder.put("old.png", "old");
        let mut command = listening(folder);
        let line = "render config11 --width 2048 --aa 4 --samples 4096 --tile-size 8 --threads 1 -o old.png -o new.exr \
                    --stats=stats.json";
        command.args(line.split_whitespace()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        // The first line of progress tells that it is under way
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        assert!(line.starts_with("rendered 0 %") || line.contains(" left"), "{line}");
        Long { child, stderr }
    }

    fn send(&self, signal: &str) {
        let sent = Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap();
        assert!(sent.success());
    }

    /// How it ended, and what it said at last.
    fn end(mut self) -> (ExitStatus, String) {
        let status = self.child.wait().unwrap();
        (status, std::io::read_to_string(self.stderr).unwrap())
    }
}

#[test]
fn interrupted_it_leaves_the_old_file_and_no_other() {
    for signal in ["-INT", "-TERM"] {
        let folder = Folder::new();
        let long = Long::begin(&folder);
        long.send(signal);
        let (status, said) = long.end();
        assert_eq!(status.code(), Some(130), "{signal}: {said}");
        assert!(said.contains("interrupted"), "{said}");
        assert!(!said.contains("panicked"), "{said}");
        assert_eq!(folder.names(), ["old.png"], "{signal}");
        assert_eq!(folder.get("old.png"), b"old");
    }
}

#[test]
fn interrupted_twice_it_ends_at_once() {
    let folder = Folder::new();
    let long = Long::begin(&folder);
    long.send("-INT");
    // It may have ended by then
    let _ = Command::new("kill").args(["-INT", &long.child.id().to_string()]).stderr(Stdio::null()).status();
    let (status, said) = long.end();
    assert_eq!(status.code(), Some(130), "{said}");
    assert_eq!(folder.names(), ["old.png"]);
}

#[test]
fn interrupted_between_frames_it_leaves_whole_ones() {
    let folder = Folder::new();
    let line = "render config11 --width 256 --aa 2 --samples 64 --threads 1 --frames 0..9999 -o f.png";
    let mut child = listening(&folder).args(line.split_whitespace()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut said = String::new();
    while !said.contains("wrote f.0001.png") {
        assert!(stderr.read_line(&mut said).unwrap() > 0, "{said}");
    }
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    // Two of them at least; each under its name, and nothing beside them
    let names = folder.names();
    assert!(names.len() >= 2 && names.iter().all(|name| name.starts_with("f.0")), "{names:?}");
    for name in &names {
        assert_eq!(crate::common::size_of(&folder.path(name)), (256, 256), "{name}");
    }
}

#[test]
fn killed_it_leaves_the_old_file() {
    let folder = Folder::new();
    let long = Long::begin(&folder);
    long.send("-KILL");
    let (status, _) = long.end();
    assert_eq!(status.code(), None);
    assert_eq!(folder.names(), ["old.png"]);
    assert_eq!(folder.get("old.png"), b"old");
}

#[test]
fn waiting_for_a_scene_it_ends_at_once() {
    use std::os::unix::process::ExitStatusExt;
    let folder = Folder::new();
    let mut child = folder.command(["render", "-"]).stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    // Held open, so that it goes on waiting
    let _stdin = child.stdin.take();
    std::thread::sleep(std::time::Duration::from_millis(300));
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let status = child.wait().unwrap();
    // By the signal itself where it came before the program was ready for it, or ignored INT or HUP
    assert!(status.code() == Some(130) || status.signal() == Some(15), "{status}");
    assert!(folder.names().is_empty());
}

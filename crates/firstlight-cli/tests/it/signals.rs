//! Interrupted and killed: the old file or none.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};

use crate::common::Folder;

/// The program in this folder, with signals as a shell's foreground has them: whoever started the tests may ignore
/// some, as `nohup` does, and that is inherited.
fn listening(folder: &Folder) -> Command {
    ignoring(folder, "").unwrap_or_else(|| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_firstlight"));
        command.current_dir(folder.path("")).stdin(Stdio::null());
        command
    })
}

/// The same, where these of the signals are ignored and the others are not. `None` where `env` cannot do that.
fn ignoring(folder: &Folder, ignored: &str) -> Option<Command> {
    let mut options = vec!["--default-signal=INT,TERM,HUP".to_owned()];
    if !ignored.is_empty() {
        options.push(format!("--ignore-signal={ignored}"));
    }
    let resets = Command::new("env").args(&options).arg("true").output();
    if !resets.is_ok_and(|output| output.status.success()) {
        return None;
    }
    let mut command = Command::new("env");
    command.args(&options).arg(env!("CARGO_BIN_EXE_firstlight"));
    command.current_dir(folder.path("")).stdin(Stdio::null());
    Some(command)
}

/// A render that is under way, and would be for a long time. Its tiles are quick, so that it can stop soon.
struct Long {
    child: Child,
    stderr: BufReader<ChildStderr>,
}

impl Long {
    fn begin(folder: &Folder) -> Self {
        Self::begin_as(folder, listening(folder))
    }

    fn begin_as(folder: &Folder, mut command: Command) -> Self {
        folder.put("old.png", "old");
        let line = "render config11 --width 2048 --aa 4 --samples 4096 --tile-size 8 --threads 1 -o old.png -o new.exr \
                    --stats=stats.json";
        command.args(line.split_whitespace()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        // The signals are listened to before anything is read; the picture takes many seconds
        std::thread::sleep(std::time::Duration::from_secs(1));
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

/// The log of a run has a line for what was done, and none for what was not.
#[test]
fn an_interrupted_run_leaves_the_lines_of_its_summary() {
    let folder = Folder::with_scene();
    let long = crate::common::SCENE.replace("width = 36\nheight = 24", "width = 4096\nheight = 4096");
    folder.put(
        "long.toml",
        long.replace("samples = 16", "samples = 4096").replace("antialiasing = 2", "antialiasing = 8"),
    );
    let line = "render scene.toml long.toml -o {stem}.png --summary log.jsonl --tile-size 8 --threads 1";
    let mut command = listening(&folder);
    let mut child = command.args(line.split_whitespace()).stderr(Stdio::piped()).spawn().unwrap();
    let stderr = BufReader::new(child.stderr.take().unwrap());
    // While it goes on
    let is_written = || std::fs::read(folder.path("log.jsonl")).is_ok_and(|log| log.ends_with(b"\n"));
    let written = (0..600).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(100));
        is_written()
    });
    assert!(written, "{:?}", folder.names());
    std::thread::sleep(std::time::Duration::from_millis(500));
    let long = Long { child, stderr };
    long.send("-INT");
    let (status, said) = long.end();
    assert_eq!(status.code(), Some(130), "{said}");
    assert!(said.contains("interrupted in long.toml; 1 of 2 scenes were rendered before it"), "{said}");
    assert_eq!(folder.names(), ["log.jsonl", "long.toml", "scene.png", "scene.toml"]);
    let log = String::from_utf8(folder.get("log.jsonl")).unwrap();
    assert!(log.lines().count() == 1 && log.contains("\"scene.png\"") && log.contains("\"error\":null"), "{log}");
}

/// In the background and under `nohup` some signals are ignored. The others are not, and leave no more behind than
/// ever.
#[test]
fn what_is_ignored_from_outside_stays_ignored_and_the_rest_is_not() {
    for (ignored, others) in [("INT", ["TERM", "HUP"]), ("HUP", ["TERM", "INT"]), ("INT,HUP", ["TERM", "TERM"])] {
        for signal in others {
            let folder = Folder::new();
            let Some(command) = ignoring(&folder, ignored) else { return };
            let long = Long::begin_as(&folder, command);
            for ignored in ignored.split(',') {
                long.send(&format!("-{ignored}"));
            }
            std::thread::sleep(std::time::Duration::from_millis(100));
            long.send(&format!("-{signal}"));
            let (status, said) = long.end();
            assert_eq!(status.code(), Some(130), "{ignored} ignored, {signal}: {said}");
            assert!(said.contains("interrupted; nothing was written"), "{said}");
            assert_eq!(folder.names(), ["old.png"], "{signal}");
        }
    }
}

/// A pipe that nobody reads lets its writer wait: the first signal ends that, and the file beside it does not appear.
#[test]
fn waiting_for_the_reader_of_a_pipe_it_can_be_stopped() {
    let folder = Folder::with_scene();
    if !Command::new("mkfifo").arg(folder.path("pipe.png")).status().is_ok_and(|s| s.success()) {
        return; // no such program here
    }
    let mut command = listening(&folder);
    let line = "render scene.toml --width 4 --aa 1 --samples 1 -o a.png -o pipe.png";
    let mut child = command.args(line.split(' ')).stderr(Stdio::piped()).spawn().unwrap();
    // Until it has come so far, its file is under another name
    while !folder.names().iter().any(|name| name.ends_with(".tmp")) && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert!(child.try_wait().unwrap().is_none());
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let said = std::io::read_to_string(child.stderr.take().unwrap()).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{said}");
    assert_eq!(said, "interrupted while pipe.png was written; it may have got a part\n");
    assert_eq!(folder.names(), ["pipe.png", "scene.toml"]);
    // With a reader, all goes well
    let mut reader = Command::new("cat").arg(folder.path("pipe.png")).stdout(Stdio::piped()).spawn().unwrap();
    let output = folder.command(line.split(' ')).output().unwrap();
    crate::common::ran(output).done().says(&["wrote pipe.png directly", "wrote a.png"]);
    let mut got = Vec::new();
    std::io::Read::read_to_end(&mut reader.stdout.take().unwrap(), &mut got).unwrap();
    reader.wait().unwrap();
    assert!(got == folder.get("a.png"));
}

/// The same for standard output, whose reader has stopped reading.
#[test]
fn waiting_for_the_reader_of_standard_output_it_can_be_stopped() {
    let folder = Folder::with_scene();
    let mut command = listening(&folder);
    // More than a pipe holds
    let line = "render scene.toml --width 400 --aa 1 --samples 1 -o a.png -o - --format exr";
    command.args(line.split(' ')).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    while !folder.names().iter().any(|name| name.ends_with(".tmp")) && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none());
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let said = std::io::read_to_string(child.stderr.take().unwrap()).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{said}");
    assert!(said.contains("interrupted while standard output was written"), "{said}");
    assert_eq!(folder.names(), ["scene.toml"]);
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

//! Every command that the book and the README show runs, made small.
//!
//! Blocks of shell and Python run as they stand, page by page, in a folder that has the files the text speaks of; so do
//! commands within the text, `firstlight scenes` for one. What they call `firstlight` is a script that asks the program
//! for a picture 16 pixels wide with one ray in each pixel. What cannot run has `<!-- not run: REASON -->` on the line
//! before it.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::common::{COURSE, Folder, GLTF, SCENE};

/// The program, asked for less: smaller pictures, fewer rays, two frames.
const SMALL: &str = r#"#!/bin/sh
if [ "$1" != render ]; then exec "$PROGRAM" "$@"; fi
case " $* " in *" --crop "*) crop=1 sized=1 ;; *) crop= sized= ;; esac
count=$# aa=
while [ "$count" -gt 0 ]; do
  word=$1; shift; count=$((count - 1))
  case "$word" in
    --width | --height | --size | --crop | --aa | --samples | --frames | --simd)
      value=$1; shift; count=$((count - 1))
      case "$word" in
        --width | --height | --size)
          sized=1
          case "$value" in *,*) value=16,8 ;; *) [ -n "$crop" ] || value=16 ;; esac ;;
        --crop) value=${value%,*,*},8,8 ;;
        --aa) aa=1 value=1 ;;
        --samples) [ "$value" = exact ] || value=4 ;;
        --frames) value=${value%%..*}..$((${value%%..*} + 1)) ;;
        --simd) value=fallback ;;
      esac
      set -- "$@" "$word" "$value" ;;
    *) set -- "$@" "$word" ;;
  esac
done
[ -n "$sized" ] || set -- "$@" --width 16
[ -n "$aa" ] || set -- "$@" --aa 1
exec "$PROGRAM" "$@"
"#;

/// Other programs that commands lead to or come from, and what stands in for them. Cargo runs the program and does
/// nothing else.
const OTHERS: [(&str, &str); 4] = [
    ("magick", "#!/bin/sh\ncat > /dev/null\n"),
    ("man", "#!/bin/sh\ncat > /dev/null\n"),
    ("generate-scene", "#!/bin/sh\ncat scene.toml\n"),
    (
        "cargo",
        "#!/bin/sh\ncase \"$*\" in 'run --release --bin firstlight -- '*) shift 5; exec firstlight \"$@\" ;; esac\n",
    ),
];

/// A cube.
const OBJ: &str = "\
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
";

/// A tetrahedron.
const PLY: &str = "\
ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z
element face 4\nproperty list uchar int vertex_indices\nend_header
0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3
";

/// Something of a page.
struct Piece {
    /// Its first line, from 1.
    line: usize,
    what: What,
    /// Why it is not run.
    mark: Option<String>,
}

enum What {
    /// A block of code, and its language.
    Block(String, String),
    /// A paragraph.
    Text(String),
}

/// The pages, and their names.
fn pages() -> Vec<(String, String)> {
    let root = root();
    let mut files: Vec<PathBuf> = fs::read_dir(root.join("docs/src")).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "md"));
    files.push(root.join("README.md"));
    files.sort();
    let name = |file: &Path| file.file_name().unwrap().to_string_lossy().into_owned();
    files.iter().map(|file| (name(file), without_runs(&fs::read_to_string(file).unwrap()))).collect()
}

/// A page without the stored runs that it shows, whose commands were run when they were stored; with as many lines.
fn without_runs(text: &str) -> String {
    let mut is_run = false;
    let line = |line: &str| {
        is_run = (is_run || line.starts_with("<!-- run ")) && line != "<!-- end of run -->";
        if is_run { "\n".to_owned() } else { format!("{line}\n") }
    };
    text.lines().map(line).collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The blocks and paragraphs of a page.
fn pieces(text: &str) -> Vec<Piece> {
    let (mut pieces, mut mark) = (Vec::new(), None);
    let mut lines = text.lines().enumerate().peekable();
    while let Some((number, first)) = lines.next() {
        let line = number + 1;
        let what = if let Some(language) = first.trim_start().strip_prefix("```") {
            let code: Vec<&str> =
                lines.by_ref().map(|(_, line)| line).take_while(|line| !line.trim_start().starts_with("```")).collect();
            What::Block(language.to_owned(), code.join("\n") + "\n")
        } else if let Some(reason) = first.strip_prefix("<!-- not run: ").and_then(|rest| rest.strip_suffix(" -->")) {
            assert!(reason.len() > 10, "line {line}: a mark says why");
            mark = Some(reason.to_owned());
            continue;
        } else if first.trim().is_empty() {
            continue;
        } else {
            let mut text = first.to_owned();
            while let Some((_, next)) =
                lines.next_if(|(_, l)| !l.trim().is_empty() && !l.trim_start().starts_with("```"))
            {
                text = text + "\n" + next;
            }
            What::Text(text)
        };
        pieces.push(Piece { line, what, mark: mark.take() });
    }
    pieces
}

/// What stands between backticks in a paragraph.
fn spans(text: &str) -> impl Iterator<Item = String> {
    text.split('`').skip(1).step_by(2).map(|span| span.replace('\n', " "))
}

/// Whether a line of shell calls the program.
fn calls(line: &str) -> bool {
    let line = line.trim_start();
    line.starts_with("firstlight ") || line.contains("| firstlight ") || line.contains("--bin firstlight -- ")
}

impl Piece {
    /// The interpreter and its scripts, if there is something to run.
    fn scripts(&self) -> Vec<(&'static str, String)> {
        match &self.what {
            What::Block(language, code) if language == "sh" && code.lines().any(calls) => vec![("sh", code.clone())],
            What::Block(language, code) if language == "python" && code.contains("\"firstlight\"") => {
                vec![("python3", code.clone())]
            }
            What::Block(..) => Vec::new(),
            What::Text(text) => spans(text).filter(|span| calls(span)).map(|span| ("sh", span)).collect(),
        }
    }
}

/// A folder with the files that the pages speak of.
fn workplace() -> Folder {
    let folder = Folder::new();
    for name in ["bin", "models", ".local/share/bash-completion/completions"] {
        fs::create_dir_all(folder.path(name)).unwrap();
    }
    let others = OTHERS.iter().copied().chain([("firstlight", SMALL)]);
    for (name, script) in others {
        let path = format!("bin/{name}");
        folder.put(&path, script);
        fs::set_permissions(folder.path(&path), fs::Permissions::from_mode(0o755)).unwrap();
    }
    for name in ["scene.toml", "models/shelf.toml"] {
        folder.put(name, SCENE);
    }
    // Large enough to have parts
    folder.put("room.toml", SCENE.replace("width = 36\nheight = 24\n", ""));
    folder.put("theirs.txt", COURSE);
    for name in ["bunny.obj", "spot.obj", "models/cube.obj"] {
        folder.put(name, OBJ);
    }
    for name in ["chair.gltf", "models/chair.gltf"] {
        folder.put(name, GLTF);
    }
    for name in ["bunny.ply", "models/corner.ply"] {
        folder.put(name, PLY);
    }
    std::os::unix::fs::symlink(root().join("scenes").canonicalize().unwrap(), folder.path("scenes")).unwrap();
    folder
}

/// Runs all of a page and gives the number of scripts.
fn run_page(name: &str, text: &str, python: bool) -> usize {
    let folder = workplace();
    let path = format!("{}:{}", folder.path("bin").display(), std::env::var("PATH").unwrap_or_default());
    let (mut ran, mut said) = (0, String::new());
    for piece in pieces(text) {
        // A scene whose name was just said is a file from here on
        if let What::Block(language, code) = &piece.what
            && language == "toml"
            && let Some(file) = spans(&said).filter(|span| span.ends_with(".toml") && !span.contains(['/', ' '])).last()
        {
            folder.put(&file, code);
        }
        let scripts = piece.scripts();
        if let Some(reason) = &piece.mark {
            assert!(
                !scripts.is_empty(),
                "{name}:{}: nothing here would be run without the mark ({reason})",
                piece.line
            );
        } else {
            for (interpreter, script) in scripts {
                if interpreter == "python3" && !python {
                    continue;
                }
                let mut command = Command::new(interpreter);
                if interpreter == "sh" {
                    command.arg("-e");
                }
                let output = command
                    .args(["-c", &script])
                    .current_dir(folder.path("."))
                    .envs([("PATH", path.as_str()), ("PROGRAM", env!("CARGO_BIN_EXE_firstlight")), ("NO_COLOR", "1")])
                    .env("HOME", folder.path("."))
                    .stdin(Stdio::null())
                    .output()
                    .unwrap();
                let stderr = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{name}:{}:\n{script}\n{stderr}", piece.line);
                ran += 1;
            }
        }
        said = match piece.what {
            What::Text(text) => text,
            What::Block(..) => String::new(),
        };
    }
    ran
}

#[test]
fn every_command_of_the_book_and_the_readme_runs() {
    let python = Command::new("python3").arg("--version").output().is_ok_and(|o| o.status.success());
    let pages = pages();
    let ran: usize = std::thread::scope(|scope| {
        let threads: Vec<_> =
            pages.iter().map(|(name, text)| scope.spawn(move || run_page(name, text, python))).collect();
        // The text of a panic was printed by its own thread
        threads.into_iter().map(|thread| thread.join().expect("a command failed, see above")).sum()
    });
    println!("{ran} scripts");
    assert!(ran > 40, "only {ran} scripts were found");
}

#[test]
fn a_page_is_cut_into_what_runs_and_what_does_not() {
    let page = "Say `firstlight\nscenes` or `first`.\n\n```sh\necho\n```\n<!-- not run: it takes a year -->\n```sh\n\
        x | firstlight render -\n```\n";
    let found: Vec<_> = pieces(page).iter().map(|p| (p.line, p.mark.is_some(), p.scripts().len())).collect();
    assert_eq!(found, [(1, false, 1), (4, false, 0), (8, true, 1)]);
}

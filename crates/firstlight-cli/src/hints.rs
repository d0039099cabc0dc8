//! What somebody may have meant who wrote a command or an option that does not exist: the words of other programs, and
//! what they are here.

use std::ffi::OsStr;
use std::path::Path;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use firstlight::{builtin_scenes, printable};

/// Options of other programs, without their value, and what does the same here.
const OPTIONS: &[(&[&str], &str)] = &[
    (
        &["--spp", "--samples-per-pixel", "--sample-count", "--num-samples", "--pixelsamples", "-s"],
        "points on each area light are --samples N, camera rays in each pixel --aa N (N x N of them)",
    ),
    (&["--antialias", "--antialiasing", "--msaa"], "camera rays in each pixel are --aa N (N x N of them)"),
    (&["-Q", "--preset"], "edges are --aa N and --aa-mode full, area lights --samples N or --samples exact"),
    (
        &["--error", "--noise-threshold", "--adaptive-threshold", "--epsilon", "--precision"],
        "how far a pixel may be off is --tolerance T, in steps of an 8-bit picture",
    ),
    (&["--quick", "--fast", "--draft", "--preview"], "a quick look is --width 320 --aa 1 --samples 16"),
    (&["-j", "--jobs", "-t", "--num-threads", "--nthreads", "--cores", "--cpus"], "threads are --threads N"),
    (&["--resolution", "--res", "--dimensions", "-w", "-W", "-H", "-r"], "the picture's size is --width and --height"),
    (
        &["--out", "--output-file", "--outfile", "--render-output", "--filename", "--image", "-O"],
        "the picture's file is -o FILE",
    ),
    (
        &["--render-format", "--output-format", "--file-format", "-F"],
        "the ending of -o FILE says the format: .png, .jpg, .exr or .hdr",
    ),
    (&["--fps", "--frame-rate", "--framerate"], "the scene says it, as fps in [render]; --frames A..B renders frames"),
    (
        &[
            "--frame",
            "--render-frame",
            "--render-anim",
            "--frame-start",
            "--frame-end",
            "--start",
            "--end",
            "-f",
            "-a",
            "-e",
        ],
        "frames are --frames A..B, a moment is --time SECONDS",
    ),
    (&["--region", "--border", "--window", "--cropwindow", "--crop-window"], "a part of it is --crop X,Y,WIDTH,HEIGHT"),
    (&["--tile", "--tiles", "--bucket-size", "--block-size", "-b"], "tiles are --tile-size PIXELS"),
    (&["--ev", "--brightness", "--gain"], "exposure in stops is --exposure EV"),
    (
        &["--gamma", "--tonemap", "--tone-mapping", "--view-transform"],
        "it is --display srgb, neutral, linear or gamma=G; exposure is --exposure EV",
    ),
    (&["--fov", "--focal-length"], "the scene says it, as fov_y_deg or focal_length_mm of a [camera]"),
    (&["--auto-smooth", "--smoothing", "--smooth-angle"], "normals of a model are made smooth by --smooth DEGREES"),
    (
        &["--array", "--chunk", "--slice", "--num-shards", "--node"],
        "a part of the pictures, for job arrays, is --shard i/n",
    ),
    (&["--timeout", "--time-limit"], "how long a picture may take is --max-time SECONDS"),
    (&["--memory", "--memory-limit", "--max-mem"], "how much memory a scene may take is --max-memory MIB"),
    (&["--recursive", "-R"], "a folder stands for the models in it and in the folders below"),
    (
        &["--orbit", "--spin", "--num-views", "--camera-orbit"],
        "views from all around are --turntable N, from several sides --views front,side,top",
    ),
    (&["--log-file", "--report", "--manifest"], "a line of JSON for each picture is --summary FILE.jsonl"),
    (&["--seed"], "none is needed: the picture has the same bits every time"),
    (
        &["--denoise", "--denoiser"],
        "there is no noise to take out: area lights are integrated, or sampled alike everywhere",
    ),
    (
        &["--bounces", "--max-bounces", "--max-depth", "--depth", "--integrator", "--engine", "-E"],
        "there is one way of rendering, direct light: one bounce",
    ),
    (
        &["--gpu", "--device", "--backend", "--cuda", "--optix"],
        "it runs on the processor: --threads N and --simd LEVEL",
    ),
    (&["--verbose", "-v", "--debug", "--log", "--progress"], "what it took is said by --stats"),
    (&["--silent", "--no-progress"], "silence is --quiet"),
    (&["--force", "--overwrite", "-y"], "a picture that is there is replaced without asking"),
    (&["--input", "-i", "--file", "--model"], "the scene needs no option: firstlight render room.toml"),
    (&["-I", "-L", "--include", "--search-path"], "folders that a scene may read besides its own are --allow-dir DIR"),
    (&["--dry-run", "--validate", "--lint"], "firstlight check SCENE looks for faults without rendering"),
    (&["--list", "--list-scenes", "--scenes"], "firstlight scenes lists what is built in"),
    (
        &["--interactive", "--gui", "--display-server", "--show"],
        "nothing opens a window: a picture is written to a file",
    ),
];

/// Words in the place of a command, and what does it here.
const COMMANDS: &[(&[&str], &str)] = &[
    (&["version"], "firstlight --version"),
    (
        &["draw", "make", "run", "trace", "raytrace", "bake", "image", "picture", "thumbnail"],
        "firstlight render SCENE writes a picture",
    ),
    (&["animate", "animation", "anim", "frames"], "firstlight render SCENE --frames A..B"),
    (&["view", "show", "open", "preview", "gui"], "firstlight render SCENE writes a picture; nothing opens a window"),
    (&["validate", "lint", "test"], "firstlight check SCENE"),
    (&["compare", "cmp", "difference", "idiff", "flip"], "firstlight diff A B"),
    (&["reproduce", "checksum"], "firstlight verify FILE"),
    (&["list", "ls", "examples", "builtin"], "firstlight scenes"),
    (&["stat", "stats", "describe", "inspect", "dump"], "firstlight info SCENE"),
    (&["convert", "import", "export"], "models are read as they are: firstlight render bunny.ply"),
    (&["doc", "docs", "manual"], "firstlight man | man -l -"),
    (&["completion", "complete"], "firstlight completions SHELL"),
];

/// Adds to an error of usage what may have been meant, and takes from it what could disturb a terminal.
pub fn improve(mut error: Error) -> Error {
    let word = |error: &Error, kind| match error.get(kind) {
        Some(ContextValue::String(word)) => Some(word.clone()),
        _ => None,
    };
    let meant = match error.kind() {
        ErrorKind::UnknownArgument => word(&error, ContextKind::InvalidArg).and_then(|word| of_option(&word)),
        ErrorKind::InvalidSubcommand => word(&error, ContextKind::InvalidSubcommand).and_then(|word| of_command(&word)),
        _ => None,
    };
    if let Some(meant) = meant {
        // In place of the nearest spelling, which is seldom the nearest meaning
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::SuggestedSubcommand);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![StyledStr::from(meant)]));
    }
    let clean: Vec<_> = error.context().map(|(kind, value)| (kind, cleaned(value))).collect();
    for (kind, value) in clean {
        if let Some(value) = value {
            error.insert(kind, value);
        }
    }
    error
}

/// The same words as they can be shown, if they come from the command line.
fn cleaned(value: &ContextValue) -> Option<ContextValue> {
    let line = |text: &StyledStr| StyledStr::from(printable(&text.to_string()).into_owned());
    match value {
        ContextValue::String(text) => Some(ContextValue::String(printable(text).into_owned())),
        ContextValue::Strings(list) => {
            Some(ContextValue::Strings(list.iter().map(|text| printable(text).into_owned()).collect()))
        }
        ContextValue::StyledStrs(list) => Some(ContextValue::StyledStrs(list.iter().map(line).collect())),
        _ => None,
    }
}

/// What an option of another program is here.
fn of_option(option: &str) -> Option<String> {
    let name = option.split_once('=').map_or(option, |(name, _)| name);
    if name.starts_with('+') && name[1..].starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Some("options begin with dashes: --width 320 --height 240 --aa 4 -o FILE".into());
    }
    let found = OPTIONS.iter().find(|(names, _)| names.contains(&name));
    found.map(|(_, meant)| (*meant).to_owned())
}

/// What a word in the place of a command may have meant: a scene whose command was forgotten, or another program's
/// word.
fn of_command(word: &str) -> Option<String> {
    let path = Path::new(word);
    let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
    let is_scene = matches!(ending.as_deref(), Some("toml" | "json" | "txt" | "ply" | "stl" | "obj"));
    if is_scene || word == "-" || path.is_file() || builtin_scenes().iter().any(|scene| scene.name == word) {
        return Some(format!("to render it: firstlight render {word}"));
    }
    let lower = word.to_ascii_lowercase();
    let found = COMMANDS.iter().find(|(words, _)| words.contains(&lower.as_str()));
    found.map(|(_, meant)| format!("did you mean: {meant}"))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use clap::CommandFactory;

    use super::*;
    use crate::args::Cli;

    /// The long and short options of all commands.
    fn known() -> HashSet<String> {
        let mut cli = Cli::command();
        cli.build();
        let mut known = HashSet::new();
        for command in std::iter::once(&cli).chain(cli.get_subcommands()) {
            for option in command.get_arguments() {
                known.extend(option.get_long().map(|long| format!("--{long}")));
                known.extend(option.get_short().map(|short| format!("-{short}")));
            }
        }
        known
    }

    #[test]
    fn hints_name_options_that_exist_for_those_that_do_not() {
        let known = known();
        let mut seen = HashSet::new();
        for (names, meant) in OPTIONS {
            for name in *names {
                assert!(!known.contains(*name), "{name} exists");
                assert!(seen.insert(*name), "{name} has two meanings");
            }
            for word in meant.split(|c: char| c.is_whitespace() || ",;:()".contains(c)) {
                assert!(!word.starts_with('-') || known.contains(word), "{word} of {meant:?} does not exist");
            }
        }
    }

    #[test]
    fn hints_name_commands_that_exist_for_those_that_do_not() {
        let cli = Cli::command();
        let known: HashSet<&str> = cli.get_subcommands().map(|command| command.get_name()).collect();
        for (words, meant) in COMMANDS {
            assert!(words.iter().all(|word| !known.contains(word)), "{words:?}");
            let command = meant.split("firstlight ").nth(1).and_then(|rest| rest.split_whitespace().next());
            let command = command.unwrap_or_else(|| panic!("{meant:?} names no command"));
            assert!(command.starts_with("--") || known.contains(command), "{meant:?}");
        }
    }
}

//! The program `firstlight`: a scene in, pictures out. All that needs knowing about light is in the library.

mod args;
mod buffers;
mod check;
mod diff;
mod difference;
mod faster;
mod hints;
mod info;
mod input;
mod interrupt;
mod output;
mod progress;
mod relight;
mod render;
mod report;
mod scenes;
mod stats;
mod verify;
mod view_buffer;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use args::{Cli, Command};
use report::{Failure, answer};

fn main() -> ExitCode {
    interrupt::install();
    hush_decoders();
    // Wrong usage, help and version are clap's to say
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            let e = hints::improve(e);
            let said = e.print();
            return match said {
                Err(why) if why.kind() != std::io::ErrorKind::BrokenPipe => ExitCode::from(1),
                _ => ExitCode::from(if e.use_stderr() { 2 } else { 0 }),
            };
        }
    };

    let (name, result) = match &cli.command {
        Command::Render(args) => ("render", render::run(args)),
        Command::Check(args) => ("check", check::run(args)),
        Command::Info(args) => ("info", info::run(args)),
        Command::Scenes(args) => ("scenes", scenes::run(args)),
        Command::Buffers => ("buffers", buffers::run()),
        Command::Diff(args) => ("diff", diff::run(args)),
        Command::Relight(args) => ("relight", relight::run(args)),
        Command::Verify(args) => ("verify", verify::run(args)),
        Command::ViewBuffer(args) => ("view-buffer", view_buffer::run(args)),
        Command::Schema => ("schema", answer(&with_newline(firstlight::schema()))),
        Command::Completions(args) => ("completions", completions(args.shell)),
        Command::Man => ("man", man()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.show(name);
            failure.exit_code()
        }
    }
}

/// What the library catches is told as a damaged picture: nothing else is said of it.
fn hush_decoders() {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !firstlight::is_decoding() {
            hook(panic);
        }
    }));
}

fn with_newline(mut text: String) -> String {
    if !text.ends_with('\n') {
        text.push('\n');
    }
    text
}

/// `firstlight completions SHELL`
fn completions(shell: clap_complete::Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "firstlight", &mut script);
    answer(&String::from_utf8_lossy(&script))
}

/// `firstlight man`: the page of the program, then one of each command.
fn man() -> Result<(), Failure> {
    let mut program = Cli::command();
    program.build();
    let mut roff = Vec::new();
    let commands = program.get_subcommands().filter(|command| command.get_name() != "help");
    let pages = std::iter::once(&program).chain(commands);
    for page in pages {
        // The page of a command is called firstlight-render(1), and its synopsis begins `firstlight render`
        let title = page.get_display_name().unwrap_or(page.get_name()).to_owned();
        let source = format!("firstlight {}", env!("CARGO_PKG_VERSION"));
        let man = clap_mangen::Man::new(page.clone()).title(title).source(source);
        man.render(&mut roff).map_err(|e| Failure::Work(format!("the manual: {e}")))?;
    }
    answer(&String::from_utf8_lossy(&roff))
}

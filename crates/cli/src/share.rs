use crate::args::ShareArgs;
use anyhow::Context;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// Runs `voxtile-share` from the folder of this program or from PATH. It is a separate program because its network
/// library would make this one six times as large.
pub fn run(args: &ShareArgs) -> anyhow::Result<ExitCode> {
    let program = next_to_this_program().unwrap_or_else(|| PathBuf::from(name()));
    match replace_process(Command::new(program).args(&args.arguments)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound && asks_for_help(&args.arguments) => {
            println!("{HELP}");
            Ok(ExitCode::SUCCESS)
        }
        ran => ran.with_context(|| {
            let hint =
                "install it next to voxtile or on PATH with `cargo install --locked --path crates/share-node`";
            format!("cannot run {}: {hint}", name())
        }),
    }
}

/// Replaces this process by the program, so that the program receives signals directly.
#[cfg(unix)]
fn replace_process(program: &mut Command) -> io::Result<ExitCode> {
    Err(std::os::unix::process::CommandExt::exec(program))
}

/// Runs a program and returns its exit code.
#[cfg(not(unix))]
fn replace_process(program: &mut Command) -> io::Result<ExitCode> {
    // There is no exit code after a signal.
    let code = program.status()?.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}

/// Help if the program is missing; its own help lists all options.
const HELP: &str = "\
Share occupied space with other robots: publish a map or scans, subscribe to others

Usage: voxtile share --publish <MAP_OR_SCANS> --robot <NAME> [OPTIONS]
       voxtile share --subscribe -o <MAP> [OPTIONS]
       voxtile share --fold <LAYER> -o <MAP>
       voxtile share --measure <SCANS>...

The program voxtile-share was not found next to voxtile or on PATH. It is installed separately, because its network
library is six times as large as voxtile. To install it from the sources of voxtile:

    cargo install --locked --path crates/share-node

After that, this help lists all options. See docs/sharing.md for the protocol.";

fn asks_for_help(arguments: &[OsString]) -> bool {
    arguments.first().is_none_or(|first| first == "help")
        || arguments.iter().any(|argument| argument == "--help" || argument == "-h")
}

fn next_to_this_program() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?.with_file_name(name());
    program.is_file().then_some(program)
}

fn name() -> String {
    format!("voxtile-share{}", std::env::consts::EXE_SUFFIX)
}

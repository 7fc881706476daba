use crate::args::ShareArgs;
use anyhow::Context;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// Runs `voxtile-share`, which lies beside this program or on the PATH: its network library would make this one six
/// times as large.
pub fn run(args: &ShareArgs) -> anyhow::Result<ExitCode> {
    let program = beside_this_program().unwrap_or_else(|| PathBuf::from(name()));
    match become_it(Command::new(program).args(&args.arguments)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound && asks_for_help(&args.arguments) => {
            println!("{HELP}");
            Ok(ExitCode::SUCCESS)
        }
        ran => ran.with_context(|| {
            let hint =
                "put it beside voxtile or on the PATH (cargo install --path crates/share-node installs it)";
            format!("cannot run {}: {hint}", name())
        }),
    }
}

/// Runs a program in place of this one, which ends here: signals that are sent to this process are the program's.
#[cfg(unix)]
fn become_it(program: &mut Command) -> io::Result<ExitCode> {
    Err(std::os::unix::process::CommandExt::exec(program))
}

/// Runs a program and ends as it does.
#[cfg(not(unix))]
fn become_it(program: &mut Command) -> io::Result<ExitCode> {
    // Ended from outside: there may be no code.
    let code = program.status()?.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}

/// What there is to say without the program, whose own help has all options.
const HELP: &str = "\
Share what is occupied with other robots: publish a map or scans, subscribe to others

Usage: voxtile share --publish <MAP_OR_SCANS> --robot <NAME> [OPTIONS]
       voxtile share --subscribe -o <MAP> [OPTIONS]
       voxtile share --fold <LAYER> -o <MAP>
       voxtile share --measure <SCANS>...

The work is done by the program voxtile-share, which is not here: neither beside voxtile nor on the PATH. It comes
separately, since its network library is six times as large as voxtile. To install it, in the sources of voxtile:

    cargo install --locked --path crates/share-node

Then this help lists all options. docs/sharing.md says what is shared, and how.";

fn asks_for_help(arguments: &[OsString]) -> bool {
    arguments.first().is_none_or(|first| first == "help")
        || arguments.iter().any(|argument| argument == "--help" || argument == "-h")
}

fn beside_this_program() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?.with_file_name(name());
    program.is_file().then_some(program)
}

fn name() -> String {
    format!("voxtile-share{}", std::env::consts::EXE_SUFFIX)
}

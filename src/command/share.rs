use crate::command::args::ShareArgs;
use anyhow::Context;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// Runs `voxtile-share`, which lies beside this program or on the PATH: its network library would make this one six
/// times as large.
pub fn run(args: &ShareArgs) -> anyhow::Result<ExitCode> {
    let program = beside_this_program().unwrap_or_else(|| PathBuf::from(name()));
    let status = match Command::new(program).args(&args.arguments).status() {
        Err(error) if error.kind() == io::ErrorKind::NotFound && asks_for_help(&args.arguments) => {
            println!("{HELP}");
            return Ok(ExitCode::SUCCESS);
        }
        status => status.with_context(|| {
            let hint =
                "put it beside voxtile or on the PATH (cargo install --path programs/share installs it)";
            format!("cannot run {}: {hint}", name())
        })?,
    };
    // Ended by a signal: there is no code.
    let code = status.code().and_then(|code| u8::try_from(code).ok());
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

    cargo install --locked --path programs/share

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

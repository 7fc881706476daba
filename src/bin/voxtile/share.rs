use crate::args::ShareArgs;
use anyhow::Context;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// Runs `voxtile-share`, which lies beside this program or on the PATH: its network library would make this one six times
/// as large.
pub fn run(args: &ShareArgs) -> anyhow::Result<ExitCode> {
    let program = beside_this_program().unwrap_or_else(|| PathBuf::from(name()));
    let status = Command::new(program).args(&args.arguments).status().with_context(|| {
        let hint = "put it beside voxtile or on the PATH (cargo build --release -p voxtile-share makes it)";
        format!("cannot run {}: {hint}", name())
    })?;
    // Ended by a signal: there is no code.
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}

fn beside_this_program() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?.with_file_name(name());
    program.is_file().then_some(program)
}

fn name() -> String {
    format!("voxtile-share{}", std::env::consts::EXE_SUFFIX)
}

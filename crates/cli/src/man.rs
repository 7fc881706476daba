use crate::args::{Cli, ManArgs};
use anyhow::Context;
use clap::CommandFactory;
use std::fs;
use std::process::ExitCode;

/// Writes `voxtile.1` and one `voxtile-COMMAND.1` per command.
pub fn run(args: &ManArgs) -> anyhow::Result<ExitCode> {
    let folder = &args.output;
    let cannot = || format!("{}: cannot write the man pages", folder.display());
    fs::create_dir_all(folder).with_context(cannot)?;
    clap_mangen::generate_to(Cli::command(), folder).with_context(cannot)?;
    Ok(ExitCode::SUCCESS)
}

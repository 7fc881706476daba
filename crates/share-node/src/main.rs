//! Binary of `voxtile share`: exchanges sets of occupied voxels over Zenoh.
//!
//! The protocol is in [`voxtile_share`]. This crate adds the transport, the clock and the files.

mod args;
mod files;
mod fold;
mod inbox;
mod json;
mod layer_store;
mod link;
mod measure;
mod network_file;
mod output;
mod publish;
mod reports;
mod robot_name;
mod subscribe;

use args::{Args, Mode};
use clap::{CommandFactory, Parser};
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn main() {
    let code = exit_code(&Args::parse());
    // Ignore a failure, because standard output may be closed.
    let _ = std::io::stdout().flush();
    // Threads of the network still run. End without the destructors of global values, which they may use.
    signal_hook::low_level::exit(code)
}

fn exit_code(args: &Args) -> i32 {
    match run(args) {
        Ok(()) => 0,
        Err(error) => {
            output::report(format_args!("{error:#}"));
            if args.json {
                // Ignore a failure, because standard output may be closed.
                let _ = json::print(&json::failure(&error));
            }
            if error.is::<voxtile::Error>() { 2 } else { 1 }
        }
    }
}

fn run(args: &Args) -> anyhow::Result<()> {
    match args.mode()? {
        Mode::Publish(source) => publish::run(args, &source, &*stop_signal()?),
        Mode::Subscribe(output) => subscribe::run(args, &output, &*stop_signal()?),
        Mode::Fold(layer, output) => fold::run(args, &layer, &output),
        Mode::Measure(scans) => measure::run(args, &scans),
        Mode::Man => print_man_page(),
    }
}

fn print_man_page() -> anyhow::Result<()> {
    // This name makes the page available as `man voxtile-share`, like the pages of the other commands.
    let command = Args::command().name("voxtile-share");
    Ok(clap_mangen::Man::new(command).render(&mut std::io::stdout().lock())?)
}

/// Returns a flag that the first Ctrl-C or SIGTERM sets. A second signal ends the process at once.
fn stop_signal() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 130, stop.clone())?;
        signal_hook::flag::register(signal, stop.clone())?;
    }
    Ok(stop)
}

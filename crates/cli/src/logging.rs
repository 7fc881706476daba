use crate::args::{Cli, LogFormatName};
use crate::progress;
use log::{Level, Record};
use std::fmt::Arguments;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;
use voxtile_monitoring::{CountedLog, json_line};

/// Whether lines on standard error are JSON objects.
static IS_JSON: AtomicBool = AtomicBool::new(false);

/// Starts the log on standard error. Levels of the command line override the environment.
pub fn begin(cli: &Cli) {
    let mut log = env_logger::Builder::new();
    log.filter_level(cli.log_level()).format_timestamp(None);
    log.target(env_logger::Target::Pipe(Box::new(progress::AboveBar)));
    if !cli.quiet && cli.verbose == 0 {
        log.parse_default_env();
    }
    if matches!(cli.log_format, LogFormatName::Json) {
        IS_JSON.store(true, Ordering::Relaxed);
        log.format(|out, record| writeln!(out, "{}", json_line(record, SystemTime::now())));
    }
    let logger = log.build();
    let level = logger.filter();
    // `run` requires a process of its own, so there is no other logger.
    if log::set_boxed_logger(Box::new(CountedLog(logger))).is_ok() {
        log::set_max_level(level);
    }
}

/// Prints a line on standard error. Ignores a failed write, which cannot be reported.
pub fn print_message(line: Arguments<'_>) {
    print(Level::Info, line);
}

/// Prints an error on standard error.
pub fn print_error(line: Arguments<'_>) {
    print(Level::Error, line);
}

fn print(level: Level, line: Arguments<'_>) {
    let mut out = std::io::stderr().lock();
    let _ = if IS_JSON.load(Ordering::Relaxed) {
        let record = Record::builder().level(level).target("voxtile").args(line).build();
        writeln!(out, "{}", json_line(&record, SystemTime::now()))
    } else {
        writeln!(out, "voxtile: {line}")
    };
}

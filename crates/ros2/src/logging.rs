use crate::args::Args;
use crate::log_format::LogFormat;
use log::LevelFilter;
use std::io::Write as _;
use std::time::SystemTime;
use voxtile_monitoring::{CountedLog, json_line};

/// Levels of other modules. ros2-client logs an error when it counts the subscribers of a topic without any. The rustdds
/// writer logs an error when a reader requests a message that a newer one has replaced; some readers repeat the request
/// 100 times.
const OTHERS: &str = "rustdds=error,rustdds::rtps::writer=off,ros2_client=off";

/// Starts the log on standard error. `--verbose` overrides `RUST_LOG`.
pub fn begin(args: &Args) {
    voxtile_monitoring::note_start();
    let mut builder = env_logger::Builder::new();
    let filter = match args.verbose {
        0 => "info",
        1 => "info,voxtile_ros2=debug",
        _ => "info,voxtile=debug,voxtile_ros2=trace",
    };
    let variable = std::env::var(env_logger::DEFAULT_FILTER_ENV).ok().filter(|_| args.verbose == 0);
    builder.parse_filters(&variable.unwrap_or_else(|| format!("{filter},{OTHERS}")));
    if args.log_format == LogFormat::Json {
        builder.format(|out, record| writeln!(out, "{}", json_line(record, SystemTime::now())));
    }
    let logger = builder.build();
    let level = logger.filter();
    // The only logger of the process, so this cannot fail.
    if log::set_boxed_logger(Box::new(CountedLog(logger))).is_ok() {
        log::set_max_level(level);
    }
}

/// Reports the error that ends the node.
pub fn report(error: &anyhow::Error, format: LogFormat) {
    match format {
        LogFormat::Json if log::max_level() >= LevelFilter::Error => log::error!("{error:#}"),
        _ => eprintln!("voxtile-ros2: {error:#}"),
    }
}

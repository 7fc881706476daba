use std::fs;
use std::thread;

/// The machine and its current load.
pub fn description() -> String {
    format!("{}, {}", processor(), load())
}

/// The CPU and the number of its cores.
pub fn processor() -> String {
    let cpus = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("unknown CPU", |(_, name)| name.trim());
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get());
    format!("{model}, {cores} core(s)")
}

/// Load average of the last minute, on Linux.
fn load() -> String {
    let loads = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    match loads.split_whitespace().next() {
        Some(load) => format!("load {load} at the end of the run, which itself adds 1 to 2"),
        None => "load unknown".to_owned(),
    }
}

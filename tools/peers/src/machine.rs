use anyhow::Result;
use std::fs;
use std::thread;

/// The machine and what was compiled how, in one line.
pub fn description(octomap_version: &str) -> Result<String> {
    let cpus = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("unknown CPU", |(_, name)| name.trim());
    let cores = thread::available_parallelism()?;
    Ok(format!(
        "Machine: {model}, {cores} core(s). OctoMap {octomap_version}, g++ -O2 -DNDEBUG -ffp-contract=off; \
         voxtile: cargo's release profile, no CPU of its own named."
    ))
}

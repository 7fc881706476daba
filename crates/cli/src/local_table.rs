use serde::Serialize;
use std::io::{self, Write};
use std::time::Duration;
use voxtile_local::{LocalMap, LocalParameters, LocalReport, StageTimes};

/// Results of inserting scans into a local map. The fields have the names of the voxel mapping paper.
#[derive(Debug, Serialize)]
pub struct Row {
    pub setup: &'static str,
    pub parameters: LocalParameters,
    pub scans: u64,
    pub points: u64,
    pub skipped: u64,
    /// Number of stored voxels at the end.
    pub n_occ: usize,
    /// Mean number of inflated voxels.
    pub n_inf: f64,
    /// Processor time of an update in milliseconds.
    pub cpu_ms: Distribution,
    /// Wall-clock time of an update in milliseconds.
    pub t_tot_ms: Distribution,
    /// Mean wall-clock time of each stage in milliseconds.
    pub stages_ms: Stages,
    /// Peak memory of the map in bytes.
    pub bytes: usize,
    /// Bytes per voxel with occupancy or inflation, at the end.
    pub bytes_per_voxel: f64,
    #[serde(skip)]
    updates: Vec<Times>,
}

/// Duration of an update in milliseconds.
#[derive(Clone, Copy, Debug)]
struct Times {
    cpu: f64,
    clock: f64,
    stages: Stages,
}

/// Statistics of many durations.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Distribution {
    pub mean: f64,
    pub p99: f64,
    pub max: f64,
}

/// Mean duration of each stage.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Stages {
    pub input: f64,
    pub rays: f64,
    pub occupancy: f64,
    pub removal: f64,
    pub inflation: f64,
    pub publishing: f64,
}

/// Number of scans between two measurements of memory. Each measurement visits the whole map.
const COUNT_EVERY: u64 = 16;

impl Row {
    pub fn new(setup: &'static str, parameters: &LocalParameters) -> Self {
        let (scans, points, skipped, n_occ, bytes) = Default::default();
        let (n_inf, cpu_ms, t_tot_ms, stages_ms, bytes_per_voxel, updates) = Default::default();
        let parameters = *parameters;
        Self {
            setup,
            parameters,
            scans,
            points,
            skipped,
            n_occ,
            n_inf,
            cpu_ms,
            t_tot_ms,
            stages_ms,
            bytes,
            bytes_per_voxel,
            updates,
        }
    }

    pub fn add(&mut self, report: &LocalReport, cpu_seconds: f64, map: &LocalMap) {
        self.scans += 1;
        self.points += report.points;
        self.skipped += report.skipped.total() + report.beyond_input_range;
        self.n_inf += map.inflated_voxels() as f64;
        let (cpu, clock) = (cpu_seconds * 1e3, ms(report.times.total()));
        self.updates.push(Times { cpu, clock, stages: Stages::of(&report.times) });
        if self.scans.is_multiple_of(COUNT_EVERY) {
            self.bytes = self.bytes.max(map.bytes());
        }
    }

    /// Measures the memory of the map after the last update.
    pub fn count_memory(&mut self, map: &LocalMap) {
        self.n_occ = map.stored_voxels();
        let bytes = map.bytes();
        self.bytes = self.bytes.max(bytes);
        self.bytes_per_voxel = bytes as f64 / map.voxels().max(1) as f64;
    }

    /// Replaces times by those of another run of the same scans where these are shorter.
    pub fn take_minimum(&mut self, other: &Self) {
        for (times, other) in self.updates.iter_mut().zip(&other.updates) {
            times.cpu = times.cpu.min(other.cpu);
            times.clock = times.clock.min(other.clock);
            times.stages = times.stages.with(&other.stages, f64::min);
        }
    }

    /// Computes means and distributions from the updates.
    pub fn finish(&mut self) {
        let scans = self.scans.max(1) as f64;
        self.n_inf /= scans;
        self.cpu_ms = Distribution::of(&mut self.updates.iter().map(|times| times.cpu).collect::<Vec<_>>());
        self.t_tot_ms =
            Distribution::of(&mut self.updates.iter().map(|times| times.clock).collect::<Vec<_>>());
        let share = |sum: f64, time: f64| sum + time / scans;
        self.stages_ms =
            self.updates.iter().fold(Stages::default(), |sum, times| sum.with(&times.stages, share));
    }

    /// Prints the row as text; times in milliseconds per update.
    pub fn print(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(
            out,
            "{:<10} {:>6} {:>6} {:>8} {:>8} {:>10}  {:>6} {:>6} {:>6}  {:>5} {:>5} {:>5} {:>5} {:>5} {:>5}  {:>6} {:>7}",
            "setup",
            "d_in",
            "d_inf",
            "n_lim",
            "n_occ",
            "n_inf",
            "t_cpu",
            "p99",
            "t_tot",
            "t_in",
            "t_ray",
            "t_occ",
            "t_inf",
            "t_m",
            "t_pub",
            "MB",
            "B/voxel"
        )?;
        let LocalParameters { input_range_m, inflation_range_m, max_voxels, .. } = self.parameters;
        let limit = max_voxels.map_or("none".to_owned(), |limit| limit.to_string());
        let Stages { input, rays, occupancy, removal, inflation, publishing } = self.stages_ms;
        writeln!(
            out,
            "{:<10} {:>6} {:>6} {:>8} {:>8} {:>10.0}  {:>6.2} {:>6.2} {:>6.2}  {:>5.2} {:>5.2} {:>5.2} {:>5.2} {:>5.2} \
             {:>5.2}  {:>6.1} {:>7.1}",
            self.setup,
            input_range_m,
            inflation_range_m,
            limit,
            self.n_occ,
            self.n_inf,
            self.cpu_ms.mean,
            self.cpu_ms.p99,
            self.t_tot_ms.mean,
            input,
            rays,
            occupancy,
            inflation,
            removal,
            publishing,
            self.bytes as f64 / 1e6,
            self.bytes_per_voxel,
        )?;
        let points = self.points as f64 / self.scans.max(1) as f64;
        let scans = self.scans;
        let units = "lengths in m, times in ms per update (t_cpu, p99: processor time)";
        writeln!(out, "{scans} scans, {points:.0} points each; {units}")
    }
}

impl Stages {
    fn of(times: &StageTimes) -> Self {
        Self {
            input: ms(times.input),
            rays: ms(times.rays),
            occupancy: ms(times.occupancy),
            removal: ms(times.removal),
            inflation: ms(times.inflation),
            publishing: ms(times.publishing),
        }
    }

    /// Applies `join` to the two values of each stage.
    fn with(&self, other: &Self, join: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            input: join(self.input, other.input),
            rays: join(self.rays, other.rays),
            occupancy: join(self.occupancy, other.occupancy),
            removal: join(self.removal, other.removal),
            inflation: join(self.inflation, other.inflation),
            publishing: join(self.publishing, other.publishing),
        }
    }
}

impl Distribution {
    fn of(values: &mut [f64]) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let (Some(&max), count) = (values.last(), values.len()) else { return Self::default() };
        let mean = values.iter().sum::<f64>() / count as f64;
        Self { mean, p99: values[(count * 99).div_ceil(100) - 1], max }
    }
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn take_minimum_keeps_the_shorter_time_of_each_update() {
        let row = |times: [f64; 2]| {
            let mut row = Row::new("a", &LocalParameters::local_mapping());
            let of =
                |cpu: f64| Times { cpu, clock: 2.0 * cpu, stages: Stages { rays: cpu, ..Stages::default() } };
            (row.scans, row.updates) = (2, times.map(of).to_vec());
            row
        };
        let mut least = row([1.0, 5.0]);
        least.take_minimum(&row([4.0, 2.0]));
        least.finish();
        assert_eq!((least.cpu_ms.mean, least.cpu_ms.max, least.t_tot_ms.mean), (1.5, 2.0, 3.0));
        assert_eq!((least.stages_ms.rays, least.stages_ms.input), (1.5, 0.0));
    }

    #[test]
    fn p99_is_the_99th_of_100_values() {
        let mut values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let Distribution { mean, p99, max } = Distribution::of(&mut values);
        assert_eq!((mean, p99, max), (50.5, 99.0, 100.0));
        assert_eq!(Distribution::of(&mut []).p99, 0.0);
        assert_eq!(Distribution::of(&mut [3.0]).p99, 3.0);
    }
}

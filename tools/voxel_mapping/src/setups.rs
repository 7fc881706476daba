//! Table I of the paper: updates of a local map with five setups.

use anyhow::Result;
use report::{Cell, Samples, Stopwatch, Table};
use std::path::Path;
use voxtile::Scan;
use voxtile::space::{Grid, Point};
use voxtile_formats::{ReadOptions, ScanSource, open_scans};
use voxtile_local::{LocalMap, LocalParameters, LocalReader, LocalState};

const RESOLUTION_M: f64 = 0.1;
/// Interval of memory counts, in scans: a count visits the whole map.
const COUNT_EVERY: usize = 16;

/// Name, input range and inflation range in metres, and maximum number of voxels.
type Setup = (&'static str, f64, f64, Option<usize>);

const SETUPS: [Setup; 5] = [
    ("a", f64::INFINITY, 8.0, Some(50_000)),
    ("b", f64::INFINITY, 8.0, Some(250_000)),
    ("c", f64::INFINITY, 8.0, None),
    (RELAYED, f64::INFINITY, f64::INFINITY, Some(50_000)),
    ("e", 10.0, 8.0, Some(50_000)),
];
/// The setup whose map receives the newly occupied voxels of another map.
const RELAYED: &str = "d";

/// Runs the scans with a map of each setup, `repeat` times, and prints the table.
pub fn run(scans: &Path, points: Option<u32>, repeat: u32) -> Result<()> {
    let columns = ["setup", "n_occ", "n_inf", "t_cpu (ms)", "p99 (ms)", "MB", "B/voxel"];
    let mut table = Table::new("setups", "Updates of the local map.", columns);
    for setup in SETUPS {
        let mut best = run_setup(scans, points, setup)?;
        for _ in 1..repeat {
            let again = run_setup(scans, points, setup)?;
            best.cpu_ms.iter_mut().zip(again.cpu_ms).for_each(|(least, ms)| *least = least.min(ms));
        }
        table.push(best.cells(setup.0));
    }
    print!("{}", table.markdown());
    Ok(())
}

/// Result of one setup.
#[derive(Default)]
struct Outcome {
    /// CPU time of each update.
    cpu_ms: Vec<f64>,
    /// Voxels with occupancy at the end.
    occupied: usize,
    /// Sum of the inflated voxels over all updates.
    inflated: usize,
    /// Maximum memory, in bytes.
    bytes: usize,
    bytes_per_voxel: f64,
}

impl Outcome {
    fn cells(&self, name: &str) -> [Cell; 7] {
        let updates = self.cpu_ms.len().max(1) as f64;
        let samples: Samples = self.cpu_ms.iter().copied().collect();
        [
            name.into(),
            Cell::Count(self.occupied as u64),
            Cell::Number(self.inflated as f64 / updates, 0),
            Cell::Number(self.cpu_ms.iter().sum::<f64>() / updates, 2),
            Cell::Number(samples.quantile(0.99), 2),
            Cell::Number(self.bytes as f64 / 1e6, 1),
            Cell::Number(self.bytes_per_voxel, 1),
        ]
    }
}

fn run_setup(scans: &Path, points: Option<u32>, (name, d_in, d_inf, n_lim): Setup) -> Result<Outcome> {
    let parameters = LocalParameters::local_mapping().with_ranges(d_in, d_inf).with_max_voxels(n_lim);
    let mut source = open_scans(scans, &ReadOptions::default())?;
    let mut map = LocalMap::new(RESOLUTION_M, parameters)?;
    let mut relay = if name == RELAYED { Some(Relay::new(parameters)?) } else { None };
    let mut outcome = Outcome::default();
    while let Some(scan) = next_scan(&mut *source, points)? {
        let relayed = relay.as_mut().map(|relay| relay.points(&scan)).transpose()?;
        let watch = Stopwatch::start()?;
        match relayed {
            Some(points) => map.insert_relayed(scan.origin, &points)?,
            None => map.insert_scan(&scan)?,
        };
        outcome.cpu_ms.push(watch.stop()?.own_s * 1e3);
        outcome.inflated += map.inflated_voxels();
        if outcome.cpu_ms.len().is_multiple_of(COUNT_EVERY) {
            outcome.bytes = outcome.bytes.max(map.bytes());
        }
    }
    let bytes = map.bytes();
    outcome.occupied = map.stored_voxels();
    outcome.bytes = outcome.bytes.max(bytes);
    outcome.bytes_per_voxel = bytes as f64 / map.voxels().max(1) as f64;
    Ok(outcome)
}

/// The next scan, in the world frame, with at most `points` points.
fn next_scan(source: &mut dyn ScanSource, points: Option<u32>) -> Result<Option<Scan>> {
    let Some(scan) = source.next_scan()? else { return Ok(None) };
    let mut scan = scan.into_scan();
    scan.intensities = None;
    if let Some(most) = points.map(|points| points as usize).filter(|&most| most < scan.points.len()) {
        let all = scan.points.len();
        scan.points = (0..most).map(|k| scan.points[k * all / most]).collect();
    }
    Ok(Some(scan))
}

/// A map of another robot that sends its newly occupied voxels.
struct Relay {
    map: LocalMap,
    reader: LocalReader,
    grid: Grid,
}

impl Relay {
    fn new(parameters: LocalParameters) -> Result<Self> {
        let map = LocalMap::new(RESOLUTION_M, parameters.with_ranges(f64::INFINITY, 0.0))?;
        Ok(Self { reader: map.reader(), grid: Grid::new(RESOLUTION_M, 64.0 * RESOLUTION_M)?, map })
    }

    /// Centers of the voxels that became occupied with a scan, in metres.
    fn points(&mut self, scan: &Scan) -> Result<Vec<Point>> {
        self.map.insert_scan(scan)?;
        let (_, changes) = self.reader.changes();
        let new = changes.into_iter().filter(|change| change.after == LocalState::Occupied);
        Ok(new.map(|change| self.grid.center_m(change.voxel)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relay_sends_each_newly_occupied_voxel_once() {
        let mut relay = Relay::new(LocalParameters::local_mapping()).unwrap();
        let points: Vec<Point> = (0..40).map(|k| [2.05, 0.1 * f64::from(k) + 0.05, 0.05]).collect();
        let scan = Scan { origin: [0.05; 3], points: points.clone(), intensities: None };
        let mut sent = relay.points(&scan).unwrap();
        sent.sort_by(|a, b| a[1].total_cmp(&b[1]));
        let is_near = |(a, b): (&Point, &Point)| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-9);
        assert!(sent.len() == points.len() && sent.iter().zip(&points).all(is_near), "{sent:?}");
        assert_eq!(relay.points(&scan).unwrap(), Vec::<Point>::new());
    }
}

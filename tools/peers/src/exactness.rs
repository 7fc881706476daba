use crate::contenders::{Contenders, Counting, Job};
use crate::table::Row;
use crate::workloads::{Files, Workload};
use anyhow::{Context, Result};
use peers::{VoxelRecord, read_voxels};
use std::fs::File;
use std::io::BufReader;
use testkit::reference_map::{ReferenceMap, Voxels};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::{InsertMode, MapConfig};
use workload::ScanReader;

/// Tolerance for OctoMap's log-odds, which are sums of `f32`.
const TOLERANCE: f64 = 1e-3;
/// Minimum share of the voxels that agree with OctoMap.
const MIN_AGREEMENT: f64 = 0.999;
/// Minimum share if every ray counts. It is lower: a voxel differs if only one of the programs counts one of the many
/// rays that graze it.
const MIN_AGREEMENT_PER_RAY: f64 = 0.99;
const TILE_SIZE_M: f64 = 10.0;

/// Differences between a map and the naive one.
#[derive(Debug, Default, PartialEq)]
struct Difference {
    /// Voxels in either map.
    voxels: usize,
    /// Voxels only in the naive map.
    missing: usize,
    /// Voxels only in the other map, or twice in it.
    extra: usize,
    /// Voxels with other values.
    other_value: usize,
}

/// Compares the maps of both contenders with the naive map, voxel by voxel, after the first scans of a workload.
pub fn rows(
    workload: &Workload,
    files: &Files,
    contenders: &Contenders,
    faults: &mut Vec<String>,
) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (counting, what) in
        [(Counting::PerScan, ""), (Counting::PerRay, ", every ray"), (Counting::Iwlo, ", IWLO")]
    {
        if counting == Counting::Iwlo && files.intensities.is_none() {
            continue;
        }
        eprintln!("{}: the naive map{what}", workload.name);
        let least = if counting == Counting::PerRay { MIN_AGREEMENT_PER_RAY } else { MIN_AGREEMENT };
        let scans = if counting == Counting::PerScan { workload.exact_scans } else { 1 };
        let job = Job { workload, files, scans, counting };
        let naive = naive_map(&job)?;
        let dump = files.folder.join("voxels");
        contenders.dump_voxtile(&job, &dump)?;
        let voxtile = difference(&naive, &read_voxels(&dump)?, |voxel, &(log_odds_bits, count)| {
            (voxel.log_odds.to_bits(), voxel.observation_count) == (log_odds_bits, count)
        });
        let what = format!("voxels that differ from the naive map's, {scans} scan(s){what}");
        if voxtile.count() > 0 {
            faults.push(format!("{}: {what}: voxtile {}", workload.name, voxtile.text()));
        }
        let mut octomap_text = String::new();
        if counting != Counting::Iwlo {
            contenders.dump_octomap(&job, &dump)?;
            let octomap = difference(&naive, &read_voxels(&dump)?, |voxel, &(log_odds_bits, _)| {
                (voxel.log_odds - f64::from_bits(log_odds_bits)).abs() <= TOLERANCE
            });
            octomap_text = octomap.text();
            if octomap.agreement() < least {
                faults.push(format!("{}: {what}: OctoMap {octomap_text}", workload.name));
            }
        }
        rows.push(Row {
            what,
            workload: workload.name.clone(),
            octomap: octomap_text,
            voxtile: voxtile.text(),
            ratio: None,
            target: None,
        });
    }
    Ok(rows)
}

fn naive_map(job: &Job<'_>) -> Result<Voxels> {
    let mut config =
        MapConfig::new(job.workload.resolution_m, TILE_SIZE_M)?.with_range(0.0, job.max_range_m());
    let opened = |path| File::open(path).map(BufReader::new);
    let mut intensities = None;
    match (job.counting, &job.files.intensities) {
        (Counting::PerRay, _) => config = config.with_insert_mode(InsertMode::PerRay),
        (Counting::Iwlo, Some(path)) => {
            config = config.with_sensor_model(SensorModel::Iwlo(Iwlo::default()));
            intensities = Some(opened(path)?);
        }
        _ => {}
    }
    let mut map = ReferenceMap::new(&config);
    for scan in ScanReader::new(opened(&job.files.stream)?, intensities).take(job.scans) {
        map.insert_scan(&scan.with_context(|| format!("{}: cannot read", job.files.stream.display()))?);
    }
    Ok(map.voxels)
}

/// Compares the voxels of a contender; `agrees` compares a voxel with the evidence in the naive map.
fn difference(
    naive: &Voxels,
    voxels: &[VoxelRecord],
    agrees: impl Fn(&VoxelRecord, &(u64, i32)) -> bool,
) -> Difference {
    let mut rest = naive.clone();
    let mut difference = Difference::default();
    for voxel in voxels {
        match rest.remove(&voxel.index) {
            None => difference.extra += 1,
            Some(evidence) => difference.other_value += usize::from(!agrees(voxel, &evidence)),
        }
    }
    difference.missing = rest.len();
    difference.voxels = naive.len() + difference.extra;
    difference
}

impl Difference {
    fn count(&self) -> usize {
        self.missing + self.extra + self.other_value
    }

    /// Share of the voxels that agree, 0 to 1.
    fn agreement(&self) -> f64 {
        1.0 - self.count() as f64 / self.voxels.max(1) as f64
    }

    fn text(&self) -> String {
        let Self { voxels, missing, extra, other_value } = self;
        match self.count() {
            0 => format!("0 of {voxels}"),
            count => {
                format!("{count} of {voxels}: {missing} missing, {extra} extra, {other_value} other value")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_difference_is_counted() {
        let naive: Voxels = [([0; 3], (0, 1)), ([1; 3], (0, 1)), ([2; 3], (0, 1))].into();
        let record = |x: i32, count| VoxelRecord { index: [x; 3], observation_count: count, log_odds: 0.0 };
        let voxels = [record(0, 1), record(1, 2), record(3, 1), record(0, 1)];
        let found = difference(&naive, &voxels, |voxel, evidence| voxel.observation_count == evidence.1);
        assert_eq!(found, Difference { voxels: 5, missing: 1, extra: 2, other_value: 1 });
        assert_eq!(found.text(), "4 of 5: 1 missing, 2 extra, 1 other value");
        let same = difference(&naive, &[record(0, 1), record(1, 1), record(2, 1)], |_, _| true);
        assert_eq!((same.count(), same.agreement()), (0, 1.0));
    }
}

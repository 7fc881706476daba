use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use voxtile::space::MAX_VOXELS_PER_TILE_EDGE;
use voxtile::{MapConfig, Scan};
use voxtile_formats::{ReadOptions, open_scans};
use workload::SurveyName;

/// Scans of the measurements.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Name in tables and plots.
    pub name: &'static str,
    /// Number of scans whose rays together update voxels about 30 million times, at a resolution of 0.1 m.
    pub some_scans: usize,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    Synthetic(SurveyName),
    /// A folder of scans and poses.
    Recorded(PathBuf),
}

/// Maximum range, in metres.
pub const MAX_RANGE_M: f64 = 60.0;
const SEED: u64 = 1;
/// Approximate edge of a tile, in metres.
const TILE_SIZE_M: f64 = 10.0;

/// The synthetic surveys, and the recorded sets in the folder `data`.
pub fn datasets(data: &Path) -> Vec<Dataset> {
    let synthetic = [("street", 3, SurveyName::Street), ("indoor", 8, SurveyName::Indoor)];
    let mut datasets: Vec<Dataset> = synthetic
        .map(|(name, some_scans, survey)| Dataset { name, some_scans, source: Source::Synthetic(survey) })
        .into();
    let recorded = [
        ("riverside", 8, "mulran_riverside02_a"),
        ("courtyard", 20, "fastlio_hku_1"),
        ("hall", 4, "balm_os0_hall"),
    ];
    for (name, some_scans, folder) in recorded {
        let recorded = report::recorded_set(data, folder);
        datasets.extend(recorded.map(|path| Dataset { name, some_scans, source: Source::Recorded(path) }));
    }
    datasets
}

impl Dataset {
    /// Reads or generates at most `count` scans from the beginning, without intensities.
    pub fn scans(&self, count: usize) -> Result<Vec<Scan>> {
        let mut scans = match &self.source {
            Source::Synthetic(survey) => survey.scans(SEED, 0, SurveyName::RAYS).take(count).collect(),
            Source::Recorded(folder) => {
                recorded(folder, count).with_context(|| format!("the set {}", self.name))?
            }
        };
        scans.iter_mut().for_each(|scan| scan.intensities = None);
        Ok(scans)
    }
}

fn recorded(folder: &Path, count: usize) -> Result<Vec<Scan>> {
    let mut source = open_scans(folder, &ReadOptions::default())?;
    let mut scans = Vec::new();
    while scans.len() < count {
        let Some(scan) = source.next_scan()? else { break };
        scans.push(scan.into_scan());
    }
    Ok(scans)
}

/// Settings of a map with this edge of a voxel in metres, tiles of about 10 m, OctoMap's log-odds and the common
/// maximum range.
pub fn map_config(resolution_m: f64) -> Result<MapConfig> {
    let voxels_per_tile_edge = (TILE_SIZE_M / resolution_m).round();
    Ok(MapConfig::new(resolution_m, voxels_per_tile_edge * resolution_m)?.with_range(0.0, MAX_RANGE_M))
}

/// Settings of a map with one large tile, and the scans moved so that they begin in its middle. As in the paper, there
/// is then one voxel cache and one octree, if no scan leaves the tile.
pub fn in_one_tile(resolution_m: f64, scans: Vec<Scan>) -> Result<(MapConfig, Vec<Scan>)> {
    let tile_size_m = f64::from(MAX_VOXELS_PER_TILE_EDGE) * resolution_m;
    let config = MapConfig::new(resolution_m, tile_size_m)?.with_range(0.0, MAX_RANGE_M);
    let Some(first) = scans.first() else { return Ok((config, scans)) };
    let by_m = first.origin.map(|x| tile_size_m / 2.0 - x);
    Ok((config, scans.into_iter().map(|scan| scan.translated(by_m)).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_resolution_of_the_paper_has_tiles() {
        for tenths in 1..=9 {
            let config = map_config(f64::from(tenths) * 0.1).unwrap();
            assert!((9.0..11.0).contains(&config.grid.tile_size_m()), "{tenths}");
        }
    }

    #[test]
    fn scans_within_half_a_tile_are_in_one_tile() {
        use voxtile::{InMemoryMapper, MapView, Mapper};
        let (config, scans) = in_one_tile(0.2, datasets(Path::new(""))[0].scans(2).unwrap()).unwrap();
        let mut mapper = InMemoryMapper::new(config).unwrap();
        for scan in &scans {
            mapper.insert_scan(scan).unwrap();
        }
        assert_eq!(mapper.statistics().tiles, 1);
    }

    #[test]
    fn missing_recorded_sets_are_left_out() {
        let empty = tempfile::tempdir().unwrap();
        let names: Vec<_> = datasets(empty.path()).iter().map(|dataset| dataset.name).collect();
        assert_eq!(names, ["street", "indoor"]);
    }
}

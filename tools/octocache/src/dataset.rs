use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use voxtile::io::open_scans;
use voxtile::{MapConfig, Scan};
use workload::SurveyName;

/// Scans that the questions are put to.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// What tables and plots call it.
    pub name: &'static str,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    MadeUp(SurveyName),
    /// A folder of scans and poses.
    Recorded(PathBuf),
}

/// Cuts rays, in metres.
pub const MAX_RANGE_M: f64 = 60.0;
/// Seed of the made-up surveys.
const SEED: u64 = 1;
/// Edge of a tile that is wanted, in metres.
const TILE_SIZE_M: f64 = 10.0;

/// The made-up surveys, and the recorded sets that are in the folder `data`.
pub fn datasets(data: &Path) -> Vec<Dataset> {
    let made_up = [("street", SurveyName::Street), ("indoor", SurveyName::Indoor)];
    let made_up = made_up.map(|(name, survey)| Dataset { name, source: Source::MadeUp(survey) });
    let recorded =
        [("riverside", "mulran_riverside02_a"), ("courtyard", "fastlio_hku_1"), ("hall", "balm_os0_hall")];
    let mut datasets: Vec<Dataset> = made_up.into();
    for (name, folder) in recorded {
        let path = data.join(folder);
        if path.join("scans").is_dir() {
            datasets.push(Dataset { name, source: Source::Recorded(path) });
        } else {
            eprintln!("octocache: {name} is skipped: no folder {}", path.display());
        }
    }
    datasets
}

impl Dataset {
    /// Reads or makes the first scans, no more than so many, without intensities.
    pub fn scans(&self, count: usize) -> Result<Vec<Scan>> {
        let mut scans = match &self.source {
            Source::MadeUp(survey) => survey.scans(SEED, 0).take(count).collect(),
            Source::Recorded(folder) => {
                recorded(folder, count).with_context(|| format!("the set {}", self.name))?
            }
        };
        scans.iter_mut().for_each(|scan| scan.intensities = None);
        Ok(scans)
    }
}

fn recorded(folder: &Path, count: usize) -> Result<Vec<Scan>> {
    let mut source = open_scans(folder, None)?;
    let mut scans = Vec::new();
    while scans.len() < count {
        let Some(scan) = source.next_scan()? else { break };
        scans.push(scan.into_scan());
    }
    Ok(scans)
}

/// A map with voxels of this edge in metres, tiles of about 10 m, OctoMap's log-odds and the max range of all questions.
pub fn map_config(resolution_m: f64) -> Result<MapConfig> {
    let voxels_per_tile_edge = (TILE_SIZE_M / resolution_m).round();
    Ok(MapConfig::new(resolution_m, voxels_per_tile_edge * resolution_m)?.with_range(0.0, MAX_RANGE_M))
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
    fn recorded_sets_that_are_not_there_are_left_out() {
        let empty = tempfile::tempdir().unwrap();
        let names: Vec<_> = datasets(empty.path()).iter().map(|dataset| dataset.name).collect();
        assert_eq!(names, ["street", "indoor"]);
    }
}

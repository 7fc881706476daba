use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use voxtile::{MapConfig, MemoryLimit, Scan};
use voxtile_formats::{ReadOptions, open_scans};
use workload::SurveyName;

/// Scans, and the settings of the map built from them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Case {
    /// Name in tables and plots.
    pub name: String,
    pub input: Input,
    pub resolution_m: f64,
    pub tile_size_m: f64,
    /// Maximum range: longer rays are cut, in metres.
    pub max_range_m: f64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Input {
    /// From a synthetic survey.
    Synthetic {
        survey: SurveyName,
        /// Approximate number of rays of a scan.
        rays: u32,
        scans: usize,
    },
    /// Every n-th scan of a synthetic survey.
    EveryNth {
        survey: SurveyName,
        /// Approximate number of rays of a scan.
        rays: u32,
        scans: usize,
        /// Step between used scans of the survey.
        every: usize,
    },
    /// From a folder of recorded scans and poses.
    Recorded { folder: PathBuf },
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Limit {
    /// The map is in memory and is never written to disk.
    InMemory,
    /// The map is out of core, with a limit above its size.
    None,
    /// The map is out of core, with a limit in bytes for all that grows.
    Bytes(usize),
}

const SEED: u64 = 1;
/// Larger than any map here.
const UNLIMITED_BYTES: usize = 1 << 44;

impl Case {
    /// Returns the settings of the map.
    ///
    /// # Errors
    ///
    /// Fails for lengths that do not form a grid.
    pub fn config(&self, limit: Limit) -> Result<MapConfig> {
        let config = MapConfig::new(self.resolution_m, self.tile_size_m)?.with_range(0.0, self.max_range_m);
        Ok(match limit {
            Limit::InMemory => config,
            Limit::None => config.with_memory_bytes(UNLIMITED_BYTES),
            Limit::Bytes(bytes) => config.with_memory_bytes(bytes),
        })
    }

    /// The smallest memory limit that a map with these settings accepts, in bytes.
    ///
    /// # Errors
    ///
    /// As for [`Case::config`].
    pub fn min_bytes(&self) -> Result<usize> {
        Ok(MemoryLimit::min_bytes(&self.config(Limit::InMemory)?.grid))
    }

    /// Returns whether the scans follow a trajectory, so that its length measures progress.
    pub fn follows_trajectory(&self) -> bool {
        match &self.input {
            Input::Synthetic { survey, .. } | Input::EveryNth { survey, .. } => survey.spacing_m().is_some(),
            Input::Recorded { .. } => true,
        }
    }

    /// Returns the scans in order, generated or read one at a time.
    ///
    /// # Errors
    ///
    /// Fails if the folder cannot be read; each scan that cannot be read is an error too.
    pub fn scans(&self) -> Result<Box<dyn Iterator<Item = Result<Scan>>>> {
        match &self.input {
            Input::Synthetic { survey, rays, scans } => Ok(Box::new(
                survey.scans(SEED, 0, *rays).take(*scans).map(|scan| Ok(without_intensities(scan))),
            )),
            Input::EveryNth { survey, rays, scans, every } => {
                let (survey, rays, every) = (*survey, *rays, *every);
                // Generates each scan by its number, not those between.
                let scan = move |k: usize| survey.scans(SEED, every.saturating_mul(k), rays).next();
                Ok(Box::new((0..*scans).filter_map(scan).map(|scan| Ok(without_intensities(scan)))))
            }
            Input::Recorded { folder } => {
                let cannot = format!("{}: cannot read the scans", folder.display());
                let mut source =
                    open_scans(folder, &ReadOptions::default()).with_context(|| cannot.clone())?;
                let scans = std::iter::from_fn(move || source.next_scan().transpose());
                Ok(Box::new(scans.map(move |scan| {
                    Ok(without_intensities(scan.with_context(|| cannot.clone())?.into_scan()))
                })))
            }
        }
    }

    pub fn description(&self) -> String {
        let input = match &self.input {
            Input::Synthetic { survey, rays, scans } => match survey.spacing_m() {
                Some(spacing_m) => {
                    format!("`{}`, {rays} rays, {:.0} m", survey.name(), *scans as f64 * spacing_m)
                }
                None => format!("`{}`, {rays} rays, {scans} scans", survey.name()),
            },
            Input::EveryNth { survey, rays, scans, every } => {
                let every = if *every > 1 { format!(", one in {every}") } else { String::new() };
                format!("`{}`, {rays} rays, {scans} scans{every}", survey.name())
            }
            Input::Recorded { .. } => "recorded".to_owned(),
        };
        let Self { resolution_m, tile_size_m, max_range_m, .. } = self;
        format!("{input}; voxels of {resolution_m} m, tiles of {tile_size_m} m, range {max_range_m} m")
    }
}

/// Drops intensities to save memory: log-odds do not use them.
fn without_intensities(scan: Scan) -> Scan {
    Scan { intensities: None, ..scan }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_have_the_requested_number_and_a_missing_folder_is_an_error() {
        let input = Input::Synthetic { survey: SurveyName::Drive, rays: 200, scans: 3 };
        let drive =
            Case { name: "drive".into(), input, resolution_m: 0.2, tile_size_m: 10.0, max_range_m: 60.0 };
        let scans: Vec<Scan> = drive.scans().unwrap().collect::<Result<_>>().unwrap();
        assert_eq!(scans.len(), 3);
        assert!(scans.iter().all(|scan| !scan.points.is_empty() && scan.intensities.is_none()));
        assert!(drive.follows_trajectory() && drive.min_bytes().unwrap() > 0);
        let input = Input::Recorded { folder: PathBuf::from("nowhere") };
        assert!(Case { input, ..drive }.scans().is_err());
    }
}

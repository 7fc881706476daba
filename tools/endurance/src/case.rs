use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use voxtile::{MapConfig, MemoryLimit, Scan};
use voxtile_formats::{ReadOptions, open_scans};
use workload::SurveyName;

/// Scans, and the map that is made of them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Case {
    /// What tables and plots call it.
    pub name: String,
    /// Where the scans come from.
    pub input: Input,
    /// Edge of a voxel, in metres.
    pub resolution_m: f64,
    /// Edge of a tile, in metres.
    pub tile_size_m: f64,
    /// Rays are cut at this many metres.
    pub max_range_m: f64,
}

/// Where scans come from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Input {
    /// From a made-up survey.
    MadeUp {
        /// Which one.
        survey: SurveyName,
        /// Rays of a scan, more or less.
        rays: u32,
        /// How many scans.
        scans: usize,
    },
    /// From a made-up survey, one scan in so many of it.
    EveryNth {
        /// Which one.
        survey: SurveyName,
        /// Rays of a scan, more or less.
        rays: u32,
        /// How many scans.
        scans: usize,
        /// How many scans of the survey one is taken of.
        every: usize,
    },
    /// From a folder of recorded scans and poses.
    Recorded {
        /// Which one.
        folder: PathBuf,
    },
}

/// How much memory a map may take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Limit {
    /// It lives in memory, and never gets to the disk.
    InMemory,
    /// It is out of core, and all of it fits.
    None,
    /// It is out of core, with so many bytes for all that grows.
    Bytes(usize),
}

/// Seed of the made-up surveys.
const SEED: u64 = 1;
/// More than any map here takes.
const UNLIMITED_BYTES: usize = 1 << 44;

impl Case {
    /// How the map is made.
    ///
    /// # Errors
    ///
    /// Lengths that make no grid.
    pub fn config(&self, limit: Limit) -> Result<MapConfig> {
        let config = MapConfig::new(self.resolution_m, self.tile_size_m)?.with_range(0.0, self.max_range_m);
        Ok(match limit {
            Limit::InMemory => config,
            Limit::None => config.with_memory_bytes(UNLIMITED_BYTES),
            Limit::Bytes(bytes) => config.with_memory_bytes(bytes),
        })
    }

    /// The least limit that a map of this kind keeps to, in bytes.
    ///
    /// # Errors
    ///
    /// As for [`Case::config`].
    pub fn least_bytes(&self) -> Result<usize> {
        Ok(MemoryLimit::min_bytes(&self.config(Limit::InMemory)?.grid))
    }

    /// Whether the scans follow each other along a way, so that its length says how far the map has come.
    pub fn is_way(&self) -> bool {
        match &self.input {
            Input::MadeUp { survey, .. } | Input::EveryNth { survey, .. } => survey.spacing_m().is_some(),
            Input::Recorded { .. } => true,
        }
    }

    /// The scans in their order, made or read one at a time.
    ///
    /// # Errors
    ///
    /// A folder that cannot be read; and its scans, one by one.
    pub fn scans(&self) -> Result<Box<dyn Iterator<Item = Result<Scan>>>> {
        match &self.input {
            Input::MadeUp { survey, rays, scans } => Ok(Box::new(
                survey.scans(SEED, 0, *rays).take(*scans).map(|scan| Ok(without_intensities(scan))),
            )),
            Input::EveryNth { survey, rays, scans, every } => {
                let (survey, rays, every) = (*survey, *rays, *every);
                // Each by its number: those between are not made.
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

    /// What is mapped, in words.
    pub fn description(&self) -> String {
        let input = match &self.input {
            Input::MadeUp { survey, rays, scans } => match survey.spacing_m() {
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

/// Log-odds need none, and they would be most of what a scan takes beside its points.
fn without_intensities(scan: Scan) -> Scan {
    Scan { intensities: None, ..scan }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_are_as_many_as_asked_and_a_folder_that_is_not_there_is_an_error() {
        let input = Input::MadeUp { survey: SurveyName::Drive, rays: 200, scans: 3 };
        let drive =
            Case { name: "drive".into(), input, resolution_m: 0.2, tile_size_m: 10.0, max_range_m: 60.0 };
        let scans: Vec<Scan> = drive.scans().unwrap().collect::<Result<_>>().unwrap();
        assert_eq!(scans.len(), 3);
        assert!(scans.iter().all(|scan| !scan.points.is_empty() && scan.intensities.is_none()));
        assert!(drive.is_way() && drive.least_bytes().unwrap() > 0);
        let input = Input::Recorded { folder: PathBuf::from("nowhere") };
        assert!(Case { input, ..drive }.scans().is_err());
    }
}

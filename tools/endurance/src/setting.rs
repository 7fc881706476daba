use crate::build::Build;
use crate::case::{Case, Input, Limit};
use crate::metered_disk::DiskSpeed;
use std::path::PathBuf;
use voxtile::Storage;
use workload::SurveyName;

/// Inputs of the questions, and how much to measure.
pub struct Setting {
    /// Folder of the recorded data sets.
    pub data: PathBuf,
    /// Folder for temporary maps.
    pub work: PathBuf,
    /// Whether to check only results that do not depend on time.
    pub is_short: bool,
    /// Number of runs for a median.
    pub runs: usize,
}

/// Rays of a scan of a drive.
pub const RAYS: u32 = 8_000;

impl Setting {
    /// Returns `short` in a short run, else `full`.
    pub fn size<T>(&self, full: T, short: T) -> T {
        if self.is_short { short } else { full }
    }

    /// The recorded drive along a river; prints a line if it is missing.
    pub fn riverside(&self, tile_size_m: f64) -> Option<Case> {
        let input = Input::Recorded { folder: report::recorded_set(&self.data, "mulran_riverside02_a")? };
        Some(Case { name: "riverside".into(), input, resolution_m: 0.1, tile_size_m, max_range_m: 100.0 })
    }

    /// A build on the disk at its own speed, with a digest. Short runs do not sync the disk.
    pub fn build(&self, case: &Case, limit: Limit) -> Build {
        Build {
            case: case.clone(),
            limit,
            disk: self.size(DiskSpeed::Own, DiskSpeed::Unsynced),
            storage: Storage::OctoMap,
            scans_at_a_time: 1,
            folder: self.work.join("map"),
            is_kept: false,
            has_digest: true,
            is_on_one_core: false,
            flushes: None,
        }
    }
}

/// A map of a synthetic survey: number of rays and scans; voxel size, tile size and maximum range in metres.
pub fn synthetic(
    name: &str,
    (survey, rays, scans): (SurveyName, u32, usize),
    [resolution_m, tile_size_m, max_range_m]: [f64; 3],
) -> Case {
    let input = Input::Synthetic { survey, rays, scans };
    Case { name: name.into(), input, resolution_m, tile_size_m, max_range_m }
}

/// Converts bytes to MiB.
pub fn mib(bytes: f64) -> f64 {
    bytes / f64::from(1 << 20)
}

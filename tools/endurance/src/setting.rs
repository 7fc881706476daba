use crate::build::Build;
use crate::case::{Case, Input, Limit};
use crate::metered_disk::DiskSpeed;
use std::path::PathBuf;
use voxtile::Storage;
use workload::SurveyName;

/// What questions are put to, and how long they may take.
pub struct Setting {
    /// Folder of the recorded data sets.
    pub data: PathBuf,
    /// Folder for maps, which come and go.
    pub work: PathBuf,
    /// Whether to look only at what does not depend on time.
    pub is_short: bool,
    /// Runs of which medians are taken.
    pub runs: usize,
}

/// Rays of a scan of a drive.
pub const RAYS: u32 = 8_000;

impl Setting {
    /// One of two, the second where the run is to be short.
    pub fn size<T>(&self, full: T, short: T) -> T {
        if self.is_short { short } else { full }
    }

    /// The recorded drive along a river, where it is there; where not, a line says so.
    pub fn riverside(&self, tile_size_m: f64) -> Option<Case> {
        let input = Input::Recorded { folder: report::recorded_set(&self.data, "mulran_riverside02_a")? };
        Some(Case { name: "riverside".into(), input, resolution_m: 0.1, tile_size_m, max_range_m: 100.0 })
    }

    /// A map to build on the disk as it is, whose digest is wanted. Where time is not looked at, the disk is not waited
    /// for.
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
            flushes: None,
        }
    }
}

/// A map of a made-up survey: so many scans, with voxels and tiles and as far as given in metres.
pub fn made_up(
    name: &str,
    (survey, rays, scans): (SurveyName, u32, usize),
    [resolution_m, tile_size_m, max_range_m]: [f64; 3],
) -> Case {
    let input = Input::MadeUp { survey, rays, scans };
    Case { name: name.into(), input, resolution_m, tile_size_m, max_range_m }
}

/// MiB, as tables and plots show bytes of memory.
pub fn mib(bytes: f64) -> f64 {
    bytes / f64::from(1 << 20)
}

use anyhow::{Context, Result};
use report::recorded_set;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use voxtile::Scan;
use voxtile_formats::{ReadOptions, open_scans};
use workload::{ScanWriter, SurveyName};

/// A set of scans and the resolution of its map.
pub struct ScanSet {
    pub name: &'static str,
    pub resolution_m: f64,
    pub scans: usize,
    /// Number of scans in measurements with per-ray updates.
    pub ray_scans: usize,
    /// The survey of a synthetic set.
    survey: Option<SurveyName>,
}

/// Maximum range, in metres.
pub const MAX_RANGE_M: f64 = 60.0;
const SEED: u64 = 1;

pub const RECORDED: [&str; 3] = ["balm_os0_hall", "fastlio_hku_1", "mulran_riverside02_a"];

/// The eight sets; fewer sets with fewer scans if `is_short`.
pub fn all(is_short: bool) -> Vec<ScanSet> {
    let set = |name, resolution_m, scans, ray_scans, survey| ScanSet {
        name,
        resolution_m,
        scans,
        ray_scans,
        survey,
    };
    let [hall, courtyard, riverside] = RECORDED;
    if is_short {
        return vec![set("indoor", 0.1, 3, 2, Some(SurveyName::Indoor)), set(courtyard, 0.2, 10, 2, None)];
    }
    vec![
        set("drive", 0.2, 200, 40, Some(SurveyName::Drive)),
        set("drive", 0.1, 100, 20, Some(SurveyName::Drive)),
        set(courtyard, 0.2, 200, 60, None),
        set(riverside, 0.2, 75, 20, None),
        set("street", 0.2, 20, 10, Some(SurveyName::Street)),
        set("street", 0.1, 10, 4, Some(SurveyName::Street)),
        set(hall, 0.1, 36, 10, None),
        set("indoor", 0.1, 40, 10, Some(SurveyName::Indoor)),
    ]
}

impl ScanSet {
    /// Name in tables, with the resolution.
    pub fn title(&self) -> String {
        format!("{}, {} m", self.name, self.resolution_m)
    }

    /// Reads or generates the scans; prints a line and returns `None` if a recorded set is missing.
    ///
    /// # Errors
    ///
    /// Fails if the scans cannot be read.
    pub fn read(&self, data: &Path) -> Result<Option<Vec<Scan>>> {
        if let Some(survey) = self.survey {
            return Ok(Some(survey.scans(SEED, 0, SurveyName::RAYS).take(self.scans).collect()));
        }
        let Some(folder) = recorded_set(data, self.name) else { return Ok(None) };
        let cannot_read = || format!("{}: cannot read the scans", folder.display());
        let mut source = open_scans(&folder, &ReadOptions::default()).with_context(cannot_read)?;
        let mut scans = Vec::new();
        while scans.len() < self.scans
            && let Some(scan) = source.next_scan().with_context(cannot_read)?
        {
            scans.push(scan.into_scan());
        }
        Ok(Some(scans))
    }

    /// Writes the scans as a stream for the contender; returns `None` if a recorded set is missing.
    ///
    /// # Errors
    ///
    /// Fails if the scans cannot be read or the stream cannot be written.
    pub fn write(&self, data: &Path, folder: &Path) -> Result<Option<Stream>> {
        let Some(scans) = self.read(data)? else { return Ok(None) };
        let path = folder.join(format!("{}_{}", self.name, self.resolution_m));
        let rays = |scans: &[Scan]| scans.iter().map(|scan| scan.points.len()).sum();
        let written = File::create(&path).and_then(|file| {
            let mut writer = ScanWriter::new(BufWriter::new(file), None);
            scans.iter().try_for_each(|scan| writer.write(scan))?;
            writer.flush()
        });
        written.with_context(|| {
            format!("{}: cannot write the scans; check the free disk space", path.display())
        })?;
        let first = &scans[..self.ray_scans.min(scans.len())];
        Ok(Some(Stream { path, scans: scans.len(), rays: rays(&scans), first_rays: rays(first) }))
    }
}

/// A stream of scans for the contender.
pub struct Stream {
    pub path: PathBuf,
    pub scans: usize,
    pub rays: usize,
    /// Number of rays of the first scans, which are used for per-ray updates.
    pub first_rays: usize,
}

use crate::command::map_at::MapAt;
use crate::io::{PointStore, ScanHead, ScanSource};
use crate::mapper::KeptScans;
use crate::scan::ScanPoints;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// The scans that a map or a snapshot of one keeps, as an input like any other.
pub struct KeptSource {
    path: PathBuf,
    scans: KeptScans,
    count: usize,
    crs: Option<String>,
    fingerprint: String,
}

/// Whether a path names a map that may keep scans, or a snapshot of one.
pub fn is_map(path: &Path) -> bool {
    let has_files =
        |path: &Path| ["metadata.json", "commits.log"].iter().all(|name| path.join(name).is_file());
    let text = path.to_str().and_then(|text| text.rsplit_once('@'));
    has_files(path) || text.is_some_and(|(map, _)| has_files(Path::new(map)))
}

impl KeptSource {
    pub fn open(path: &Path) -> Result<Self> {
        let reader = MapAt::of(path)?.open()?;
        let (mut records, mut count) = (reader.kept_scans()?, 0);
        while records.next_record()?.is_some() {
            count += 1;
        }
        let ext = reader.metadata().ext.as_ref();
        let id = ext.map_or("", |ext| &ext.map_id);
        let fingerprint = format!("kept scans of map {id} as of flush {}", reader.flush_number());
        let crs = ext.and_then(|ext| ext.crs.clone());
        Ok(Self { path: path.to_owned(), scans: reader.kept_scans()?, count, crs, fingerprint })
    }
}

impl ScanSource for KeptSource {
    fn len_hint(&self) -> Option<usize> {
        Some(self.count)
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        let Some(scan) = self.scans.next().transpose()? else { return Ok(None) };
        let Some(world_from_sensor) = scan.world_from_sensor() else {
            let reason = format!(
                "scan {} has its points in the world frame and no pose; `voxtile remap -o` maps it all the same",
                scan.number()
            );
            return Err(Error::argument(self.path.display().to_string(), reason));
        };
        points.begin(scan.has_intensities());
        let mut pushed = Ok(());
        scan.for_each_own_chunk(0..scan.len(), &mut |some, intensities| {
            pushed = some.iter().enumerate().try_for_each(|(at, &point)| {
                points.push(point, intensities.map_or(0.0, |intensities| intensities[at]))
            });
            pushed.is_ok()
        })?;
        pushed?;
        let (name, stamp_ns) = (scan.number().to_string(), scan.stamp_ns());
        Ok(Some(ScanHead { name, stamp_ns, world_from_sensor }))
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        for skipped in 0..scans {
            if self.scans.next_record()?.is_none() {
                return Ok(skipped);
            }
        }
        Ok(scans)
    }

    fn format(&self) -> String {
        "kept scans of a map".to_owned()
    }

    fn crs(&self) -> Option<String> {
        self.crs.clone()
    }

    fn fingerprint(&self) -> Result<String> {
        Ok(self.fingerprint.clone())
    }
}

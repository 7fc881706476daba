use crate::MapAt;
use crate::new_poses::{PoseFile, poses_for};
use crate::place::{is_map_at, url_of};
use rustc_hash::FxHashMap;
use std::path::{Path, PathBuf};
use voxtile::mapper::{KeptScans, NewPose};
use voxtile::scan::{PointFrame, ScanPoints, Stop};
use voxtile::{Error, Result};
use voxtile_formats::{PointStore, ScanHead, ScanSource};

/// The kept scans of a map or a snapshot as an input.
pub struct KeptSource {
    path: PathBuf,
    scans: KeptScans,
    /// Poses that replace the scans' own, by scan number.
    new_poses: FxHashMap<u64, NewPose>,
    count: usize,
    crs: Option<String>,
    fingerprint: String,
}

/// Returns whether a path names a map or snapshot that may keep scans. For a URL, the store must be queried.
///
/// # Errors
///
/// The bucket cannot be queried.
pub fn is_map(path: &Path, stop: &Stop) -> Result<bool> {
    let has_files =
        |path: &Path| ["metadata.json", "commits.log"].iter().all(|name| path.join(name).is_file());
    let text = path.to_str().and_then(|text| text.rsplit_once('@'));
    let Some(url) = url_of(path) else {
        return Ok(has_files(path) || text.is_some_and(|(map, _)| has_files(Path::new(map))));
    };
    if is_map_at(url, stop)? {
        return Ok(true);
    }
    match text {
        // The `@` is not the one between user and host of the URL.
        Some((map, snapshot)) if !snapshot.contains('/') && map.contains("://") => is_map_at(map, stop),
        _ => Ok(false),
    }
}

impl KeptSource {
    /// Opens the scans with their own poses, or with those of a file.
    pub fn open(path: &Path, poses: Option<&PoseFile<'_>>) -> Result<Self> {
        let reader = MapAt::of(path)?.open()?;
        let (scans, summary) = (reader.kept_scans()?, reader.kept_summary()?);
        let new_poses = match poses {
            Some(poses) => poses_for(poses, &summary)?.by_number(&summary)?,
            None => FxHashMap::default(),
        };
        let count = summary.scans().len();
        let ext = reader.metadata().ext.as_ref();
        let id = ext.map_or("", |ext| &ext.map_id);
        let fingerprint = format!("kept scans of map {id} as of flush {}", reader.flush_number());
        let crs = ext.and_then(|ext| ext.crs.clone());
        Ok(Self { path: path.to_owned(), scans, new_poses, count, crs, fingerprint })
    }
}

impl ScanSource for KeptSource {
    fn len_hint(&self) -> Option<usize> {
        Some(self.count)
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        let Some(scan) = self.scans.next().transpose()? else { return Ok(None) };
        if scan.world_from_sensor().is_none() {
            let reason = format!(
                "scan {} has its points in the world frame and no pose; use `voxtile remap -o`, which needs none",
                scan.number()
            );
            return Err(Error::argument(self.path.display().to_string(), reason));
        }
        let scan = match self.new_poses.get(&scan.number()) {
            Some(new) => scan.with_pose(new.clone()),
            None => scan,
        };
        points.begin_with(scan.has_intensities(), scan.attributes());
        let (mut pushed, all) = (Ok(()), 0..scan.len());
        scan.for_each_attributed_chunk(all, PointFrame::Raw, &mut |some, intensities, attributes| {
            pushed = some.iter().enumerate().try_for_each(|(at, &point)| {
                let intensity = intensities.map_or(0.0, |intensities| intensities[at]);
                let (colour, class) = (attributes.colour(at), attributes.class(at));
                points.push_with(point, intensity, colour, class, attributes.time_ns(at))
            });
            pushed.is_ok()
        })?;
        pushed?;
        points.set_moving(scan.moving().cloned());
        points.set_sweep(scan.record().sweep.clone());
        points.set_body_from_sensor(scan.body_from_sensor());
        Ok(scan.world_from_sensor().map(|world_from_sensor| ScanHead {
            name: scan.number().to_string(),
            stamp_ns: scan.stamp_ns(),
            world_from_sensor,
        }))
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

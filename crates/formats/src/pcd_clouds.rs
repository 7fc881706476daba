use super::file_order::name_of;
use super::pcd::read_pcd_file;
use super::pcd_viewpoint::viewpoint_of_file;
use super::point_store::{PointRoom, PointStore};
use crate::clouds::read::OpenOptions;
use crate::clouds::{CloudHead, CloudPoint, CloudSource, RigidPose, stamp_of_name};
use std::path::PathBuf;

/// PCD files as clouds, for poses and options that [`PcdFolder`](super::pcd_folder::PcdFolder) does not know.
pub(super) struct PcdClouds {
    files: Vec<PathBuf>,
    /// Whether a `VIEWPOINT` at the origin is where the file was taken.
    takes_identity: bool,
    next: usize,
    points: PointStore,
}

impl PcdClouds {
    /// Points beyond the memory for reading go to a temporary file.
    pub(super) fn new(files: Vec<PathBuf>, open: &OpenOptions, takes_identity: bool) -> Self {
        let folder = open.scratch.clone().unwrap_or_else(std::env::temp_dir);
        let points = PointStore::new(PointRoom::new(open.memory_bytes, &folder));
        Self { files, takes_identity, next: 0, points }
    }
}

impl CloudSource for PcdClouds {
    fn format(&self) -> &str {
        "PCD"
    }

    fn len_hint(&self) -> Option<u64> {
        Some(self.files.len() as u64)
    }

    fn ends(&self) -> Option<[String; 2]> {
        Some([name_of(self.files.first()?), name_of(self.files.last()?)])
    }

    fn next_cloud(&mut self) -> crate::clouds::Result<Option<CloudHead>> {
        let Some(path) = self.files.get(self.next) else { return Ok(None) };
        self.next += 1;
        let viewpoint = read_pcd_file(path, &mut self.points)
            .map_err(|error| crate::clouds::Error::argument(path.display().to_string(), error.to_string()))?;
        let mut head = CloudHead { name: name_of(path), ..CloudHead::default() };
        head.stamp_ns = stamp_of_name(path);
        head.points = Some(self.points.len() as u64);
        head.has_intensities = self.points.has_intensities();
        let told = viewpoint_of_file(path);
        let is_pose = match self.takes_identity {
            // One file alone need not tell.
            true => told.is_some() || self.files.len() == 1,
            false => told.is_some_and(|told| !told.is_identity()),
        };
        let pose = RigidPose { position_m: viewpoint.position_m(), quaternion: viewpoint.quaternion() };
        head.world_from_sensor = is_pose.then_some(pose);
        Ok(Some(head))
    }

    fn read_points(
        &mut self,
        visit: &mut dyn FnMut(CloudPoint) -> crate::clouds::Result<()>,
    ) -> crate::clouds::Result<()> {
        let mut outcome = Ok(());
        let read = self.points.for_each_chunk(0..self.points.len(), &mut |points, intensities| {
            for (number, &position_m) in points.iter().enumerate() {
                let intensity = intensities.map_or(0.0, |intensities| intensities[number]);
                outcome = visit(CloudPoint { intensity, ..CloudPoint::hit(position_m) });
                if outcome.is_err() {
                    return false;
                }
            }
            true
        });
        read.map_err(|error| crate::clouds::Error::argument("temporary file", error.to_string()))?;
        outcome
    }
}

use super::occupied_voxels::{OccupiedVoxel, changes_cloud};
use super::outlet::is_expired;
use super::viewers::Viewers;
use crate::live_map::MapVersion;
use crate::messages::{Header, PointCloud2};
use crate::transport::{Qos, Sender, Transport, TypeName};
use std::time::Instant;
use voxtile::{Aabb, Grid, VoxelIndex};

/// Publishes the occupied voxels that changed since the last message.
pub struct Changing {
    topic: String,
    sender: Sender<PointCloud2>,
    viewers: Viewers,
}

/// Number of cached messages, which new subscribers get before a complete one.
const DEPTH: usize = 10;

impl Changing {
    /// # Errors
    ///
    /// The transport cannot create the publisher.
    pub fn new(transport: &mut Transport, topic: &str) -> anyhow::Result<Self> {
        let sender =
            transport.advertise(topic, TypeName::new("sensor_msgs", "PointCloud2"), Qos::latched(DEPTH))?;
        Ok(Self { topic: topic.to_owned(), sender, viewers: Viewers::new(Instant::now()) })
    }

    /// Sends the changes of the occupied voxels in a box, if there are subscribers. Sends all occupied voxels to new
    /// subscribers and at an interval.
    pub fn refresh(
        &mut self,
        version: MapVersion,
        grid: &Grid,
        region: &Aabb,
        header: Header,
        has_colours: bool,
        occupied: impl FnOnce() -> anyhow::Result<Vec<OccupiedVoxel>>,
    ) {
        if !self.viewers.needs_update(self.sender.subscribers(), version, Instant::now()) {
            return;
        }
        let mut occupied = match occupied() {
            Ok(occupied) => occupied,
            Err(error) if is_expired(&error) => {
                log::debug!("{}: will retry: {error}", self.topic);
                return;
            }
            Err(error) => {
                log::warn!("{}: not sent: {error:#}", self.topic);
                // Do not retry: the same map would fail again.
                self.viewers.note_failed(version);
                return;
            }
        };
        occupied.sort_unstable();
        let voxels: Vec<VoxelIndex> = occupied.iter().map(|of| of.voxel).collect();
        let changes = self.viewers.changes(&voxels, |voxel| region.contains(grid.center_m(voxel)));
        if !changes.is_empty() || self.viewers.is_whole_due() {
            let cloud = changes_cloud(grid, &changes, &occupied, has_colours, header);
            if let Err(error) = self.sender.send(cloud) {
                log::debug!("{}: not sent, will retry: {error}", self.topic);
                return;
            }
        }
        self.viewers.note_sent(version, voxels, Instant::now());
    }
}

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

/// Messages that who comes late gets, before a whole one.
const DEPTH: usize = 10;

impl Changing {
    /// # Errors
    ///
    /// The transport refuses.
    pub fn new(transport: &mut Transport, topic: &str) -> anyhow::Result<Self> {
        let sender =
            transport.advertise(topic, TypeName::new("sensor_msgs", "PointCloud2"), Qos::latched(DEPTH))?;
        Ok(Self { topic: topic.to_owned(), sender, viewers: Viewers::new(Instant::now()) })
    }

    /// Sends what changed of the occupied voxels in a box, if somebody listens; to who is new, and now and then, all.
    pub fn refresh(
        &mut self,
        version: MapVersion,
        grid: &Grid,
        region: &Aabb,
        header: Header,
        occupied: impl FnOnce() -> anyhow::Result<Vec<VoxelIndex>>,
    ) {
        if !self.viewers.are_to_hear(self.sender.listeners(), version, Instant::now()) {
            return;
        }
        let mut occupied = match occupied() {
            Ok(occupied) => occupied,
            Err(error) if is_expired(&error) => {
                log::debug!("{}: tried again: {error}", self.topic);
                return;
            }
            Err(error) => {
                log::warn!("{}: not sent: {error:#}", self.topic);
                // The same map would fail again.
                self.viewers.note_failed(version);
                return;
            }
        };
        occupied.sort_unstable();
        let changes = self.viewers.changes(&occupied, |voxel| region.contains(grid.center_m(voxel)));
        if !changes.is_empty() || self.viewers.is_whole_due() {
            let points = changes.into_iter().map(|(voxel, state)| (grid.center_m(voxel), state as u8));
            if let Err(error) = self.sender.send(PointCloud2::of_states(header, points)) {
                log::debug!("{}: not sent, tried again: {error}", self.topic);
                return;
            }
        }
        self.viewers.note_told(version, occupied, Instant::now());
    }
}

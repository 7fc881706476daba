use super::voxel_changes::VoxelChanges;
use crate::live_map::MapVersion;
use crate::messages::{Header, PointCloud2};
use crate::transport::{Qos, Sender, Transport, TypeName};
use std::time::{Duration, Instant};
use voxtile::{Aabb, Grid, VoxelIndex};

/// Publishes the occupied voxels that changed since the last message.
pub struct Changing {
    topic: String,
    sender: Sender<PointCloud2>,
    changes: VoxelChanges,
    sent: Option<MapVersion>,
    subscribers: usize,
    whole_at: Instant,
}

/// Messages that who comes late gets, before a whole one.
const DEPTH: usize = 10;
/// Of two subscribers one may leave and another come unseen.
const WHOLE_EVERY: Duration = Duration::from_secs(30);

impl Changing {
    /// # Errors
    ///
    /// The transport refuses.
    pub fn new(transport: &mut Transport, topic: &str) -> anyhow::Result<Self> {
        let sender =
            transport.advertise(topic, TypeName::new("sensor_msgs", "PointCloud2"), Qos::latched(DEPTH))?;
        let (topic, changes) = (topic.to_owned(), VoxelChanges::default());
        Ok(Self { topic, sender, changes, sent: None, subscribers: 0, whole_at: Instant::now() })
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
        let before = std::mem::replace(&mut self.subscribers, self.sender.listeners());
        if self.subscribers == 0 {
            (self.changes, self.sent) = (VoxelChanges::default(), None);
            return;
        }
        let is_whole =
            self.subscribers > before || self.sent.is_none() || self.whole_at.elapsed() >= WHOLE_EVERY;
        if self.sent == Some(version) && !is_whole {
            return;
        }
        let mut occupied = match occupied() {
            Ok(occupied) => occupied,
            Err(error) => {
                log::debug!("{}: not sent, tried again: {error:#}", self.topic);
                // Who is new still is.
                self.subscribers = before;
                return;
            }
        };
        occupied.sort_unstable();
        let changes = self.changes.to(&occupied, is_whole, |voxel| region.contains(grid.center_m(voxel)));
        if changes.is_empty() && !is_whole {
            self.sent = Some(version);
            return;
        }
        let points = changes.into_iter().map(|(voxel, state)| (grid.center_m(voxel), state as u8));
        match self.sender.send(PointCloud2::of_states(header, points)) {
            Ok(()) => {
                self.changes.note(occupied);
                self.sent = Some(version);
                if is_whole {
                    self.whole_at = Instant::now();
                }
            }
            Err(error) => {
                log::debug!("{}: not sent, tried again: {error}", self.topic);
                self.subscribers = before;
            }
        }
    }
}

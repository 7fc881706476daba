use super::voxel_changes::VoxelChanges;
use crate::live_map::MapVersion;
use crate::messages::{Header, PointCloud2};
use crate::names::Names;
use anyhow::anyhow;
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{MessageTypeName, Node, Publisher};
use std::time::{Duration, Instant};
use voxtile::{Aabb, Grid, VoxelIndex};

/// Publishes the occupied voxels that changed since the last message.
pub struct Changing {
    topic: String,
    publisher: Publisher<PointCloud2>,
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
    /// DDS refuses.
    pub fn new(node: &mut Node, names: &Names, topic: &str) -> anyhow::Result<Self> {
        let qos = QosProfile::publisher_default()
            .reliability_reliable(WhenFull::DEFAULT)
            .durability(Durability::TransientLocal)
            .history(History::KeepLast { depth: DEPTH });
        let failed = |error: &dyn std::fmt::Debug| anyhow!("{topic}: {error:?}");
        let type_name = MessageTypeName::new("sensor_msgs", "PointCloud2");
        let dds_topic =
            node.create_topic(&names.of(topic)?, type_name, &qos).map_err(|error| failed(&error))?;
        let publisher = node.create_publisher(&dds_topic, Some(qos)).map_err(|error| failed(&error))?;
        let (topic, changes) = (names.full(topic), VoxelChanges::default());
        Ok(Self { topic, publisher, changes, sent: None, subscribers: 0, whole_at: Instant::now() })
    }

    /// Sends what changed of the occupied voxels in a box, if somebody listens; to who is new, and now and then, all.
    pub fn refresh(
        &mut self,
        node: &Node,
        version: MapVersion,
        grid: &Grid,
        region: &Aabb,
        header: Header,
        occupied: impl FnOnce() -> anyhow::Result<Vec<VoxelIndex>>,
    ) {
        let before = std::mem::replace(&mut self.subscribers, self.publisher.get_subscription_count(node));
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
        match self.publisher.publish(PointCloud2::of_states(header, points)) {
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

use super::receiver::Receiver;
use super::receiver_config::ReceiverConfig;
use super::set::VoxelSet;
use crate::error::{Error, FormatError, Result};
use std::collections::BTreeMap;
use std::time::Duration;

/// Receivers of several robots under one limit of memory.
///
/// Whoever needs memory gets it while there is some. Once there is none, everybody has a right to an equal part of the
/// limit: a robot that has less may grow up to that part, and who has the most beyond it forgets as much, voxel by voxel
/// from the end of its layer. So nobody can take from others what they have below their part.
#[derive(Clone, Debug)]
pub struct Receivers<K> {
    memory_bytes: usize,
    robots: BTreeMap<K, Receiver>,
}

impl<K> IntoIterator for Receivers<K> {
    type Item = (K, Receiver);
    type IntoIter = std::collections::btree_map::IntoIter<K, Receiver>;

    fn into_iter(self) -> Self::IntoIter {
        self.robots.into_iter()
    }
}

/// What one packet can add, before anybody has to forget: voxels each alone in its tile.
const PACKET_BYTES: usize = super::codec::MAX_VOXELS_PER_PACKET * VoxelSet::MOST_BYTES_A_VOXEL;

impl<K: Ord + Clone> Receivers<K> {
    /// The least memory of receivers, in bytes.
    pub const LEAST_BYTES: usize = 64 << 20;

    /// No receivers yet, and a limit on what all of them take together.
    ///
    /// # Errors
    ///
    /// Less than [`Receivers::LEAST_BYTES`].
    pub fn new(memory_bytes: usize) -> Result<Self> {
        if memory_bytes < Self::LEAST_BYTES {
            let reason = format!("{memory_bytes} bytes; at least {} are needed", Self::LEAST_BYTES);
            return Err(Error::argument("memory", reason));
        }
        Ok(Self { memory_bytes, robots: BTreeMap::new() })
    }

    /// Adds a receiver for a robot, with the layer of an earlier one if there is one. Its limit of memory is what the
    /// others leave; where that is too little, who has most forgets. A robot that has not said what it is takes no part.
    pub fn insert(&mut self, robot: K, config: ReceiverConfig, layer: Option<VoxelSet>) {
        self.robots.insert(robot, Receiver::started(config, layer));
        self.share_out();
    }

    /// Gives everybody the same part.
    fn share_out(&mut self) {
        let part = self.part_bytes();
        self.robots.values_mut().for_each(|receiver| receiver.set_part_bytes(part));
        self.make_room();
    }

    /// Robots that have said what they are, or have a layer.
    pub fn known(&self) -> usize {
        self.robots.values().filter(|receiver| receiver.layer().is_some()).count()
    }

    /// Whether there is a part for one robot more.
    pub fn has_room(&self) -> bool {
        self.for_all() / (self.known() + 1) >= Receiver::LEAST_BYTES
    }

    /// Removes a robot, and returns its receiver.
    pub fn remove(&mut self, robot: &K) -> Option<Receiver> {
        self.robots.remove(robot)
    }

    /// Takes the bytes of a packet of a robot; of one that was not added, or that there is no part for, nothing.
    ///
    /// # Errors
    ///
    /// Bytes that are no packet; the layer stays as it was.
    pub fn take(&mut self, robot: &K, bytes: &[u8], now: Duration) -> std::result::Result<(), FormatError> {
        let (all, part) = (self.memory_bytes(), self.part_bytes());
        let for_all = self.for_all();
        let has_room = self.has_room();
        let Some(receiver) = self.robots.get_mut(robot) else { return Ok(()) };
        let was_known = receiver.layer().is_some();
        if !was_known && !has_room {
            return Ok(());
        }
        let free = for_all.saturating_sub(all - receiver.memory_bytes());
        receiver.set_memory_bytes(free.max(part));
        let taken = receiver.take(bytes, now);
        if receiver.layer().is_some() != was_known {
            self.share_out();
        } else {
            self.make_room();
        }
        taken
    }

    /// Has those forget that have most, beyond their part, until all is within the limit.
    fn make_room(&mut self) {
        let part = self.part_bytes();
        loop {
            let excess = self.memory_bytes().saturating_sub(self.for_all());
            let most = self.robots.values_mut().max_by_key(|receiver| receiver.memory_bytes());
            let Some(receiver) = most.filter(|receiver| excess > 0 && receiver.memory_bytes() > part) else {
                return;
            };
            let before = receiver.memory_bytes();
            receiver.cut_to_bytes(part.max(before - excess));
            if receiver.memory_bytes() >= before {
                return;
            }
        }
    }

    /// Bytes of memory that all receivers take together, at most.
    pub fn memory_bytes(&self) -> usize {
        self.robots.values().map(Receiver::memory_bytes).sum()
    }

    /// What every robot may have, whatever the others do.
    pub fn part_bytes(&self) -> usize {
        self.for_all() / self.known().max(1)
    }

    /// What nobody has of the memory, and no packet needs.
    pub fn free_bytes(&self) -> usize {
        self.for_all().saturating_sub(self.memory_bytes())
    }

    fn for_all(&self) -> usize {
        self.memory_bytes - PACKET_BYTES
    }

    /// Number of robots.
    pub fn len(&self) -> usize {
        self.robots.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.robots.is_empty()
    }

    /// A robot's receiver.
    pub fn get(&self, robot: &K) -> Option<&Receiver> {
        self.robots.get(robot)
    }

    /// The same, for what it asks and for digests of its layer.
    pub fn get_mut(&mut self, robot: &K) -> Option<&mut Receiver> {
        self.robots.get_mut(robot)
    }

    /// All receivers, by robot.
    pub fn iter(&self) -> impl Iterator<Item = (&K, &Receiver)> {
        self.robots.iter()
    }

    /// The same, for what they ask and for digests of their layers.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (&K, &mut Receiver)> {
        self.robots.iter_mut()
    }
}

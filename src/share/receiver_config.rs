use crate::space::{Grid, VoxelBox};
use std::time::Duration;

/// What a receiver accepts, and how it asks.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReceiverConfig {
    /// The only grid that is accepted; `None` for any. Default: any.
    pub grid: Option<Grid>,
    /// Most bytes of memory of a receiver, all that it holds included. Default: 512 MiB. What a voxel takes is told by
    /// [`VoxelSet::memory_bytes`](super::VoxelSet::memory_bytes): 3 bytes in a wall, up to 1300 alone in its tile.
    pub memory_bytes: usize,
    /// Most voxels of a robot. Default: 2^26.
    pub max_voxels: u64,
    /// Most tiles of a robot. Default: 2^17.
    pub max_tiles: usize,
    /// Voxels outside of it are refused; `None` for no limit. Default: none.
    pub region: Option<VoxelBox>,
    /// Whether to ask for what is lacking. Without it a receiver only listens. Default: yes.
    pub asks: bool,
    /// How long to wait for packets that may only be late. Default: 0.3 s.
    pub patience: Duration,
    /// Time between two asks of a kind: with 1200 bytes at most an ask, the most that asks take. Default: 0.2 s.
    pub ask_interval: Duration,
    /// Where the numbers begin that tell answers from old or invented ones; others should not be able to guess it.
    pub nonce_seed: u64,
}

impl Default for ReceiverConfig {
    fn default() -> Self {
        Self {
            grid: None,
            memory_bytes: 512 << 20,
            max_voxels: 1 << 26,
            max_tiles: 1 << 17,
            region: None,
            asks: true,
            patience: Duration::from_millis(300),
            ask_interval: Duration::from_millis(200),
            nonce_seed: 1,
        }
    }
}

/// What a receiver has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct ReceiverCounts {
    /// Packets taken in.
    pub packets: u64,
    /// Bytes of all that came.
    pub bytes: u64,
    /// Packets of changes that came twice, or too late.
    pub repeated: u64,
    /// Packets that are not what packets should be.
    pub malformed: u64,
    /// Packets of a life of the sender, or with a number, that the sender has not confirmed.
    pub unconfirmed: u64,
    /// Voxels beyond the limits on memory, region, tiles and voxels.
    pub refused_voxels: u64,
    /// Voxels that were forgotten, since other robots were short of memory.
    pub cut_voxels: u64,
    /// Statuses with another grid than the one that is accepted.
    pub refused_grids: u64,
    /// Asks.
    pub asks: u64,
    /// Bytes of these.
    pub ask_bytes: u64,
    /// Times that the set was compared by digests, or fetched.
    pub catch_ups: u64,
}

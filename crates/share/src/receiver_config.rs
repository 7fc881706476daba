use std::time::Duration;
use voxtile::space::{Grid, VoxelBox};

/// Limits of a receiver, and the settings of its requests.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReceiverConfig {
    /// The only accepted grid; `None` accepts any grid. Default: any.
    pub grid: Option<Grid>,
    /// Maximum total memory of the receiver, in bytes. Default: 512 MiB.
    /// [`VoxelSet::memory_bytes`](super::VoxelSet::memory_bytes) describes the cost of a voxel: 3 bytes in a wall, up
    /// to 1300 bytes if it is alone in its tile.
    pub memory_bytes: usize,
    /// Maximum number of voxels of the robot. Default: 2^26.
    pub max_voxels: u64,
    /// Maximum number of tiles of the robot. Default: 2^17.
    pub max_tiles: usize,
    /// Region outside of which voxels are refused; `None` accepts all voxels. Default: `None`.
    pub region: Option<VoxelBox>,
    /// Whether to send requests. Without requests, a receiver only listens. Default: true.
    pub sends_requests: bool,
    /// How long to wait for late packets. Default: 0.3 s.
    pub patience: Duration,
    /// Time between two requests of a kind. It limits the bytes per second, because a request has at most 1200 bytes.
    /// Default: 0.2 s.
    pub request_interval: Duration,
    /// Seed of the nonces, which distinguish answers from old or forged packets. Choose a seed that others cannot
    /// guess.
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
            sends_requests: true,
            patience: Duration::from_millis(300),
            request_interval: Duration::from_millis(200),
            nonce_seed: 1,
        }
    }
}

/// Counts of a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct ReceiverCounts {
    /// Packets accepted.
    pub packets: u64,
    /// Bytes received.
    pub bytes: u64,
    /// Packets of changes that were duplicates or too late.
    pub repeated: u64,
    /// Malformed packets.
    pub malformed: u64,
    /// Packets with an epoch or a number that the sender has not confirmed.
    pub unconfirmed: u64,
    /// Voxels beyond the limits on memory, region, tiles and voxels.
    pub refused_voxels: u64,
    /// Voxels removed because other robots needed the memory.
    pub cut_voxels: u64,
    /// Statuses with a grid that is not accepted.
    pub refused_grids: u64,
    /// Requests sent.
    pub asks: u64,
    /// Bytes of the requests sent.
    pub ask_bytes: u64,
    /// Number of times that anti-entropy was started.
    pub catch_ups: u64,
}

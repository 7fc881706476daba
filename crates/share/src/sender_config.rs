use super::ExportPolicy;
use std::time::Duration;

/// Configuration of a sender.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SenderConfig {
    /// Policy that chooses the voxels of a frame. Default: the voxels that changed since the last frame.
    pub policy: ExportPolicy,
    /// Maximum delay of a change before its frame is sent. A longer delay needs fewer bytes: nearby voxels share a
    /// packet, and changes that revert are not sent. Default: 1 s.
    pub latency: Duration,
    /// Maximum size of a packet in bytes, 256 to 60000. Default: 1200, which fits into a datagram on almost any link.
    pub max_packet_bytes: usize,
    /// Time between two statuses, which let receivers detect lost packets; four times as long while nothing changes.
    /// Default: 2 s.
    pub status_interval: Duration,
    /// Number of packets whose voxels are kept for repairs, at least 1. At most a million voxels are kept. Default:
    /// 1024.
    pub ring_packets: usize,
    /// Maximum number of packets in the answer to one request. Default: 16.
    pub packets_per_answer: usize,
    /// Maximum rate of all answers together, in bytes per second. Requests beyond it are ignored. Default: 256 KiB.
    pub answer_bytes_per_s: u64,
}

impl Default for SenderConfig {
    fn default() -> Self {
        Self {
            policy: ExportPolicy::default(),
            latency: Duration::from_secs(1),
            max_packet_bytes: 1200,
            status_interval: Duration::from_secs(2),
            ring_packets: 1024,
            packets_per_answer: 16,
            answer_bytes_per_s: 256 << 10,
        }
    }
}

/// Counts of a sender.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct SenderCounts {
    /// Frames sent.
    pub frames: u64,
    /// Packets of changes sent.
    pub packets: u64,
    /// Bytes of these packets.
    pub packet_bytes: u64,
    /// Voxels in these packets.
    pub updates: u64,
    /// Voxels in these packets that were sent again.
    pub updates_again: u64,
    /// Bytes of statuses that were broadcast.
    pub status_bytes: u64,
    /// Requests received.
    pub asks: u64,
    /// Bytes of answers.
    pub answer_bytes: u64,
    /// Requests that were ignored because of the rate limit.
    pub refused_asks: u64,
}

use super::ExportPolicy;
use std::time::Duration;

/// How a sender sends.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SenderConfig {
    /// Which voxels a frame holds. Default: those that changed since the last frame.
    pub policy: ExportPolicy,
    /// How long a change may wait for its frame. Longer means fewer bytes: nearby voxels share a packet, and changes
    /// that revert are not sent. Default: 1 s.
    pub latency: Duration,
    /// Most bytes of a packet, 256 to 60000. Default: 1200, which fits into a datagram nearly anywhere.
    pub max_packet_bytes: usize,
    /// Time between two statuses, by which receivers notice what they lack; four times as long while nothing changes.
    /// Default: 2 s.
    pub status_interval: Duration,
    /// Packets whose voxels are kept for repairs, at least 1; a million voxels at most. Default: 1024.
    pub ring_packets: usize,
    /// Most packets in answer to one request. Default: 16.
    pub packets_per_answer: usize,
    /// Most bytes per second of all answers together; requests beyond it are ignored. Default: 256 KiB.
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
    /// Frames.
    pub frames: u64,
    /// Packets of changes.
    pub packets: u64,
    /// Bytes of these.
    pub packet_bytes: u64,
    /// Voxels in these.
    pub updates: u64,
    /// Voxels of these that were sent again.
    pub updates_again: u64,
    /// Bytes of statuses to all.
    pub status_bytes: u64,
    /// Requests received.
    pub asks: u64,
    /// Bytes of answers.
    pub answer_bytes: u64,
    /// Requests refused because there were too many.
    pub refused_asks: u64,
}

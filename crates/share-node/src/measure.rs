use crate::args::{Args, seconds};
use crate::json;
use crate::output;
use crate::publish::next;
use anyhow::Context;
use std::path::{Path, PathBuf};
use std::time::Duration;
use testkit::lossy_link::LossyLink;
use voxtile::{InMemoryMapper, MapConfig, MapView, Mapper};
use voxtile_formats::{ReadOptions, open_scans};
use voxtile_share::codec::{CONTEXTS, Packet, count_contexts};
use voxtile_share::{MapWatch, Receiver, ReceiverConfig, Sender};

const STEP: Duration = Duration::from_millis(50);
/// Time limit of a run after the last scan.
const TIMEOUT: Duration = Duration::from_secs(600);
/// Simulated time after the last scan at which a run without catch-up requests ends. The first scan is sent at twice
/// this time.
const REST: Duration = Duration::from_secs(5);
/// Maximum delay of a packet.
const DELAY: Duration = Duration::from_millis(40);

/// Sends scans over a simulated link and prints the bytes of each kind.
pub fn run(args: &Args, scans: &[PathBuf]) -> anyhow::Result<()> {
    let mut counts = vec![[0; 2]; CONTEXTS];
    let mut rows = Vec::new();
    for path in scans {
        rows.push(measure(args, path, &mut counts)?);
    }
    if let Some(file) = &args.write_prior {
        let table: Vec<u8> = counts.iter().map(|&counts| prior(counts)).collect();
        std::fs::write(file, table).with_context(|| format!("{}: cannot write", file.display()))?;
    }
    if args.json {
        return rows.iter().try_for_each(json::print);
    }
    output::print(
        "set                    points  voxels  sent B  again  status    asks answers   total B  of 16 B  of 46 B  most/frame  at receiver",
    )?;
    for row in &rows {
        let Row {
            set,
            points,
            voxels,
            packet_bytes,
            again,
            status_bytes,
            ask_bytes,
            answer_bytes,
            total,
            ..
        } = row;
        let share = |bytes: u64| 100.0 * *total as f64 / (bytes * points).max(1) as f64;
        output::print(format_args!(
            "{set:20} {points:8} {voxels:7} {packet_bytes:7} {again:6} {status_bytes:7} {ask_bytes:7} {answer_bytes:7} \
             {total:9} {:7.2}% {:7.2}% {:11} {:7.2}%{}",
            share(16),
            share(46),
            row.most_a_frame,
            100.0 * row.found as f64 / (*voxels).max(1) as f64,
            if row.is_equal { ", equal" } else { "" },
        ))?;
    }
    Ok(())
}

#[derive(serde::Serialize)]
struct Row {
    set: String,
    points: u64,
    /// Number of voxels in the sender's set at the end.
    voxels: u64,
    /// Number of these voxels that the receiver has.
    found: u64,
    /// Number of voxels that only the receiver has.
    wrong: u64,
    is_equal: bool,
    packet_bytes: u64,
    /// Number of repeated updates.
    again: u64,
    status_bytes: u64,
    ask_bytes: u64,
    answer_bytes: u64,
    /// Bytes in both directions, lost packets included.
    total: u64,
    most_a_frame: u64,
}

struct World {
    sender: Sender,
    receiver: Receiver,
    down: LossyLink,
    up: LossyLink,
    most_a_frame: u64,
}

fn measure(args: &Args, path: &Path, counts: &mut [[u64; 2]]) -> anyhow::Result<Row> {
    let mut source = open_scans(path, &ReadOptions { poses: args.poses.clone(), ..ReadOptions::default() })?;
    let scans = source.len_hint().unwrap_or(0) as u32;
    let period = seconds("--period", args.period)?;
    let cut = seconds("--cut", args.cut)?;
    let middle = period * scans / 2;
    let config = MapConfig::new(args.resolution, 100.0 * args.resolution)?.with_range(0.0, args.max_range);
    let mut mapper = InMemoryMapper::new(config)?;
    let watch = MapWatch::new(args.threshold)?;
    let mut receiver_config = ReceiverConfig::default();
    receiver_config.sends_requests = !args.no_catch_up;
    let mut world = World {
        sender: Sender::new(mapper.config().grid, 1, args.sender_config()?)?,
        receiver: Receiver::new(receiver_config),
        down: LossyLink::new(1, args.loss, 0.0, DELAY),
        up: LossyLink::new(2, args.loss, 0.0, DELAY),
        most_a_frame: 0,
    };
    let mut points = 0;
    // Sender and receiver connect before the first scan.
    let mut now = Duration::ZERO;
    let mut next_scan = REST + REST;
    let mut last_scan = None;
    loop {
        now += STEP;
        while last_scan.is_none() && now >= next_scan {
            match next(&mut *source, args.points)? {
                Some(scan) => {
                    points += scan.points.len() as u64;
                    mapper.insert_scan(&scan)?;
                    watch.take_scan(&mapper, &scan, &mut world.sender)?;
                    next_scan += period;
                }
                None => last_scan = Some(now),
            }
        }
        let is_cut = now >= REST + REST + middle && now < REST + REST + middle + cut;
        (world.down.is_cut, world.up.is_cut) = (is_cut, is_cut);
        world.step(now, args.write_prior.is_some().then_some(&mut *counts))?;
        let rest = now.saturating_sub(last_scan.unwrap_or(now));
        let last = Some(world.sender.last_packet());
        let is_equal =
            world.sender.is_idle() && world.receiver.is_converged() && world.receiver.equal_as_of() == last;
        if last_scan.is_some() && (is_equal || rest > if args.no_catch_up { REST } else { TIMEOUT }) {
            return Ok(world.row(path, points, is_equal));
        }
    }
}

impl World {
    fn step(&mut self, now: Duration, mut counts: Option<&mut [[u64; 2]]>) -> anyhow::Result<()> {
        let out = self.sender.poll(now);
        self.most_a_frame = self.most_a_frame.max(out.iter().map(|packet| packet.bytes.len() as u64).sum());
        for packet in out {
            if let Some(counts) = counts.as_deref_mut()
                && let Packet::Changes { updates, .. } = Packet::decode(&packet.bytes)?
            {
                count_contexts(&updates, counts)?;
            }
            self.down.send(&packet.bytes, now);
        }
        for ask in self.up.arrived(now) {
            for packet in self.sender.answer(1, &ask, now)? {
                self.down.send(&packet.bytes, now);
            }
        }
        for packet in self.down.arrived(now) {
            self.receiver.take(&packet, now)?;
        }
        for ask in self.receiver.poll(now) {
            self.up.send(&ask, now);
        }
        Ok(())
    }

    fn row(mut self, path: &Path, points: u64, is_equal: bool) -> Row {
        let counts = self.sender.counts();
        let sent = self.sender.sent();
        let layer = self.receiver.layer();
        let found =
            sent.iter().filter(|&voxel| layer.is_some_and(|layer| layer.contains(voxel))).count() as u64;
        Row {
            set: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            points,
            voxels: sent.len(),
            found,
            wrong: layer.map_or(0, |layer| layer.len()) - found,
            is_equal,
            packet_bytes: counts.packet_bytes,
            again: counts.updates_again,
            status_bytes: counts.status_bytes,
            ask_bytes: self.up.bytes,
            answer_bytes: counts.answer_bytes,
            total: self.down.bytes + self.up.bytes,
            most_a_frame: self.most_a_frame,
        }
    }
}

/// Returns an entry of the codec's table; 0 if there are too few samples.
fn prior([zeros, ones]: [u64; 2]) -> u8 {
    match zeros + ones {
        0..4 => 0,
        all => (256.0 * (ones as f64 + 0.3) / (all as f64 + 1.0)).round().clamp(1.0, 255.0) as u8,
    }
}

use crate::args::{Args, seconds};
use crate::inbox::Message;
use crate::json;
use crate::link::{Link, answers_key, packets_key, parse_key};
use crate::output;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use voxtile::space::Grid;
use voxtile::{InMemoryMapper, MapConfig, MapReader, Mapper, Scan};
use voxtile_formats::{ReadOptions, ScanSource, open_scans};
use voxtile_share::{MapWatch, Outgoing, Sender};

/// Interval at which the sender is polled.
const STEP: Duration = Duration::from_millis(20);

pub fn run(args: &Args, source: &Path, stop: &AtomicBool) -> anyhow::Result<()> {
    let watch = MapWatch::new(args.threshold)?;
    let mut feed = Feed::open(args, source)?;
    let mut sender = Sender::new(feed.grid(), epoch(), args.sender_config()?)?;
    if let Feed::Map(map) = &feed {
        watch.take_all(&**map, &mut sender)?;
    }
    let period = seconds("--rate", 1.0 / args.rate)?;
    let end = args.seconds.map(|end| seconds("--for", end)).transpose()?;
    let robot = args.robot[0].to_string();
    let mut link = Link::open(args)?;
    link.subscribe(&format!("voxtile/{robot}/asks/*"))?;

    let begin = Instant::now();
    let mut next_scan = Duration::ZERO;
    let mut scans = 0_u64;
    let mut is_reported = false;
    while !stop.load(Ordering::Relaxed) && end.is_none_or(|end| begin.elapsed() < end) {
        let now = begin.elapsed();
        if now >= next_scan
            && let Feed::Scans { source, mapper, is_over } = &mut feed
            && !*is_over
        {
            match next(&mut **source, args.points)? {
                Some(scan) => {
                    mapper.insert_scan(&scan)?;
                    watch.take_scan(&**mapper, &scan, &mut sender)?;
                    scans += 1;
                }
                None => *is_over = true,
            }
            next_scan = now.max(next_scan + period);
        }
        send(&link, &robot, sender.poll(now))?;
        if !is_reported && feed.is_over() && sender.is_idle() {
            report(args, scans, &mut sender)?;
            is_reported = true;
        }
        for message in asks(Instant::now() + STEP, stop, |wait| link.next(wait)) {
            if let Some((_, _, Some(receiver))) = parse_key(&message.key) {
                // Malformed requests get no answer.
                let answers = sender.answer(receiver, &message.bytes, begin.elapsed()).unwrap_or_default();
                send(&link, &robot, answers)?;
            }
        }
    }
    let last = sender.flush(begin.elapsed());
    send(&link, &robot, last)?;
    if !is_reported {
        report(args, scans, &mut sender)?;
    }
    link.close();
    Ok(())
}

/// Yields requests until the deadline or the stop, even if more keep arriving.
fn asks(
    deadline: Instant,
    stop: &AtomicBool,
    mut next: impl FnMut(Duration) -> Option<Message>,
) -> impl Iterator<Item = Message> {
    std::iter::from_fn(move || {
        let left = deadline.saturating_duration_since(Instant::now());
        let is_over = left.is_zero() || stop.load(Ordering::Relaxed);
        if is_over { None } else { next(left) }
    })
}

enum Feed {
    Map(Box<MapReader>),
    Scans { source: Box<dyn ScanSource>, mapper: Box<InMemoryMapper>, is_over: bool },
}

impl Feed {
    fn open(args: &Args, source: &Path) -> anyhow::Result<Self> {
        match MapReader::open(source, 64 << 20) {
            Ok(map) => return Ok(Self::Map(Box::new(map))),
            // The path is not that of a map: open it as scans.
            Err(voxtile::Error::NoMap { .. } | voxtile::Error::Io { .. }) => {}
            Err(error) => return Err(error.into()),
        }
        let config =
            MapConfig::new(args.resolution, 100.0 * args.resolution)?.with_range(0.0, args.max_range);
        let mapper = Box::new(InMemoryMapper::new(config)?);
        Ok(Self::Scans {
            source: open_scans(source, &ReadOptions { poses: args.poses.clone(), ..ReadOptions::default() })?,
            mapper,
            is_over: false,
        })
    }

    fn grid(&self) -> Grid {
        use voxtile::MapView;
        match self {
            Self::Map(map) => map.config().grid,
            Self::Scans { mapper, .. } => mapper.config().grid,
        }
    }

    fn is_over(&self) -> bool {
        match self {
            Self::Map(_) => true,
            Self::Scans { is_over, .. } => *is_over,
        }
    }
}

/// Returns the next scan in the world frame, subsampled to `points`.
pub fn next(source: &mut dyn ScanSource, points: Option<usize>) -> voxtile::Result<Option<Scan>> {
    let Some(scan) = source.next_scan()? else { return Ok(None) };
    let mut scan = scan.into_scan();
    if let Some(most) = points.filter(|&most| most < scan.points.len()) {
        let all = scan.points.len();
        scan.points = (0..most).map(|k| scan.points[k * all / most]).collect();
        scan.intensities = None;
    }
    Ok(Some(scan))
}

fn send(link: &Link, robot: &str, packets: Vec<Outgoing>) -> anyhow::Result<()> {
    for Outgoing { to, bytes } in packets {
        let key = to.map_or_else(|| packets_key(robot), |receiver| answers_key(robot, receiver));
        link.send(&key, bytes)?;
    }
    Ok(())
}

/// Prints the size and digest of the shared set.
fn report(args: &Args, scans: u64, sender: &mut Sender) -> anyhow::Result<()> {
    let (counts, robot) = (sender.counts(), args.robot[0].to_string());
    let (voxels, digest) = (sender.sent().len(), sender.sent().digest());
    if args.json {
        let line = serde_json::json!({
            "robot": robot, "scans": scans, "voxels": voxels, "digest": digest.to_string(), "counts": counts,
        });
        json::print(&line)?;
    } else {
        output::print(format_args!("{robot}: {voxels} voxels, digest {digest}"))?;
        output::print(format_args!(
            "sent      {} bytes in {} packets of {} frames",
            counts.packet_bytes, counts.packets, counts.frames
        ))?;
    }
    Ok(())
}

/// Returns a new epoch for each run: from the clock, hashed with the process id and a random key.
pub fn epoch() -> u32 {
    random_number() as u32
}

/// Returns a number that others cannot guess.
pub fn random_number() -> u64 {
    use std::hash::{BuildHasher, Hasher, RandomState};
    let mut hasher = RandomState::new().build_hasher();
    hasher.write_u128(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos()));
    hasher.write_u32(std::process::id());
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask() -> Message {
        Message { key: "voxtile/a/asks/1".to_owned(), bytes: vec![0; 8] }
    }

    #[test]
    fn endless_requests_end_at_the_deadline() {
        let (stop, most) = (AtomicBool::new(false), Duration::from_secs(30));
        let begin = Instant::now();
        let received = asks(begin + STEP, &stop, |_| (begin.elapsed() < most).then(ask)).count();
        assert!(received > 0 && begin.elapsed() < most);
    }

    #[test]
    fn endless_requests_end_at_a_stop() {
        let stop = AtomicBool::new(false);
        let mut left = 1000;
        let next = |_| {
            left -= 1;
            stop.store(left == 990, Ordering::Relaxed);
            (left > 0).then(ask)
        };
        assert_eq!(asks(Instant::now() + Duration::from_secs(600), &stop, next).count(), 10);
    }
}

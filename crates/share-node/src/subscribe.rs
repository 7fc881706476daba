use crate::args::{Args, seconds};
use crate::files::{layers_folder, lengths, load_layer, open_map};
use crate::json;
use crate::layer_store::{LayerLimits, LayerStore};
use crate::link::{Link, asks_key, parse_key};
use crate::output;
use crate::publish::random_number;
use crate::reports::{Kind, Reports};
use crate::robot_name::RobotName;
use anyhow::{Context, bail};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use voxtile::space::{Grid, VoxelBox};
use voxtile::{Error, MapReader, MapView, Mapper};
use voxtile_share::{ReceiverConfig, Receivers, VoxelSet, merge_layer};

const STEP: Duration = Duration::from_millis(50);
/// Interval between writes of the layers to disk.
const SAVE: Duration = Duration::from_secs(30);
/// Time for which layers must remain equal for `--until-equal`.
const EQUAL: Duration = Duration::from_secs(3);
/// Maximum number of robots that have not sent a status yet. A further robot replaces the one that has waited longest.
const MAX_UNKNOWN: usize = 256;

/// Accepted robot. Its receiver is in [`Subscriber::receivers`].
struct Robot {
    store: LayerStore,
    /// Key of requests to the robot.
    key: String,
    since: Duration,
}

struct Subscriber<'a> {
    args: &'a Args,
    id: u64,
    /// Grid of the map into which layers are folded, if the map exists.
    grid: Option<Grid>,
    region: Option<VoxelBox>,
    folder: PathBuf,
    robots: BTreeMap<RobotName, Robot>,
    receivers: Receivers<RobotName>,
    reports: Reports,
    /// Whether a robot was refused for lack of memory or by `--max-robots`.
    has_refused: bool,
    link: Link,
}

pub fn run(args: &Args, map: &Path, stop: &AtomicBool) -> anyhow::Result<()> {
    let end = args.seconds.map(|end| seconds("--for", end)).transpose()?;
    let grid = match MapReader::open(map, 0) {
        Ok(reader) => Some(reader.config().grid),
        Err(Error::NoMap { .. } | Error::Io { .. }) => None,
        Err(error) => return Err(error.into()),
    };
    let receivers = Receivers::new(args.memory.as_u64() as usize)
        .map_err(|error| Error::argument("--memory", error.to_string()))?;
    let region = args.region.as_deref().map(|region| box_of(region, grid)).transpose()?;
    let folder = layers_folder(map);
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("{}: cannot create the folder", folder.display()))?;
    let (id, link) = (random_number(), Link::open(args)?);
    let (robots, reports) = (BTreeMap::new(), Reports::default());
    let mut subscriber =
        Subscriber { args, id, grid, region, folder, robots, receivers, reports, has_refused: false, link };
    subscriber.link.subscribe("voxtile/*/packets")?;
    subscriber.link.subscribe(&format!("voxtile/*/answers/{:016x}", subscriber.id))?;

    let begin = Instant::now();
    let (mut next_poll, mut next_save, mut equal_since) = (Duration::ZERO, SAVE, None);
    while !stop.load(Ordering::Relaxed) && end.is_none_or(|end| begin.elapsed() < end) {
        if let Some(message) = subscriber.link.next(STEP) {
            subscriber.take(&message.key, &message.bytes, begin.elapsed());
        }
        let now = begin.elapsed();
        if now >= next_poll {
            next_poll = now + STEP;
            subscriber.ask(now);
            equal_since = if subscriber.is_equal() { Some(equal_since.unwrap_or(now)) } else { None };
            if args.until_equal && equal_since.is_some_and(|since| now >= since + EQUAL) {
                break;
            }
        }
        if now >= next_save {
            next_save = now + SAVE;
            subscriber.save();
        }
    }
    subscriber.finish(map)
}

impl Subscriber<'_> {
    fn take(&mut self, key: &str, bytes: &[u8], now: Duration) {
        let since = Instant::now();
        let Some((name, _, _)) = parse_key(key) else { return };
        let Ok(robot) = name.parse::<RobotName>() else { return };
        let is_admitted = self.robots.contains_key(&robot) || self.admit(&robot, now);
        if is_admitted && (self.is_known(&robot) || self.has_capacity_for(&robot)) {
            let taken = self.receivers.take(&robot, bytes, now);
            if self.is_known(&robot) {
                self.link.inbox().admit(name, true);
            }
            self.report_problems(&robot, taken.err().map(|error| error.to_string()));
        }
        self.link.inbox().has_spent(name, since);
    }

    /// Accepts a robot if the limits allow it.
    fn admit(&mut self, robot: &RobotName, now: Duration) -> bool {
        let named = &self.args.robot;
        if !named.is_empty() && !named.contains(robot) {
            return false;
        }
        if !self.has_capacity_for(robot) {
            return false;
        }
        if self.robots.len() - self.receivers.known() >= MAX_UNKNOWN {
            self.dismiss_unknown();
        }
        let mut store = LayerStore::new(&self.folder, robot);
        let limits = LayerLimits {
            grid: self.grid,
            max_voxels: self.args.max_voxels,
            max_bytes: self.receivers.free_bytes(),
        };
        let layer = store.load(robot, limits, &mut self.reports);
        self.receivers.insert(robot.clone(), self.config(), layer);
        let name = robot.to_string();
        let key = asks_key(&name, self.id);
        self.robots.insert(robot.clone(), Robot { store, key, since: now });
        true
    }

    /// Reports the first refused robot. Others are refused silently: there may be any number of them.
    fn refuse(&mut self, robot: &RobotName, reason: &str) -> bool {
        if !std::mem::replace(&mut self.has_refused, true) {
            output::report(format_args!(
                "{robot} is refused, possibly others too: {reason}; select robots with --robot"
            ));
        }
        false
    }

    /// Returns whether a robot has sent its status or has a saved layer.
    fn is_known(&self, robot: &RobotName) -> bool {
        self.receivers.get(robot).is_some_and(|receiver| receiver.layer().is_some())
    }

    /// Returns whether the limits allow one more known robot.
    fn has_capacity_for(&mut self, robot: &RobotName) -> bool {
        if !self.receivers.has_room() {
            return self.refuse(robot, "no memory for another robot (--memory)");
        }
        if self.args.robot.is_empty() && self.receivers.known() >= self.args.max_robots {
            let reason = format!("the limit of {} robots is reached (--max-robots)", self.args.max_robots);
            return self.refuse(robot, &reason);
        }
        true
    }

    /// Removes the robot that has waited longest without a status, because anyone can invent robot names.
    fn dismiss_unknown(&mut self) {
        let unknown = self.robots.iter().filter(|(robot, _)| !self.is_known(robot));
        let longest = unknown.min_by_key(|(_, waiting)| waiting.since).map(|(robot, _)| robot.clone());
        if let Some(robot) = longest {
            self.receivers.remove(&robot);
            self.robots.remove(&robot);
        }
    }

    fn config(&self) -> ReceiverConfig {
        let mut config = ReceiverConfig::default();
        config.grid = self.grid;
        config.memory_bytes = self.args.memory.as_u64() as usize;
        config.max_voxels = self.args.max_voxels;
        config.max_tiles = self.args.max_tiles;
        config.region = self.region;
        config.nonce_seed = random_number();
        config
    }

    /// Reports the problems of a robot with a known grid. Before that, malformed packets in its name are only counted.
    fn report_problems(&mut self, robot: &RobotName, malformed: Option<String>) {
        let Some(receiver) = self.receivers.get(robot) else { return };
        if let (Some(grid), Some(ours)) = (receiver.refused_grid(), &self.grid) {
            self.reports.report(robot, Kind::Grid, || {
                format!("has {}, but the map has {}; its voxels are ignored", lengths(grid), lengths(ours))
            });
        }
        if receiver.layer().is_none() {
            return;
        }
        if receiver.is_over_limit() {
            let counts = receiver.counts();
            self.reports.report(robot, Kind::Limit, || {
                let (refused, cut) = (counts.refused_voxels, counts.cut_voxels);
                format!(
                    "exceeds its limits ({refused} voxels refused, {cut} dropped so far): raise \
                     --memory, --max-voxels or --max-tiles, or extend --region"
                )
            });
        }
        if let Some(error) = malformed {
            self.reports.report(robot, Kind::Malformed, || {
                format!("malformed packet: {error}; further ones are only counted")
            });
        }
    }

    fn ask(&mut self, now: Duration) {
        for (name, receiver) in self.receivers.iter_mut() {
            let since = Instant::now();
            let Some(robot) = self.robots.get(name) else { continue };
            for ask in receiver.poll(now) {
                if let Err(error) = self.link.send(&robot.key, ask) {
                    self.reports.report(name, Kind::Ask, || format!("{error:#}"));
                }
            }
            self.link.inbox().has_spent(&name.to_string(), since);
        }
    }

    /// Returns whether at least one robot and each robot of `--robot` has a layer, and all layers equal their sets.
    fn is_equal(&self) -> bool {
        let mut layers = self.receivers.iter().filter(|(_, receiver)| receiver.layer().is_some()).peekable();
        let has_layer = |name| self.receivers.get(name).is_some_and(|receiver| receiver.layer().is_some());
        layers.peek().is_some()
            && self.args.robot.iter().all(has_layer)
            && layers.all(|(_, receiver)| receiver.is_converged())
    }

    fn save(&mut self) {
        for (name, receiver) in self.receivers.iter_mut() {
            if let (Some(robot), Some(layer)) = (self.robots.get_mut(name), receiver.layer_mut()) {
                robot.store.save(name, layer, &mut self.reports);
            }
        }
    }

    /// Saves the layers, folds each into the map and prints a summary.
    fn finish(mut self, map: &Path) -> anyhow::Result<()> {
        self.save();
        let Self { args, mut robots, receivers, mut reports, link, .. } = self;
        link.close();
        let grid = self.grid.or_else(|| grid_of_most(&receivers));
        // Drop layers that are saved in files, to free memory for the map.
        let mut left = Vec::new();
        for (name, receiver) in receivers {
            let Some(robot) = robots.remove(&name) else { continue };
            let (is_equal, counts) = (receiver.is_converged(), receiver.counts());
            let Some(mut layer) = receiver.into_layer() else { continue };
            let summary = (layer.len(), layer.digest().to_string(), is_equal, counts);
            let kept = (!robot.store.has(&mut layer)).then_some(layer);
            left.push((name, robot.store, kept, summary));
        }
        let (mut at_fault, mut lines) = (Vec::new(), Vec::new());
        for (name, store, kept, (voxels, digest, is_equal, counts)) in left {
            let (is_saved, mut is_folded) = (kept.is_none(), true);
            if let Some(grid) = grid.as_ref().filter(|_| !args.keep_apart) {
                let layer = kept.map_or_else(|| load_layer(store.path(), u64::MAX), Ok);
                if let Err(error) =
                    layer.and_then(|layer| fold(map, grid, &layer, args.memory.as_u64() as usize))
                {
                    is_folded = false;
                    reports.report(&name, Kind::Fold, || format!("{error:#}; its layer is not folded"));
                }
            }
            if !(is_saved && is_folded) {
                at_fault.push(name.to_string());
            }
            let faults: Vec<&str> = reports.of(&name).collect();
            if args.json {
                let line = serde_json::json!({
                    "robot": name.to_string(), "voxels": voxels, "digest": digest, "is_equal": is_equal,
                    "is_saved": is_saved, "faults": faults, "counts": counts,
                });
                lines.push(json::line(&line)?);
            } else {
                let state = if is_equal { "equal to the robot's" } else { "not known to be equal" };
                let (bytes, ask_bytes) = (counts.bytes, counts.ask_bytes);
                lines.push(format!("{name}: {voxels} voxels, digest {digest}, {state}"));
                lines.push(format!("received  {bytes} bytes, requested with {ask_bytes} bytes"));
            }
        }
        // Print last: a closed or full output must not prevent folding.
        let printed = lines.iter().try_for_each(output::print);
        if !at_fault.is_empty() {
            bail!(
                "cannot save or fold into {} the layers of {}; see above",
                map.display(),
                at_fault.join(", ")
            );
        }
        Ok(printed?)
    }
}

/// Folds a layer into a map. The map gets the memory limit minus the size of the layer.
fn fold(map: &Path, grid: &Grid, layer: &VoxelSet, memory_bytes: usize) -> anyhow::Result<()> {
    if grid.resolution_m().to_bits() != layer.grid().resolution_m().to_bits() {
        bail!("the layer has {}, but the map has {}", lengths(layer.grid()), lengths(grid));
    }
    let mut mapper = open_map(map, grid, memory_bytes.saturating_sub(layer.memory_bytes()))?;
    merge_layer(layer, &mut mapper)?;
    Ok(mapper.flush()?)
}

/// Chooses the grid of a new map: the most frequent grid, or of equally frequent ones the first by robot name.
fn grid_of_most(receivers: &Receivers<RobotName>) -> Option<Grid> {
    let grids: Vec<Grid> =
        receivers.iter().filter_map(|(_, receiver)| receiver.layer().map(|layer| *layer.grid())).collect();
    let count = |grid: &Grid| grids.iter().filter(|other| *other == grid).count();
    // Of equally frequent grids, `max_by_key` returns the last one. Iterate backwards to get the first one.
    grids.iter().rev().max_by_key(|grid| count(grid)).copied()
}

fn box_of(region: &[f64], grid: Option<Grid>) -> anyhow::Result<VoxelBox> {
    let grid =
        grid.ok_or_else(|| Error::argument("--region", "MAP must exist, because its voxel size is needed"))?;
    let corner = |at: usize| {
        let corner = grid.voxel_of([region[at], region[at + 1], region[at + 2]]);
        corner.ok_or_else(|| Error::argument("--region", "a corner is not finite or out of range"))
    };
    Ok(VoxelBox { min: corner(0)?, end: corner(3)? })
}

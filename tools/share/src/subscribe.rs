use crate::args::{Args, seconds};
use crate::files::{layers_folder, load_layer, open_map, save_layer};
use crate::link::{Link, asks_key, parse_key};
use crate::publish::random_number;
use crate::robot_name::RobotName;
use anyhow::Context;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use voxtile::share::{Receiver, ReceiverConfig, fold_layer};
use voxtile::space::{Grid, VoxelBox};
use voxtile::{Error, MapReader, MapView, Mapper};

const STEP: Duration = Duration::from_millis(50);
/// Layers are written to disk so often.
const SAVE: Duration = Duration::from_secs(30);
/// How long layers are to be equal to be called so.
const EQUAL: Duration = Duration::from_secs(3);

/// A robot that is listened to.
struct Robot {
    receiver: Receiver,
    file: PathBuf,
    /// Asks have their own key.
    key: String,
}

struct Subscriber<'a> {
    args: &'a Args,
    id: u64,
    /// The voxels of the map that layers are folded into, if it is there.
    grid: Option<Grid>,
    folder: PathBuf,
    robots: BTreeMap<RobotName, Robot>,
}

pub fn run(args: &Args, map: &Path, stop: &AtomicBool) -> anyhow::Result<()> {
    let end = args.seconds.map(|end| seconds("--for", end)).transpose()?;
    let grid = match MapReader::open(map, 1) {
        Ok(reader) => Some(reader.config().grid),
        Err(Error::NoMap { .. } | Error::Io { .. }) => None,
        Err(error) => return Err(error.into()),
    };
    let folder = layers_folder(map);
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("{}: cannot make the folder", folder.display()))?;
    let mut subscriber = Subscriber { args, id: random_number(), grid, folder, robots: BTreeMap::new() };
    let mut link = Link::open(args)?;
    link.subscribe("voxtile/*/packets")?;
    link.subscribe(&format!("voxtile/*/answers/{:016x}", subscriber.id))?;

    let begin = Instant::now();
    let (mut next_poll, mut next_save, mut equal_since) = (Duration::ZERO, SAVE, None);
    while !stop.load(Ordering::Relaxed) && end.is_none_or(|end| begin.elapsed() < end) {
        if let Some(message) = link.next(STEP) {
            subscriber.take(&message.key, &message.bytes, begin.elapsed())?;
        }
        let now = begin.elapsed();
        if now >= next_poll {
            next_poll = now + STEP;
            for robot in subscriber.robots.values_mut() {
                for ask in robot.receiver.poll(now) {
                    link.send(&robot.key, ask)?;
                }
            }
            equal_since = if subscriber.is_equal() { Some(equal_since.unwrap_or(now)) } else { None };
            if args.until_equal && equal_since.is_some_and(|since| now >= since + EQUAL) {
                break;
            }
        }
        if now >= next_save {
            next_save = now + SAVE;
            subscriber.save()?;
        }
    }
    link.close();
    subscriber.save()?;
    subscriber.finish(map)
}

impl Subscriber<'_> {
    fn take(&mut self, key: &str, bytes: &[u8], now: Duration) -> anyhow::Result<()> {
        let Some((name, _, _)) = parse_key(key) else { return Ok(()) };
        let Ok(name) = name.parse::<RobotName>() else { return Ok(()) };
        let is_wanted = self.args.robot.is_empty() || self.args.robot.contains(&name);
        if !self.robots.contains_key(&name) {
            if !is_wanted || self.robots.len() >= self.args.max_robots {
                return Ok(());
            }
            let robot = self.robot(&name)?;
            self.robots.insert(name.clone(), robot);
        }
        if let Some(robot) = self.robots.get_mut(&name) {
            // Counted, and nothing else: others may send what they like.
            let _ = robot.receiver.take(bytes, now);
        }
        Ok(())
    }

    fn robot(&self, name: &RobotName) -> anyhow::Result<Robot> {
        let mut config = ReceiverConfig::default();
        config.grid = self.grid;
        config.max_voxels = self.args.max_voxels;
        config.max_tiles = self.args.max_tiles;
        config.region = self.args.region.as_deref().map(|region| self.region(region)).transpose()?;
        config.nonce_seed = random_number();
        let file = self.folder.join(format!("{name}.layer"));
        let receiver = match file.exists() {
            true => Receiver::with_layer(config, load_layer(&file, self.args.max_voxels)?),
            false => Receiver::new(config),
        };
        let key = asks_key(&name.to_string(), self.id);
        Ok(Robot { receiver, file, key })
    }

    fn region(&self, region: &[f64]) -> anyhow::Result<VoxelBox> {
        let grid = self
            .grid
            .ok_or_else(|| Error::argument("--region", "MAP must be there, for the size of its voxels"))?;
        let corner = |at: usize| {
            let corner = grid.voxel_of([region[at], region[at + 1], region[at + 2]]);
            corner.ok_or_else(|| Error::argument("--region", "a corner is not finite or too far away"))
        };
        Ok(VoxelBox { min: corner(0)?, end: corner(3)? })
    }

    fn is_equal(&self) -> bool {
        !self.robots.is_empty() && self.robots.values().all(|robot| robot.receiver.is_converged())
    }

    fn save(&mut self) -> anyhow::Result<()> {
        for robot in self.robots.values_mut() {
            if let Some(layer) = robot.receiver.layer_mut() {
                save_layer(&robot.file, layer)?;
            }
        }
        Ok(())
    }

    /// Folds the layers into the map, and says what there is.
    fn finish(&mut self, map: &Path) -> anyhow::Result<()> {
        for (name, robot) in &mut self.robots {
            let is_equal = robot.receiver.is_converged();
            let counts = robot.receiver.counts();
            let Some(layer) = robot.receiver.layer_mut() else { continue };
            if !self.args.keep_apart {
                let mut mapper = open_map(map, layer)?;
                fold_layer(layer, &mut mapper)?;
                mapper.flush()?;
            }
            let (voxels, digest) = (layer.len(), layer.digest().to_string());
            if self.args.json {
                let line = serde_json::json!({
                    "robot": name.to_string(), "voxels": voxels, "digest": digest, "is_equal": is_equal, "counts": counts,
                });
                println!("{line}");
            } else {
                let state = if is_equal { "equal to the robot's" } else { "not known to be equal" };
                println!("{name}: {voxels} voxels, digest {digest}, {state}");
                println!("received  {} bytes, asked {} bytes", counts.bytes, counts.ask_bytes);
            }
        }
        Ok(())
    }
}

use super::forest::{Forest, LENGTH_M};
use super::{RESOLUTION_M, STEP};
use crate::planner::{distance_m, is_free, plan};
use std::time::{Duration, Instant};
use testkit::lossy_link::LossyLink;
use voxtile::space::{Grid, Point};
use voxtile::{InMemoryMapper, MapConfig, Mapper, Result};
use voxtile_local::{LocalMap, LocalParameters};
use voxtile_share::{MapWatch, Receiver, ReceiverConfig, Sender, SenderConfig, VoxelSet};

/// A sensor.
#[derive(Clone, Copy)]
pub struct Sensing {
    pub range_m: f64,
    /// Horizontal and vertical.
    pub view_deg: [f64; 2],
    pub rays: [u32; 2],
    /// Downward tilt.
    pub pitch_deg: f64,
}

impl Sensing {
    /// Sensor of a traveller in the paper.
    pub const ONBOARD: Self =
        Self { range_m: 10.0, view_deg: [360.0, 90.0], rays: [180, 24], pitch_deg: 0.0 };
    /// Sensor of a spotter in the paper.
    const SPOTTER: Self = Self { range_m: 30.0, view_deg: [100.0, 60.0], rays: [110, 66], pitch_deg: 80.0 };
}

/// Two spotters above the forest, each with a receiver. All travellers receive the same voxels.
pub struct Sharing {
    spotters: [Spotter; 2],
    now: Duration,
    /// All voxels received so far, from both spotters.
    received: VoxelSet,
    /// Centers of the voxels received in the last step.
    pub new_points: Vec<Point>,
}

struct Spotter {
    map: InMemoryMapper,
    sender: Sender,
    receiver: Receiver,
    down: LossyLink,
    up: LossyLink,
    number: u64,
}

/// Share of lost packets.
const LOSS: f64 = 0.1;
const SPOTTER_HEIGHT_M: f64 = 14.0;
/// Distance of the spotters ahead of the travellers.
const AHEAD_M: f64 = 7.0;

impl Sharing {
    pub fn new(seed: u64) -> Result<Self> {
        let spotter = |number: u64| -> Result<Spotter> {
            let config = MapConfig::new(RESOLUTION_M, 100.0 * RESOLUTION_M)?;
            let mut sharing = SenderConfig::default();
            sharing.latency = STEP;
            let link =
                |salt| LossyLink::new(seed * 8 + number * 2 + salt, LOSS, 0.0, Duration::from_millis(60));
            Ok(Spotter {
                sender: Sender::new(config.grid, 1, sharing)?,
                map: InMemoryMapper::new(config)?,
                receiver: Receiver::new(ReceiverConfig::default()),
                down: link(0),
                up: link(1),
                number,
            })
        };
        let received = VoxelSet::new(Grid::new(RESOLUTION_M, 100.0 * RESOLUTION_M)?);
        Ok(Self {
            spotters: [spotter(0)?, spotter(1)?],
            now: Duration::ZERO,
            received,
            new_points: Vec::new(),
        })
    }

    /// Lets the spotters scan and share. `middle_m` is the mean position of the travellers.
    pub fn step(&mut self, forest: &Forest, middle_m: f64, step: u32) -> Result<()> {
        self.now += STEP;
        for spotter in &mut self.spotters {
            let side = if spotter.number == 0 { -7.0 } else { 7.0 };
            // One spotter sees the trees from behind, the other from the front, so that both sides are seen.
            let ahead = if spotter.number == 0 { AHEAD_M - 6.0 } else { AHEAD_M + 6.0 };
            let at = [middle_m + ahead, side, SPOTTER_HEIGHT_M];
            let scan = forest.scan(Sensing::SPOTTER, at, u64::from(step) * 2 + spotter.number);
            spotter.map.insert_scan(&scan)?;
            MapWatch::new(0.5)?.take_scan(&spotter.map, &scan, &mut spotter.sender)?;
            spotter.exchange(self.now);
        }
        self.find_new();
        Ok(())
    }

    fn find_new(&mut self) {
        self.new_points.clear();
        for layer in self.spotters.iter().filter_map(|spotter| spotter.receiver.layer()) {
            for voxel in layer.iter() {
                if self.received.put(voxel, true) {
                    self.new_points.push(layer.grid().center_m(voxel));
                }
            }
        }
    }

    /// Bytes per second of both spotters, in both directions.
    pub fn bytes_per_s(&self) -> f64 {
        let bytes: u64 = self.spotters.iter().map(|spotter| spotter.down.bytes + spotter.up.bytes).sum();
        bytes as f64 / self.now.as_secs_f64()
    }

    /// Received voxels of each spotter.
    pub fn layers(&self) -> impl Iterator<Item = &VoxelSet> {
        self.spotters.iter().filter_map(|spotter| spotter.receiver.layer())
    }
}

impl Spotter {
    fn exchange(&mut self, now: Duration) {
        for packet in self.sender.poll(now) {
            self.down.send(&packet.bytes, now);
        }
        for request in self.up.arrived(now) {
            for packet in self.sender.answer(1, &request, now).unwrap_or_default() {
                self.down.send(&packet.bytes, now);
            }
        }
        for packet in self.down.arrived(now) {
            // Damaged packets are ignored.
            let _ = self.receiver.take(&packet, now);
        }
        for request in self.receiver.poll(now) {
            self.up.send(&request, now);
        }
    }
}

/// A robot that flies to the other end of the forest.
pub struct Traveller {
    map: LocalMap,
    pub at: Point,
    goal: Point,
    pub path: Vec<Point>,
    pub length_m: f64,
    pub steps: u32,
    planning: Duration,
    pub has_arrived: bool,
    pub has_collided: bool,
}

const SPEED_M_PER_S: f64 = 3.0;
/// Planning horizon of the paper.
const HORIZON_M: f64 = 9.5;
const RADIUS_M: f64 = 0.2;
const INFLATION_M: f64 = 0.4;
const HEIGHT_M: f64 = 2.0;
/// The paper's local maps have 50 000 voxels; these also contain the ground.
const MAX_VOXELS: usize = 150_000;

impl Traveller {
    /// Four travellers side by side.
    pub fn four() -> Result<Vec<Self>> {
        [-6.0, -2.0, 2.0, 6.0].into_iter().map(Self::new).collect()
    }

    fn new(y: f64) -> Result<Self> {
        let parameters = LocalParameters::passive_perception().with_inflation_radius(INFLATION_M);
        let at = [0.0, y, HEIGHT_M];
        Ok(Self {
            map: LocalMap::new(RESOLUTION_M, parameters.with_max_voxels(Some(MAX_VOXELS)))?,
            at,
            goal: [LENGTH_M, y, HEIGHT_M],
            path: vec![at],
            length_m: 0.0,
            steps: 0,
            planning: Duration::ZERO,
            has_arrived: false,
            has_collided: false,
        })
    }

    pub fn is_over(&self) -> bool {
        self.has_arrived || self.has_collided
    }

    pub fn planning_ms(&self) -> f64 {
        self.planning.as_secs_f64() * 1e3 / f64::from(self.steps.max(1))
    }

    /// Inserts the newly received voxels as hits, without rays.
    pub fn receive(&mut self, sharing: &Sharing) -> Result<()> {
        self.map.insert_relayed(self.at, &sharing.new_points).map(drop)
    }

    /// Inserts its own scan; returns the number of points.
    pub fn scan(&mut self, forest: &Forest, sensing: Sensing, number: u64) -> Result<usize> {
        let scan = forest.scan(sensing, self.at, number);
        self.map.insert_scan(&scan)?;
        Ok(scan.points.len())
    }

    /// Plans, and flies for one step.
    pub fn fly(&mut self, forest: &Forest) {
        if self.is_over() {
            return;
        }
        self.steps += 1;
        let begin = Instant::now();
        let path = self.plan_path();
        self.planning += begin.elapsed();
        let mut rest = SPEED_M_PER_S * STEP.as_secs_f64();
        for &corner in path.iter().skip(1) {
            let length = distance_m(self.at, corner);
            let part = if length <= rest { 1.0 } else { rest / length };
            let from = self.at;
            self.at = std::array::from_fn(|k| from[k] + part * (corner[k] - from[k]));
            self.length_m += part * length;
            rest -= part * length;
            self.path.push(self.at);
            if part < 1.0 {
                break;
            }
        }
        self.has_collided = forest.collides(self.at, RADIUS_M);
        self.has_arrived = !self.has_collided && distance_m(self.at, self.goal) < 1.0;
    }

    /// Plans towards the goal, up to the horizon; if that point is not free, to a point next to it or closer.
    fn plan_path(&self) -> Vec<Point> {
        let distance = distance_m(self.at, self.goal);
        for reach in [1.0, 0.8, 0.6] {
            for aside in [0.0, 1.2, -1.2, 2.4, -2.4, 3.6, -3.6] {
                let part = (reach * HORIZON_M / distance).min(1.0);
                let mut to: Point = std::array::from_fn(|k| self.at[k] + part * (self.goal[k] - self.at[k]));
                if part < 1.0 {
                    to[1] += aside;
                }
                if is_free(self.map.view(), to, to)
                    && let Some(path) = plan(self.map.view(), self.at, to)
                {
                    return path;
                }
            }
        }
        Vec::new()
    }
}

use std::collections::{BTreeMap, BTreeSet};
use voxtile::Scan;
use voxtile::maths::logit;
use voxtile::scan::RayWalk;
use voxtile::space::{Grid, Point, VoxelIndex};
use voxtile_local::{LocalParameters, LocalState, LocalView};

/// A naive local map for comparisons: the history is a list, and everything else is computed each time.
pub struct ReferenceLocal {
    pub grid: Grid,
    pub parameters: LocalParameters,
    pub position: Point,
    /// Voxels with occupancy and their log-odds, least recently updated first.
    pub history: Vec<(VoxelIndex, f64)>,
}

impl ReferenceLocal {
    pub fn new(resolution_m: f64, parameters: LocalParameters) -> Self {
        let grid = Grid::new(resolution_m, 64.0 * resolution_m).unwrap();
        Self { grid, parameters, position: [0.0; 3], history: Vec::new() }
    }

    pub fn insert_scan(&mut self, scan: &Scan) {
        self.update(scan.origin, &scan.points, true);
    }

    pub fn update(&mut self, origin: Point, points: &[Point], has_rays: bool) {
        self.judge_all();
        self.position = origin;
        let p = self.parameters;
        let mut order: Vec<VoxelIndex> = Vec::new();
        let mut counts: BTreeMap<VoxelIndex, (u32, u32)> = BTreeMap::new();
        let counting: Vec<Point> =
            points.iter().copied().filter(|point| self.counts(origin, *point)).collect();
        for point in &counting {
            let voxel = self.grid.voxel_of(*point).unwrap();
            counts.entry(voxel).or_insert_with(|| {
                order.push(voxel);
                (0, 0)
            });
            counts.get_mut(&voxel).unwrap().0 += 1;
        }
        let known: BTreeSet<VoxelIndex> = self.history.iter().map(|(voxel, _)| *voxel).collect();
        for &point in counting.iter().filter(|_| has_rays) {
            for voxel in self.passed(origin, point) {
                if known.contains(&voxel) || counts.contains_key(&voxel) {
                    counts.entry(voxel).or_insert_with(|| {
                        order.push(voxel);
                        (0, 0)
                    });
                    counts.get_mut(&voxel).unwrap().1 += 1;
                }
            }
        }
        let (new, kept): (Vec<_>, Vec<_>) = order.into_iter().partition(|voxel| !known.contains(voxel));
        for voxel in new.into_iter().chain(kept) {
            let at = self.history.iter().position(|(other, _)| *other == voxel);
            let before = at.map_or(logit(p.initial_probability), |at| self.history.remove(at).1);
            let (hits, misses) = counts[&voxel];
            let sum = f64::from(hits) * p.log_odds.hit + f64::from(misses) * p.log_odds.miss;
            self.history.push((voxel, (before + sum).clamp(p.log_odds.min, p.log_odds.max)));
        }
        self.judge_all();
        let excess = p.max_voxels.map_or(0, |most| self.history.len().saturating_sub(most));
        self.history.drain(..excess);
    }

    /// Clamps all log-odds, and removes free voxels.
    fn judge_all(&mut self) {
        let p = self.parameters;
        for (_, log_odds) in &mut self.history {
            *log_odds = log_odds.clamp(p.log_odds.min, p.log_odds.max);
        }
        self.history.retain(|(_, l)| *l > p.free_log_odds || *l >= p.occupied_log_odds);
    }

    fn counts(&self, origin: Point, point: Point) -> bool {
        let p = self.parameters;
        let squared: f64 = {
            let [x, y, z]: Point = std::array::from_fn(|k| point[k] - origin[k]);
            x * x + y * y + z * z
        };
        point.iter().all(|x| x.is_finite())
            && point != origin
            && squared <= p.input_range_m * p.input_range_m
            && squared >= p.min_input_range_m * p.min_input_range_m
            && self.grid.voxel_of(point).is_some_and(|voxel| voxel.iter().all(|k| k.abs() < 1_000_000))
    }

    fn passed(&self, origin: Point, point: Point) -> Vec<VoxelIndex> {
        let voxel = |point| self.grid.voxel_of(point).unwrap();
        let units = |point| self.grid.to_voxel_units(point);
        let mut walk = RayWalk::between(units(origin), voxel(origin), units(point), voxel(point));
        let mut passed = Vec::new();
        while !walk.is_at_end() {
            passed.push(walk.voxel());
            walk.advance();
        }
        passed
    }

    pub fn occupied(&self) -> BTreeSet<VoxelIndex> {
        let is_occupied = |(_, log_odds): &&(_, f64)| *log_odds >= self.parameters.occupied_log_odds;
        self.history.iter().filter(is_occupied).map(|(voxel, _)| *voxel).collect()
    }

    /// Dilation of the occupied voxels within the inflation range.
    pub fn inflated(&self) -> BTreeSet<VoxelIndex> {
        let LocalParameters { inflation_range_m, inflation_radius_m, .. } = self.parameters;
        self.dilation(inflation_range_m, inflation_radius_m)
    }

    pub fn dilation(&self, range_m: f64, radius_m: f64) -> BTreeSet<VoxelIndex> {
        let resolution_m = self.grid.resolution_m();
        let r = (radius_m / resolution_m).ceil() as i32;
        let mut inflated = BTreeSet::new();
        for voxel in self.occupied() {
            let center_m = self.grid.center_m(voxel);
            let [x, y, z]: Point = std::array::from_fn(|k| center_m[k] - self.position[k]);
            if x * x + y * y + z * z > range_m * range_m {
                continue;
            }
            for d in (-r..=r).flat_map(|x| (-r..=r).flat_map(move |y| (-r..=r).map(move |z| [x, y, z]))) {
                let length_m = f64::from(d.iter().map(|k| k * k).sum::<i32>()).sqrt() * resolution_m;
                if length_m <= radius_m * (1.0 + 1e-9) {
                    inflated.insert(std::array::from_fn(|k| voxel[k] + d[k]));
                }
            }
        }
        inflated
    }

    /// Expected states of a view.
    pub fn states(&self) -> BTreeMap<VoxelIndex, LocalState> {
        let inflated = self.inflated().into_iter().map(|voxel| (voxel, LocalState::Inflated));
        let occupied = self.occupied().into_iter().map(|voxel| (voxel, LocalState::Occupied));
        inflated.chain(occupied).collect()
    }
}

/// States of a view.
pub fn states_of(view: &LocalView) -> BTreeMap<VoxelIndex, LocalState> {
    let mut states = BTreeMap::new();
    view.for_each(|voxel, state| assert_eq!(states.insert(voxel, state), None, "{voxel:?} occurs twice"));
    states
}

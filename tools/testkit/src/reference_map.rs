use crate::attributed_scan::AttributedScan;
use crate::reference_clearing::ScanMarks;
use crate::reference_layers::{LayerSums, PointSample, add_hit};
use std::collections::BTreeMap;
use voxtile::mapper::MapView;
use voxtile::scan::{PointAttributes, PointBatch, Scan};
use voxtile::sensor::Observation::{self, Hit, Miss};
use voxtile::space::{Point, VoxelIndex};
use voxtile::{InsertMode, MapConfig};

/// Log-odds bits and observation count of every observed voxel.
pub type Voxels = BTreeMap<VoxelIndex, (u64, i32)>;

/// A naive mapper for comparisons: a `BTreeMap`, updated step by step.
pub struct ReferenceMap {
    pub config: MapConfig,
    pub voxels: Voxels,
    pub layers: LayerSums,
    /// The voxel of every update so far, in order.
    pub updated: Vec<VoxelIndex>,
}

impl ReferenceMap {
    pub fn new(config: &MapConfig) -> Self {
        Self { config: config.clone(), voxels: Voxels::new(), layers: LayerSums::new(), updated: Vec::new() }
    }

    pub fn insert_scan(&mut self, scan: &Scan) {
        self.insert_marked(scan, &[]);
    }

    pub fn insert_marked(&mut self, scan: &Scan, is_moving: &[bool]) {
        self.insert(scan, is_moving, &PointAttributes::default(), None);
    }

    pub fn insert_attributed(&mut self, AttributedScan { scan, attributes, stamp_ns }: &AttributedScan) {
        self.insert(scan, &[], attributes, *stamp_ns);
    }

    /// Inserts a scan of which some points are marked as moving; no mark means that the point did not move.
    pub fn insert(
        &mut self,
        scan: &Scan,
        is_moving: &[bool],
        attributes: &PointAttributes,
        stamp_ns: Option<i64>,
    ) {
        let mut once: BTreeMap<VoxelIndex, Observation> = BTreeMap::new();
        for (number, &point) in scan.points.iter().enumerate() {
            let intensity = scan.intensities.as_ref().map_or(0.0, |all| all[number]);
            let Some((misses, end)) = self.ray(scan.origin, point, intensity) else { continue };
            let end = end.filter(|_| is_moving.get(number) != Some(&true));
            if end.is_some() {
                let intensity = scan.intensities.as_ref().map(|all| all[number]);
                let (colour, class) = (attributes.all().colour(number), attributes.all().class(number));
                let sample = PointSample { intensity, colour, class, stamp_ns };
                add_hit(&mut self.layers, &self.config, point, sample);
            }
            let misses = misses.into_iter().map(|voxel| (voxel, Miss));
            for (voxel, seen) in misses.chain(end.map(|voxel| (voxel, Hit(intensity)))) {
                if self.config.rays.insert_mode == InsertMode::PerRay {
                    self.update(voxel, seen);
                } else if let (Hit(new), Some(Hit(old))) = (seen, once.get(&voxel)) {
                    once.insert(voxel, Hit(new.max(*old)));
                } else if seen != Miss || !once.contains_key(&voxel) {
                    once.insert(voxel, seen);
                }
            }
        }
        let of = |wanted: fn(&Observation) -> bool| {
            once.iter().filter(|(_, seen)| wanted(seen)).map(|(voxel, _)| *voxel).collect()
        };
        let guard = self.config.rays.clearing().guard();
        let marks = self.config.grid.voxel_of(scan.origin).map(|origin| ScanMarks {
            hit: of(|seen| *seen != Miss),
            missed: of(|seen| *seen == Miss),
            origin,
        });
        for (voxel, seen) in once {
            let is_full = |guard| marks.as_ref().is_some_and(|marks| marks.is_full(voxel, guard));
            let is_weak = seen == Miss && guard.is_some_and(|guard| !is_full(guard));
            if !(is_weak && self.voxels.contains_key(&voxel)) {
                self.update(voxel, seen);
            }
        }
    }

    pub fn batch_update(&mut self, batch: &PointBatch<'_>) {
        for (number, &point) in batch.points.iter().enumerate() {
            let intensity = batch.intensities.map_or(0.0, |all| all[number]);
            let seen = if batch.is_occupied[number] { Hit(intensity) } else { Miss };
            let model = &self.config.sensor_model;
            let counts = !(model.needs_intensity() && intensity.is_nan()) && model.is_evidence(seen);
            if let Some(voxel) = self.config.grid.voxel_of(point).filter(|_| counts) {
                self.update(voxel, seen);
                if seen != Miss {
                    let intensity = batch.intensities.map(|all| all[number]);
                    let sample = PointSample { intensity, ..PointSample::default() };
                    add_hit(&mut self.layers, &self.config, point, sample);
                }
            }
        }
    }

    fn update(&mut self, voxel: VoxelIndex, seen: Observation) {
        let before = self.voxels.get(&voxel).map(|&(bits, observation_count)| voxtile::sensor::Evidence {
            log_odds: f64::from_bits(bits),
            observation_count,
        });
        let after = self.config.sensor_model.update(before, seen);
        self.voxels.insert(voxel, (after.log_odds.to_bits(), after.observation_count));
        self.updated.push(voxel);
    }

    /// The voxels that a ray passes, and the one that it hits.
    fn ray(
        &self,
        origin: Point,
        point: Point,
        intensity: f32,
    ) -> Option<(Vec<VoxelIndex>, Option<VoxelIndex>)> {
        let (rays, model) = (&self.config.rays, &self.config.sensor_model);
        if point.iter().any(|x| !x.is_finite())
            || point == origin
            || (model.needs_intensity() && intensity.is_nan())
        {
            return None;
        }
        let d: Point = std::array::from_fn(|k| point[k] - origin[k]);
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        if length < rays.min_range_m {
            return None;
        }
        let max = rays.max_range_m.unwrap_or(f64::INFINITY);
        let is_hit = length <= max;
        let end = if is_hit { point } else { std::array::from_fn(|k| origin[k] + d[k] * (max / length)) };
        let grid = &self.config.grid;
        let (mut voxel, last) = (grid.voxel_of(origin)?, grid.voxel_of(end)?);
        let (o, e) = (grid.to_voxel_units(origin), grid.to_voxel_units(end));
        let steps: u64 = (0..3).map(|k| u64::from(voxel[k].abs_diff(last[k]))).sum();
        if steps > 1_000_000 {
            return None;
        }
        let mut passed = Vec::new();
        while voxel != last {
            passed.push(voxel);
            let mut next = (f64::INFINITY, 0);
            for k in (0..3).rev().filter(|&k| voxel[k] != last[k]) {
                let boundary = f64::from(voxel[k]) + if last[k] > voxel[k] { 1.0 } else { 0.0 };
                let time = (boundary - o[k]) * (1.0 / (e[k] - o[k])).clamp(-f64::MAX, f64::MAX);
                next = if time <= next.0 { (time, k) } else { next };
            }
            voxel[next.1] += (last[next.1] - voxel[next.1]).signum();
        }
        Some((passed, (is_hit && model.is_evidence(Hit(intensity))).then_some(last)))
    }
}

/// All voxels of a map.
pub fn voxels_of(view: &impl MapView) -> Voxels {
    let mut voxels = Voxels::new();
    for tile in view.tiles() {
        for voxel in tile.expect("a readable tile").voxels() {
            let evidence = (voxel.evidence.log_odds.to_bits(), voxel.evidence.observation_count);
            assert_eq!(voxels.insert(voxel.index, evidence), None, "{:?} occurs twice", voxel.index);
        }
    }
    voxels
}

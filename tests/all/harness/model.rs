use super::acts::{Act, is_removed};
use super::map::{at, name};
use super::scans::{Taken, new_marks, new_poses};
use std::collections::BTreeMap;
use std::mem::take;
use testkit::faulty_disk::FaultyDisk;
use testkit::reference_layers::{LayerSums, layers_of};
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use voxtile::operations::snapshots;
use voxtile::scan::{PointFrame, ScanPoints};
use voxtile::{Error, MapConfig, MapReader, MapView, PointAttributes, VoxelIndex};

/// Content of a naive map.
#[derive(Clone, Debug, Default)]
pub struct Content {
    /// Kept scans by number.
    pub scans: BTreeMap<u64, Taken>,
    /// Number of the last scan.
    pub scan_number: u64,
    pub voxels: Voxels,
    pub layers: LayerSums,
}

impl Content {
    /// Whether a map has exactly this content.
    pub fn is_of(&self, reader: &MapReader) -> bool {
        let is_kept = || !reader.keeps_scans() || kept_scans(reader) == self.scans;
        reader.scan_number() == self.scan_number && is_kept() && self.has_voxels_of(reader)
    }

    fn has_voxels_of(&self, reader: &MapReader) -> bool {
        voxels_of(reader) == self.voxels && layers_of(reader) == self.layers
    }

    fn retain(&mut self, keeps: impl Fn(VoxelIndex) -> bool) {
        self.voxels.retain(|&voxel, _| keeps(voxel));
        self.layers.retain(|&voxel, _| keeps(voxel));
    }

    /// Adds these scans to the voxels.
    fn insert<'a>(&mut self, config: &MapConfig, scans: impl IntoIterator<Item = &'a Taken>) {
        let mut map = ReferenceMap::new(config);
        (map.voxels, map.layers) = (take(&mut self.voxels), take(&mut self.layers));
        for scan in scans {
            map.insert(&scan.in_world(), &scan.is_moving, &scan.attributes, scan.stamp_ns);
        }
        (self.voxels, self.layers) = (map.voxels, map.layers);
    }

    /// Maps the kept scans again.
    fn replay(&mut self, config: &MapConfig) {
        let mut empty = Self::default();
        empty.insert(config, self.scans.values());
        (self.voxels, self.layers) = (empty.voxels, empty.layers);
    }
}

fn kept_scans(reader: &MapReader) -> BTreeMap<u64, Taken> {
    let kept = reader.kept_scans().unwrap().map(|scan| {
        let scan = scan.unwrap();
        let (mut points, mut intensities, mut attributes) =
            (Vec::new(), Vec::new(), PointAttributes::default());
        let (range, frame) = (0..scan.len(), PointFrame::Raw);
        scan.for_each_attributed_chunk(range, frame, &mut |some, of_some, attributes_of_some| {
            points.extend_from_slice(some);
            intensities.extend_from_slice(of_some.unwrap());
            attributes.extend(attributes_of_some);
            true
        })
        .unwrap();
        let is_moving = scan.moving().map_or(vec![false; points.len()], |marks| marks.iter().collect());
        let (stamp_ns, pose) = (scan.stamp_ns(), scan.world_from_sensor().unwrap());
        let sweep = scan.record().sweep.clone();
        (scan.number(), Taken { points, intensities, attributes, stamp_ns, is_moving, pose, sweep })
    });
    kept.collect()
}

/// A naive map and copies of it as snapshots.
#[derive(Clone, Debug, Default)]
pub struct State {
    pub now: Content,
    pub snapshots: BTreeMap<&'static str, Content>,
}

impl State {
    /// Returns the state after an act.
    pub fn after(&self, act: &Act, config: &MapConfig) -> Self {
        let Self { mut now, mut snapshots } = self.clone();
        match act {
            Act::Scans(seeds) => {
                let scans: Vec<Taken> = seeds.clone().map(Taken::new).collect();
                now.insert(config, &scans);
                for scan in scans {
                    now.scan_number += 1;
                    if config.keeps_scans {
                        now.scans.insert(now.scan_number, scan);
                    }
                }
            }
            Act::Move { seed, rest } => {
                for (number, pose) in new_poses(&now.scans, *seed, *rest) {
                    now.scans.get_mut(&number).unwrap().move_to(pose);
                }
                now.replay(config);
            }
            Act::MoveOnline { seed, rest, meanwhile } => {
                let moved = self.after(&Act::Move { seed: *seed, rest: *rest }, config);
                return moved.after(&Act::Scans(meanwhile.clone()), config);
            }
            Act::Mark { seed, rest } => {
                for (number, is_moving) in new_marks(&now.scans, *seed, *rest) {
                    now.scans.get_mut(&number).unwrap().is_moving = is_moving;
                }
                now.replay(config);
            }
            Act::RemoveScans(first, last) => {
                now.scans.retain(|number, _| !(first..=last).contains(&number));
                now.replay(config);
            }
            Act::RemovePoints(region) => {
                now.scans.values_mut().for_each(|scan| scan.remove_points(region));
                now.replay(config);
            }
            Act::RemoveTiles(one_in) => {
                now.retain(|voxel| !is_removed(*one_in, config.grid.tile_of_voxel(voxel)));
            }
            Act::Clear(region) => now.retain(|voxel| {
                let center = config.grid.center_m(voxel);
                !(0..3).all(|k| region.min[k] <= center[k] && center[k] < region.max[k])
            }),
            Act::Snapshot(of) => drop(snapshots.insert(*of, now.clone())),
            Act::Delete(of) => assert!(snapshots.remove(of).is_some()),
            Act::Revert(to) => now = snapshots[to].clone(),
        }
        Self { now, snapshots }
    }

    /// Whether the map on a disk is in this state, including all snapshots. A missing map equals one without scans.
    pub fn is_on(&self, disk: &FaultyDisk) -> bool {
        let reader = match MapReader::open(at(disk), 0) {
            Err(Error::NoMap { .. }) => return self.now.scan_number == 0,
            opened => opened.unwrap(),
        };
        let mut names: Vec<_> = snapshots(at(disk)).unwrap().into_iter().map(|info| info.name).collect();
        names.sort_unstable();
        let open = |of: &str| MapReader::open_snapshot(at(disk), &name(of), 0).unwrap();
        self.now.is_of(&reader)
            && names.iter().eq(self.snapshots.keys())
            && self.snapshots.iter().all(|(of, content)| content.is_of(&open(of)))
    }
}

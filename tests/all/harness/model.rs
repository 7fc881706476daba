use super::acts::{Act, is_removed};
use super::map::{at, name};
use super::scans::{Taken, new_marks, new_poses};
use std::collections::BTreeMap;
use testkit::faulty_disk::FaultyDisk;
use testkit::reference_map::{ReferenceMap, Voxels, voxels_of};
use voxtile::operations::snapshots;
use voxtile::scan::ScanPoints;
use voxtile::{Error, MapConfig, MapReader, MapView};

/// Content of a naive map.
#[derive(Clone, Debug, Default)]
pub struct Content {
    /// Kept scans by number.
    pub scans: BTreeMap<u64, Taken>,
    /// Number of the last scan.
    pub scan_number: u64,
    pub voxels: Voxels,
}

impl Content {
    /// Whether a map has exactly this content.
    pub fn is_of(&self, reader: &MapReader) -> bool {
        let is_kept = || !reader.keeps_scans() || kept_scans(reader) == self.scans;
        reader.scan_number() == self.scan_number && is_kept() && voxels_of(reader) == self.voxels
    }
}

fn kept_scans(reader: &MapReader) -> BTreeMap<u64, Taken> {
    let kept = reader.kept_scans().unwrap().map(|scan| {
        let scan = scan.unwrap();
        let (mut points, mut intensities) = (Vec::new(), Vec::new());
        scan.for_each_own_chunk(0..scan.len(), &mut |some, of_some| {
            points.extend_from_slice(some);
            intensities.extend_from_slice(of_some.unwrap());
            true
        })
        .unwrap();
        let is_moving = scan.moving().map_or(vec![false; points.len()], |marks| marks.iter().collect());
        (scan.number(), Taken { points, intensities, is_moving, pose: scan.world_from_sensor().unwrap() })
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
                now.voxels = with_scans(config, now.voxels, &scans);
                for scan in scans {
                    now.scan_number += 1;
                    if config.keeps_scans {
                        now.scans.insert(now.scan_number, scan);
                    }
                }
            }
            Act::Move { seed, rest } => {
                for (number, pose) in new_poses(&now.scans, *seed, *rest) {
                    now.scans.get_mut(&number).unwrap().pose = pose;
                }
                now.voxels = with_scans(config, Voxels::new(), now.scans.values());
            }
            Act::MoveOnline { seed, rest, meanwhile } => {
                let moved = self.after(&Act::Move { seed: *seed, rest: *rest }, config);
                return moved.after(&Act::Scans(meanwhile.clone()), config);
            }
            Act::Mark { seed, rest } => {
                for (number, is_moving) in new_marks(&now.scans, *seed, *rest) {
                    now.scans.get_mut(&number).unwrap().is_moving = is_moving;
                }
                now.voxels = with_scans(config, Voxels::new(), now.scans.values());
            }
            Act::RemoveScans(first, last) => {
                now.scans.retain(|number, _| !(first..=last).contains(&number));
                now.voxels = with_scans(config, Voxels::new(), now.scans.values());
            }
            Act::RemovePoints(region) => {
                for scan in now.scans.values_mut() {
                    let world = scan.in_world();
                    let is_inside = |point: [f64; 3]| {
                        (0..3).all(|k| region.min[k] <= point[k] && point[k] < region.max[k])
                    };
                    let kept: Vec<_> =
                        (0..world.points.len()).filter(|&k| !is_inside(world.points[k])).collect();
                    scan.points = kept.iter().map(|&k| scan.points[k]).collect();
                    scan.intensities = kept.iter().map(|&k| scan.intensities[k]).collect();
                    scan.is_moving = kept.iter().map(|&k| scan.is_moving[k]).collect();
                }
                now.voxels = with_scans(config, Voxels::new(), now.scans.values());
            }
            Act::RemoveTiles(one_in) => {
                now.voxels.retain(|&voxel, _| !is_removed(*one_in, config.grid.tile_of_voxel(voxel)));
            }
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

/// Returns the voxels after these scans.
fn with_scans<'a>(config: &MapConfig, before: Voxels, scans: impl IntoIterator<Item = &'a Taken>) -> Voxels {
    let mut map = ReferenceMap::new(config);
    map.voxels = before;
    scans.into_iter().for_each(|scan| map.insert_marked(&scan.in_world(), &scan.is_moving));
    map.voxels
}

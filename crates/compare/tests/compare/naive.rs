//! The definitions, voxel by voxel.

use std::collections::{BTreeMap, BTreeSet};
use voxtile::mapper::MapView;
use voxtile::{Aabb, Point, Queries, UnknownAs, VoxelIndex};
use voxtile_compare::VoxelClass;

/// Observed voxels with their log-odds.
pub type Voxels = BTreeMap<VoxelIndex, f64>;

pub fn voxels_of(map: &impl MapView) -> Voxels {
    let mut voxels = Voxels::new();
    for tile in map.tiles() {
        voxels.extend(tile.unwrap().voxels().map(|voxel| (voxel.index, voxel.evidence.log_odds)));
    }
    voxels
}

pub fn around([x, y, z]: VoxelIndex, reach: i32) -> impl Iterator<Item = VoxelIndex> {
    let edge = 2 * reach + 1;
    (0..edge.pow(3))
        .map(move |k| [x + k % edge - reach, y + k / edge % edge - reach, z + k / edge / edge - reach])
}

/// The voxels that share a face with a voxel.
pub fn neighbors(voxel: VoxelIndex) -> [VoxelIndex; 6] {
    std::array::from_fn(|k| {
        let mut near = voxel;
        near[k / 2] += if k % 2 == 0 { 1 } else { -1 };
        near
    })
}

/// Positions of a sensor, and its range in metres.
pub type Positions = (Vec<Point>, f64);

/// Of the positions in each cube of a twentieth of the range, the lowest.
pub fn thinned((positions, range_m): Positions) -> Positions {
    let mut kept = BTreeMap::<[i64; 3], Point>::new();
    for position in positions {
        let own = kept.entry(position.map(|k| (k / (range_m / 20.0)).floor() as i64)).or_insert(position);
        if position < *own {
            *own = position;
        }
    }
    (kept.into_values().collect(), range_m)
}

/// Whether from each of the 16 nearest positions in range something is in front of a voxel of a map.
pub fn is_hidden(map: &impl MapView, (positions, range_m): &Positions, voxel: VoxelIndex) -> bool {
    let grid = map.config().grid;
    let center_m = grid.center_m(voxel);
    let distance_m =
        |position: &Point| (0..3).map(|k| (position[k] - center_m[k]).powi(2)).sum::<f64>().sqrt();
    let mut near: Vec<&Point> =
        positions.iter().filter(|position| distance_m(position) <= *range_m).collect();
    near.sort_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
    near.truncate(16);
    let is_blocked = |position: &&Point| {
        let hit = map.cast_segment(center_m, **position, UnknownAs::Free).unwrap();
        hit.is_some_and(|hit| Some(hit.voxel) != grid.voxel_of(**position))
    };
    !near.is_empty() && near.iter().all(is_blocked)
}

/// Classes of the occupied voxels of `own`; `names` are those of a change, not seen, uncertain.
pub fn classes(
    own: &Voxels,
    other: &Voxels,
    tolerance: i32,
    certain: f64,
    is_inside: &dyn Fn(VoxelIndex) -> bool,
    names: [VoxelClass; 3],
) -> BTreeMap<VoxelIndex, VoxelClass> {
    let occupied = own.iter().filter(|(voxel, log_odds)| **log_odds >= 0.0 && is_inside(**voxel));
    let is_surrounded = |voxel: VoxelIndex| neighbors(voxel).iter().all(|near| other.contains_key(near));
    let class_of = |(voxel, log_odds): (&VoxelIndex, &f64)| {
        let is_near = |near: VoxelIndex| other.get(&near).is_some_and(|log_odds| *log_odds >= 0.0);
        let class = if around(*voxel, tolerance).any(is_near) {
            VoxelClass::Unchanged
        } else {
            match other.get(voxel) {
                None => names[1],
                Some(free) if *log_odds >= certain && *free <= -certain && is_surrounded(*voxel) => names[0],
                Some(_) => names[2],
            }
        };
        (*voxel, class)
    };
    occupied.map(class_of).collect()
}

/// Connected voxels, the largest first, then the one with the lowest voxel by z, y, x.
pub fn clusters(voxels: impl Iterator<Item = VoxelIndex>) -> Vec<BTreeSet<VoxelIndex>> {
    let mut rest: BTreeSet<VoxelIndex> = voxels.collect();
    let mut clusters = Vec::new();
    while let Some(first) = rest.pop_first() {
        let (mut cluster, mut open) = (BTreeSet::from([first]), vec![first]);
        while let Some(voxel) = open.pop() {
            for near in around(voxel, 1) {
                if rest.remove(&near) {
                    cluster.insert(near);
                    open.push(near);
                }
            }
        }
        clusters.push(cluster);
    }
    clusters.sort_by_key(|cluster| {
        let lowest = cluster.iter().map(|[x, y, z]| [*z, *y, *x]).min();
        (std::cmp::Reverse(cluster.len()), lowest)
    });
    clusters
}

/// Box of voxels of 0.1 m in metres.
pub fn bounds_m(cluster: &BTreeSet<VoxelIndex>) -> Aabb {
    let along = |k: usize| cluster.iter().map(move |voxel| voxel[k]);
    let metres = |k: i32| f64::from(k) * 0.1;
    Aabb {
        min: std::array::from_fn(|k| metres(along(k).min().unwrap())),
        max: std::array::from_fn(|k| metres(along(k).max().unwrap() + 1)),
    }
}

pub fn is_same_box(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|k| (a.min[k] - b.min[k]).abs() < 1e-9 && (a.max[k] - b.max[k]).abs() < 1e-9)
}

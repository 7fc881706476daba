//! Finds a path that keeps its distance from obstacles: `cargo run --release --example clearance`.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, Point, VoxelIndex};
use voxtile_distance::{Distance, DistanceField, DistanceOptions, MapDistances, UnknownRule};
use voxtile_simulation::Survey;

/// Returns the cheapest way between two voxels at one height (A*); a step costs more where the distance is less than
/// `wanted_m`, and is impossible below 0.4 m.
fn path(field: &DistanceField, [from, to]: [VoxelIndex; 2], wanted_m: f64) -> Option<Vec<Point>> {
    let straight = |voxel: VoxelIndex| f64::from((voxel[0] - to[0]).abs().max((voxel[1] - to[1]).abs()));
    let (mut open, mut cost, mut before) = (BinaryHeap::new(), HashMap::from([(from, 0.0)]), HashMap::new());
    open.push(Reverse((0, from)));
    while let Some(Reverse((_, voxel))) = open.pop() {
        if voxel == to {
            let way = std::iter::successors(Some(to), |voxel| before.get(voxel).copied());
            return Some(way.map(|voxel| field.grid().center_m(voxel)).collect());
        }
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
            let next = [voxel[0] + dx, voxel[1] + dy, voxel[2]];
            let distance_m = match field.voxel(next).in_metres(field.grid().resolution_m()) {
                Distance::Within(distance_m) if distance_m >= 0.4 => distance_m,
                Distance::Beyond => wanted_m,
                _ => continue,
            };
            let step = f64::from(dx * dx + dy * dy).sqrt() * (1.0 + 5.0 * (wanted_m - distance_m).max(0.0));
            let sum: f64 = cost[&voxel] + step;
            if cost.get(&next).is_none_or(|known| sum < *known) {
                cost.insert(next, sum);
                before.insert(next, voxel);
                open.push(Reverse(((1000.0 * (sum + straight(next))) as u64, next)));
            }
        }
    }
    None
}

fn main() -> voxtile::Result<()> {
    let mut map = InMemoryMapper::new(MapConfig::new(0.2, 10.0)?.with_range(0.5, 60.0))?;
    let scans: Vec<_> = Survey::demo(1).take(60).collect();
    scans.iter().try_for_each(|scan| map.insert_scan(scan).map(drop))?;
    let [start, end] = [scans[0].origin, scans[59].origin];
    let ends = Aabb::from_corners(start, end);
    let region = Aabb { min: ends.min.map(|k| k - 10.0), max: ends.max.map(|k| k + 10.0) };
    let options = DistanceOptions::new(3.0).with_unknown(UnknownRule::Free);
    let field = map.distance_field(&region, options)?;
    let ends =
        [start, end].map(|point| field.grid().voxel_of([point[0], point[1], start[2]]).unwrap_or_default());
    for (name, wanted_m) in [("shortest", 0.0), ("with clearance", 3.0)] {
        let Some(path) = path(&field, ends, wanted_m) else {
            println!("{name}: no path");
            continue;
        };
        let least_m = field.clearance_along(&path, 0.0)?.min_distance_m.unwrap_or(0.0);
        println!("{name}: {} steps, at least {least_m:.1} m from obstacles", path.len());
    }
    Ok(())
}

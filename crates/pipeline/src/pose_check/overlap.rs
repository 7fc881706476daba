use rustc_hash::FxHashMap;
use std::collections::hash_map::Entry;
use std::ops::RangeInclusive;
use voxtile::scan::Pose;
use voxtile::space::Point;

/// Ranges of the points to use, in metres. Closer points are on the vehicle, farther ones are sparse.
pub(super) const RANGE_M: RangeInclusive<f64> = 1.0..=25.0;
/// Scans with fewer voxels are ignored.
const MIN_VOXELS: u32 = 50;
/// Minimum number of values for a median.
const MIN_SHARES: usize = 2;

/// Voxels to count. For very many points, a quarter of the voxels is sufficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Counted {
    All,
    Quarter,
}

/// Points of a scan with their pose in the world.
pub(super) struct Placed<'p> {
    pub(super) points: &'p [[f32; 3]],
    pub(super) world_from_points: Pose,
    /// Position of the sensor in the frame of the points.
    pub(super) sensor: Point,
}

/// Returns the median overlap: the fraction of a scan's voxels that occur in the previous scans. `None` if the scans
/// are too few or too small.
pub(super) fn overlap<'p>(
    scans: impl Iterator<Item = Placed<'p>>,
    voxel_m: f64,
    counted: Counted,
) -> Option<f64> {
    let mut last_seen: FxHashMap<u64, u32> = FxHashMap::default();
    let (mut shares, mut anchor) = (Vec::new(), None);
    for (number, scan) in (1..).zip(scans) {
        let to_world = scan.world_from_points.to_world();
        let anchor = *anchor.get_or_insert_with(|| to_world(scan.sensor));
        let (mut voxels, mut again) = (0_u32, 0_u32);
        for point in scan.points {
            let point = point.map(f64::from);
            let square: f64 = point.iter().zip(scan.sensor).map(|(a, b)| (a - b) * (a - b)).sum();
            if !RANGE_M.contains(&square.sqrt()) {
                continue;
            }
            let key = key(to_world(point), anchor, voxel_m);
            if counted == Counted::Quarter && !is_of_quarter(key) {
                continue;
            }
            match last_seen.entry(key) {
                Entry::Vacant(vacant) => {
                    vacant.insert(number);
                    voxels += 1;
                }
                Entry::Occupied(mut seen) if *seen.get() != number => {
                    seen.insert(number);
                    voxels += 1;
                    again += 1;
                }
                Entry::Occupied(_) => {}
            }
        }
        if number > 1 && voxels >= MIN_VOXELS {
            shares.push(f64::from(again) / f64::from(voxels));
        }
    }
    shares.sort_unstable_by(f64::total_cmp);
    (shares.len() >= MIN_SHARES).then(|| shares[shares.len() / 2])
}

/// Returns the key of a voxel. Keys are unique near the anchor only.
fn key(point: Point, anchor: Point, voxel_m: f64) -> u64 {
    let mut key = 0;
    for (coordinate, origin) in point.into_iter().zip(anchor) {
        let index = ((coordinate - origin) / voxel_m).floor() as i64;
        key = (key << 21) | (index & 0x1f_ffff).unsigned_abs();
    }
    key
}

/// Returns whether a voxel belongs to an evenly distributed quarter of all voxels.
fn is_of_quarter(key: u64) -> bool {
    key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 62 == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_voxels_are_counted_once_per_scan() {
        // A wall of 200 voxels, each hit twice. The second scan is shifted by half the wall.
        let wall: Vec<[f32; 3]> =
            (0..400).map(|k| [5.0, 0.4 * (k / 2 % 20) as f32 - 3.9, 0.4 * (k / 40) as f32 - 1.9]).collect();
        let at = |y_m: f64| Placed {
            points: &wall,
            world_from_points: Pose::from_quaternion([0.0, y_m, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
            sensor: [0.0; 3],
        };
        assert_eq!(overlap([at(0.0), at(4.0), at(8.0)].into_iter(), 0.4, Counted::All), Some(0.5));
        assert_eq!(overlap([at(0.0), at(4.0), at(0.0)].into_iter(), 0.4, Counted::All), Some(1.0));
        assert_eq!(overlap([at(0.0), at(4.0)].into_iter(), 0.4, Counted::All), None);
        let quarter = overlap([at(0.0), at(4.0), at(8.0)].into_iter(), 0.4, Counted::Quarter);
        assert!(quarter.is_none_or(|share| (0.35..0.65).contains(&share)), "{quarter:?}");
        let keys = (0..90_000_u64).map(|k| ((k / 300) << 42) | ((k % 300) << 21) | (k % 7));
        let counted = keys.filter(|key| is_of_quarter(*key)).count();
        assert!((21_000..24_000).contains(&counted), "{counted}");
        let far = Placed { sensor: [100.0, 0.0, 0.0], ..at(0.0) };
        assert_eq!(overlap([far, at(0.0), at(0.0)].into_iter(), 0.4, Counted::All), Some(1.0));
    }
}

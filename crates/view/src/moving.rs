//! Points of kept scans that are marked as moving, as many as a browser can draw.

use super::response::gzip;
use voxtile::mapper::MapReader;
use voxtile::space::Aabb;
use voxtile::store::{KeptFrame, KeptRecord};
use voxtile::{Point, Result};
use voxtile_pipeline::{AnyMap, read_moving_points};

/// Maximum number of points in a response.
const MAX_POINTS: usize = 200_000;
/// Maximum number of points of the scans that are read for a response, which takes some seconds. If more scans
/// have marks, every n-th is read.
const MAX_POINTS_READ: u64 = 1 << 25;

/// Length of the header of a response in bytes.
const HEADER_BYTES: usize = 56;

/// Marks of a state of a map, from the list of its kept scans.
struct Marks {
    keeps_scans: bool,
    /// Number of marked points.
    points: u64,
    /// Number of points of the scans that have marks.
    points_to_read: u64,
    /// Changes with the marks, and with the poses of marked scans.
    version: u64,
}

/// Evenly thinned points: every n-th of the offered ones, at most [`MAX_POINTS`].
struct Thinned {
    step: u64,
    offered: u64,
    /// Origin of the points in metres: the first one. With it, `f32` is fine enough.
    origin_m: Point,
    points: Vec<[f32; 3]>,
}

/// Returns the marked points, compressed with gzip; without points if `known` is the version of the marks.
pub fn moving(map: &AnyMap, known: Option<u64>) -> Result<Vec<u8>> {
    moving_within(map, known, None)
}

/// As [`moving`], for the points in a box, which are counted.
pub fn moving_within(map: &AnyMap, known: Option<u64>, within: Option<&Aabb>) -> Result<Vec<u8>> {
    let (mut marks, mut thinned) = (Marks::none(), Thinned::new());
    if let AnyMap::Map(map) = map
        && map.keeps_scans()
    {
        marks = Marks::of(map)?;
        if known != Some(marks.version) {
            let every = marks.every(MAX_POINTS_READ);
            thinned = read(map, every, within)?;
            if within.is_some() {
                // An estimate, if not all scans are read.
                marks.points = thinned.offered.saturating_mul(every);
            }
        }
    }
    Ok(gzip(&bytes_of(&marks, &thinned)))
}

/// Reads the marked points, of every n-th of the scans that have some.
fn read(map: &MapReader, every: u64, within: Option<&Aabb>) -> Result<Thinned> {
    let mut number = 0;
    let is_wanted = |_: &KeptRecord| {
        number += 1;
        (number - 1) % every == 0
    };
    let mut thinned = Thinned::new();
    let is_within = |point: &&Point| within.is_none_or(|within| within.contains(**point));
    read_moving_points(map, is_wanted, |points| {
        points.iter().filter(is_within).for_each(|&point| thinned.offer(point));
    })?;
    Ok(thinned)
}

/// Encodes a response as `docs/view.md` describes.
fn bytes_of(marks: &Marks, thinned: &Thinned) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + 12 * thinned.points.len());
    bytes.extend(b"VXM1");
    bytes.extend((thinned.points.len() as u32).to_le_bytes());
    bytes.extend(marks.points.to_le_bytes());
    bytes.extend(marks.version.to_le_bytes());
    bytes.extend(thinned.origin_m.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(u32::from(marks.keeps_scans).to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(thinned.points.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

impl Marks {
    fn none() -> Self {
        Self { keeps_scans: false, points: 0, points_to_read: 0, version: 0 }
    }

    /// Returns *n* such that every *n*th scan with marks has about `max_points` points in all.
    fn every(&self, max_points: u64) -> u64 {
        self.points_to_read.div_ceil(max_points).max(1)
    }

    fn of(map: &MapReader) -> Result<Self> {
        let (mut marks, mut hash) = (Self { keeps_scans: true, ..Self::none() }, blake3::Hasher::new());
        let mut scans = map.kept_scans()?;
        while let Some(record) = scans.next_record()? {
            let Some(moving) = record.moving else { continue };
            marks.points = marks.points.saturating_add(moving.marked);
            marks.points_to_read = marks.points_to_read.saturating_add(record.points);
            let Some(place) = moving.place else { continue };
            for number in [record.number, moving.marked, place.segment, place.offset, place.bytes] {
                hash.update(&number.to_le_bytes());
            }
            let pose: &[f64] = match &record.frame {
                KeptFrame::Sensor(pose) => pose,
                KeptFrame::World(_) => &[],
            };
            pose.iter().for_each(|number| {
                hash.update(&number.to_le_bytes());
            });
        }
        let first = hash.finalize().as_bytes().first_chunk().copied();
        marks.version = first.map_or(0, u64::from_le_bytes);
        Ok(marks)
    }
}

impl Thinned {
    fn new() -> Self {
        Self { step: 1, offered: 0, origin_m: [0.0; 3], points: Vec::new() }
    }

    fn offer(&mut self, point: Point) {
        if self.points.len() == MAX_POINTS && self.offered.is_multiple_of(self.step) {
            let mut number = 0;
            self.points.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.step *= 2;
        }
        if self.offered == 0 {
            self.origin_m = point;
        }
        if self.offered.is_multiple_of(self.step) {
            self.points.push(std::array::from_fn(|k| (point[k] - self.origin_m[k]) as f32));
        }
        self.offered += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use voxtile::mapper::OutOfCoreTileMapper;
    use voxtile::operations::{Replay, mark_moving};
    use voxtile::scan::MovingMarks;
    use voxtile::{MapConfig, Mapper, Scan};

    #[test]
    fn of_too_many_points_every_second_scan_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map");
        let config = MapConfig::new(0.1, 10.0).unwrap().with_kept_scans(true);
        let mut map = OutOfCoreTileMapper::create(&path, config).unwrap();
        for scan in 0..10 {
            let points = (0..10).map(|point| [5.0, f64::from(scan), f64::from(point)]).collect();
            map.insert_scan(&Scan { points, ..Scan::default() }).unwrap();
        }
        map.flush().unwrap();
        drop(map);
        let open = || MapReader::open(&path, 1 << 20).unwrap();
        let before = Marks::of(&open()).unwrap();
        assert!(before.keeps_scans && (before.points, before.points_to_read) == (0, 0));
        // The last three points of the scans with an odd number.
        let marks = |_| Ok(MovingMarks::new((0..10).map(|point| point > 6)));
        let summary = open().kept_summary().unwrap();
        mark_moving(&summary, [1, 3, 5, 7, 9], marks, &Replay::default(), |_, _| ()).unwrap();
        let map = open();
        let marks = Marks::of(&map).unwrap();
        assert_eq!((marks.points, marks.points_to_read), (15, 50));
        assert_ne!(marks.version, before.version);
        let all = read(&map, marks.every(50), None).unwrap();
        let rows = |thinned: &Thinned| thinned.points.iter().map(|[_, y, _]| *y).collect::<Vec<f32>>();
        assert_eq!(rows(&all), [0.0, 2.0, 4.0, 6.0, 8.0].map(|y| [y; 3]).concat());
        assert_eq!(all.origin_m, [5.0, 0.0, 7.0]);
        let half = read(&map, marks.every(49), None).unwrap();
        assert_eq!(rows(&half), [0.0, 4.0, 8.0].map(|y| [y; 3]).concat());
        // Those in a box are counted.
        let within = Aabb { min: [0.0; 3], max: [9.0, 3.0, 8.5] };
        let bytes = moving_within(&AnyMap::Map(Box::new(map)), None, Some(&within)).unwrap();
        let mut plain = Vec::new();
        flate2::read::GzDecoder::new(&bytes[..]).read_to_end(&mut plain).unwrap();
        assert_eq!([4, 8].map(|at| plain[at]), [4; 2], "two points of each of the first two scans");
    }

    #[test]
    fn points_are_thinned_evenly() {
        for count in [0, 1, MAX_POINTS as u64, MAX_POINTS as u64 + 1, 5 * MAX_POINTS as u64 + 3] {
            let mut thinned = Thinned::new();
            // Far from the origin of the world, where `f32` is too coarse.
            (0..count).for_each(|x| thinned.offer([4e6 + x as f64, 0.0, 0.0]));
            let wanted = (0..count).step_by(thinned.step as usize).map(|x| [x as f32, 0.0, 0.0]);
            assert_eq!(thinned.points, wanted.collect::<Vec<_>>(), "{count}");
            assert!(thinned.points.len() <= MAX_POINTS);
            assert!(thinned.points.len() as u64 * 2 >= count.min(MAX_POINTS as u64), "{count}");
        }
    }
}

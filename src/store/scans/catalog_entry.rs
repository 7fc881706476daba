use super::scan_record::ScanRecord;
use crate::config::RayConfig;
use crate::sensor::Sweep;
use crate::space::{Point, TileIndex, put_number};
use std::sync::Arc;

/// Location of the points of a kept scan in a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SegmentPlace {
    /// Number of the segment.
    pub segment: u64,
    /// Offset of the scan in bytes.
    pub offset: u64,
    /// Length of the scan in bytes.
    pub bytes: u64,
}

/// Frame of the points of a kept scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeptFrame {
    /// The sensor's frame, with its pose in the world: position in metres and quaternion x, y, z, w.
    Sensor([f64; 7]),
    /// The world frame, with the position of the sensor in metres.
    World(Point),
}

/// Location of the marks of the points of a kept scan that hit something that was moving.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptMarks {
    /// Number of marked points, at least 1.
    pub marked: u64,
    /// Location of the marks; `None` if `repair` found them damaged, so that it is unknown which points are marked.
    pub place: Option<SegmentPlace>,
}

/// Record of a kept scan.
#[derive(Clone, Debug, PartialEq)]
pub struct KeptRecord {
    /// Number of the scan in the map, from 1.
    pub number: u64,
    /// Time of the scan in nanoseconds since the epoch of its source, if known.
    pub stamp_ns: Option<i64>,
    /// Frame of the points.
    pub frame: KeptFrame,
    /// Ray settings.
    pub rays: RayConfig,
    /// Number of points.
    pub points: u64,
    /// Whether the points have intensities.
    pub has_intensities: bool,
    /// Whether the points have colours.
    pub has_colours: bool,
    /// Whether the points have classes.
    pub has_classes: bool,
    /// Number of voxel updates when the scan was mapped. A voxel may be counted repeatedly.
    pub updates: u64,
    /// Location of the points.
    pub place: SegmentPlace,
    /// Marks of moving points, if there are any.
    pub moving: Option<KeptMarks>,
    /// Motion of the sensor during the scan. Its points have times then, and are as measured.
    pub sweep: Option<Arc<Sweep>>,
    /// Pose of the sensor in the body frame that the trajectory describes, if known: position in metres and quaternion x,
    /// y, z, w.
    pub body_from_sensor: Option<[f64; 7]>,
    /// Tiles that the scan changes, in order.
    pub tiles: Vec<TileIndex>,
}

/// Entry of the catalog.
#[derive(Clone, Debug, PartialEq)]
pub enum CatalogEntry {
    /// A scan whose points are kept.
    Kept(Box<KeptRecord>),
    /// A scan whose points are not kept.
    Listed(ScanRecord),
    /// First and last number of scans without a record, such as those of a batch.
    Unlisted(u64, u64),
    /// First and last number of removed scans.
    Removed(u64, u64),
    /// A change of the map by an operation such as `clear`.
    Operation(String),
}

const KEPT: u8 = 1;
const LISTED: u8 = 2;
const UNLISTED: u8 = 3;
const REMOVED: u8 = 4;
const OPERATION: u8 = 5;

const IS_IN_WORLD: u8 = 1;
const HAS_INTENSITIES: u8 = 2;
const HAS_MOVING: u8 = 8;
const HAS_COLOURS: u8 = 16;
const HAS_CLASSES: u8 = 32;
const HAS_SWEEP: u8 = 64;
const HAS_MOUNT: u8 = 128;
const HAS_STAMP: u8 = 4;

impl KeptRecord {
    /// Position of the sensor in the world frame, in metres.
    pub fn origin_m(&self) -> Point {
        match self.frame {
            KeptFrame::Sensor([x, y, z, ..]) | KeptFrame::World([x, y, z]) => [x, y, z],
        }
    }

    /// Returns whether programs before version 1.3 of the format misread the record.
    pub(super) fn has_motion(&self) -> bool {
        self.sweep.is_some() || self.body_from_sensor.is_some()
    }

    /// Returns whether the scan has marks of moving points that are lost to damage.
    pub fn has_lost_marks(&self) -> bool {
        self.moving.is_some_and(|marks| marks.place.is_none())
    }

    /// Returns the mutable locations of the points and of the marks.
    pub(crate) fn places_mut(&mut self) -> impl Iterator<Item = &mut SegmentPlace> {
        std::iter::once(&mut self.place).chain(self.moving.as_mut().and_then(|marks| marks.place.as_mut()))
    }

    /// Returns the locations of all that is kept of the scan: its points, and its marks if there are any.
    pub fn places(&self) -> impl Iterator<Item = SegmentPlace> + use<> {
        std::iter::once(self.place).chain(self.moving.and_then(|marks| marks.place))
    }
}

impl CatalogEntry {
    /// Returns the first and last scan number of the entry; `None` for an operation.
    pub fn numbers(&self) -> Option<(u64, u64)> {
        match self {
            Self::Kept(scan) => Some((scan.number, scan.number)),
            Self::Listed(scan) => Some((scan.number, scan.number)),
            Self::Unlisted(first, last) | Self::Removed(first, last) => Some((*first, *last)),
            Self::Operation(_) => None,
        }
    }

    /// The entry with numbers after this one, which was 0 before.
    #[must_use]
    pub(crate) fn after(mut self, number: u64) -> Self {
        match &mut self {
            Self::Kept(scan) => scan.number += number,
            Self::Listed(scan) => scan.number += number,
            Self::Unlisted(first, last) | Self::Removed(first, last) => {
                *first += number;
                *last += number;
            }
            Self::Operation(_) => {}
        }
        self
    }

    /// Approximate heap memory in bytes.
    pub(super) fn heap_bytes(&self) -> usize {
        match self {
            Self::Kept(scan) => {
                let of_sweep = scan.sweep.as_ref().map_or(0, |sweep| sweep.heap_bytes());
                size_of::<KeptRecord>() + scan.tiles.capacity() * size_of::<TileIndex>() + of_sweep
            }
            Self::Operation(what) => what.capacity(),
            _ => 0,
        }
    }

    /// Appends the payload of the record with the number of its flush.
    pub(super) fn write(&self, flush_number: u64, out: &mut Vec<u8>) {
        out.extend(flush_number.to_le_bytes());
        match self {
            Self::Kept(scan) => write_kept(scan, out),
            Self::Listed(scan) => {
                out.push(LISTED);
                out.extend(scan.number.to_le_bytes());
                write_stamp(scan.stamp_ns, out);
                scan.origin_m.iter().for_each(|x| out.extend(x.to_le_bytes()));
            }
            Self::Unlisted(first, last) | Self::Removed(first, last) => {
                out.push(if matches!(self, Self::Removed(..)) { REMOVED } else { UNLISTED });
                [first, last].iter().for_each(|number| out.extend(number.to_le_bytes()));
            }
            Self::Operation(what) => {
                out.push(OPERATION);
                out.extend(what.as_bytes());
            }
        }
    }

    /// Parses the payload of a record into its flush and entry; `None` if it is invalid.
    pub(super) fn read(payload: &[u8]) -> Option<(u64, Self)> {
        let mut input = Input(payload);
        let flush_number = input.number()?;
        let entry = match input.byte()? {
            KEPT => Self::Kept(Box::new(read_kept(&mut input)?)),
            LISTED => {
                let (number, stamp_ns) = (input.number()?, input.stamp()?);
                Self::Listed(ScanRecord::new(number, stamp_ns, input.doubles()?))
            }
            UNLISTED => Self::Unlisted(input.number()?, input.number()?),
            REMOVED => Self::Removed(input.number()?, input.number()?),
            OPERATION => Self::Operation(String::from_utf8(std::mem::take(&mut input.0).to_vec()).ok()?),
            _ => return None,
        };
        input.0.is_empty().then_some((flush_number, entry))
    }
}

fn write_kept(scan: &KeptRecord, out: &mut Vec<u8>) {
    let is_in_world = matches!(scan.frame, KeptFrame::World(_));
    out.push(KEPT);
    out.extend(scan.number.to_le_bytes());
    write_stamp(scan.stamp_ns, out);
    let flags = [
        (is_in_world, IS_IN_WORLD),
        (scan.has_intensities, HAS_INTENSITIES),
        (scan.has_colours, HAS_COLOURS),
        (scan.has_classes, HAS_CLASSES),
        (scan.moving.is_some(), HAS_MOVING),
        (scan.sweep.is_some(), HAS_SWEEP),
        (scan.body_from_sensor.is_some(), HAS_MOUNT),
    ];
    out.push(flags.iter().map(|(is_set, flag)| if *is_set { *flag } else { 0 }).sum());
    match &scan.frame {
        KeptFrame::Sensor(pose) => pose.iter().for_each(|x| out.extend(x.to_le_bytes())),
        KeptFrame::World(origin) => origin.iter().for_each(|x| out.extend(x.to_le_bytes())),
    }
    let SegmentPlace { segment, offset, bytes } = scan.place;
    [scan.points, scan.updates, segment, offset, bytes].iter().for_each(|n| out.extend(n.to_le_bytes()));
    if let Some(KeptMarks { marked, place }) = scan.moving {
        // Marks have at least one byte, so an empty place means that they are lost.
        let SegmentPlace { segment, offset, bytes } = place.unwrap_or_default();
        [marked, segment, offset, bytes].iter().for_each(|n| out.extend(n.to_le_bytes()));
    }
    if let Some(sweep) = &scan.sweep {
        sweep.write(out);
    }
    scan.body_from_sensor.iter().flatten().for_each(|x| out.extend(x.to_le_bytes()));
    let rays = serde_json::to_string(&scan.rays).unwrap_or_default();
    put_number(rays.len() as u64, out);
    out.extend(rays.as_bytes());
    put_number(scan.tiles.len() as u64, out);
    let mut before = [0_i32; 3];
    for tile in &scan.tiles {
        let tile = tile.to_array();
        for axis in 0..3 {
            put_number(i64::from(tile[axis]) - i64::from(before[axis]), out);
        }
        before = tile;
    }
}

fn read_kept(input: &mut Input<'_>) -> Option<KeptRecord> {
    let (number, stamp_ns, flags) = (input.number()?, input.stamp()?, input.byte()?);
    let frame = match flags & IS_IN_WORLD {
        0 => KeptFrame::Sensor(input.doubles()?),
        _ => KeptFrame::World(input.doubles()?),
    };
    let [points, updates, segment, offset, bytes] = input.numbers()?;
    let moving = match flags & HAS_MOVING {
        0 => None,
        _ => {
            let [marked, segment, offset, bytes] = input.numbers()?;
            let place = (bytes > 0).then_some(SegmentPlace { segment, offset, bytes });
            Some(KeptMarks { marked, place })
        }
    };
    let sweep = match flags & HAS_SWEEP {
        0 => None,
        _ => Some(input.sweep()?),
    };
    let body_from_sensor = match flags & HAS_MOUNT {
        0 => None,
        _ => Some(input.doubles()?),
    };
    let rays_bytes = input.packed_u64()?;
    let rays = serde_json::from_slice(input.take(usize::try_from(rays_bytes).ok()?)?).ok()?;
    let count = input.packed_u64()?;
    // A tile takes at least three bytes.
    let count = usize::try_from(count).ok().filter(|&count| count <= input.0.len() / 3)?;
    let mut tiles = Vec::with_capacity(count);
    let mut before = [0_i64; 3];
    for _ in 0..count {
        for index in &mut before {
            *index = index.checked_add(input.packed_i64()?)?;
        }
        let [x, y, z] = before;
        tiles.push(TileIndex::new(x.try_into().ok()?, y.try_into().ok()?, z.try_into().ok()?));
    }
    Some(KeptRecord {
        number,
        stamp_ns,
        frame,
        rays,
        points,
        has_intensities: flags & HAS_INTENSITIES != 0,
        has_colours: flags & HAS_COLOURS != 0,
        has_classes: flags & HAS_CLASSES != 0,
        updates,
        place: SegmentPlace { segment, offset, bytes },
        moving,
        sweep,
        body_from_sensor,
        tiles,
    })
}

fn write_stamp(stamp_ns: Option<i64>, out: &mut Vec<u8>) {
    out.push(if stamp_ns.is_some() { HAS_STAMP } else { 0 });
    out.extend(stamp_ns.unwrap_or_default().to_le_bytes());
}

/// Unread part of a payload.
struct Input<'a>(&'a [u8]);

impl Input<'_> {
    fn take(&mut self, bytes: usize) -> Option<&[u8]> {
        let (taken, rest) = self.0.split_at_checked(bytes)?;
        self.0 = rest;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    fn number(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn numbers<const N: usize>(&mut self) -> Option<[u64; N]> {
        let mut numbers = [0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Some(numbers)
    }

    fn doubles<const N: usize>(&mut self) -> Option<[f64; N]> {
        self.numbers().map(|numbers| numbers.map(f64::from_bits))
    }

    fn sweep(&mut self) -> Option<Arc<Sweep>> {
        let (sweep, rest) = Sweep::read(self.0)?;
        self.0 = rest;
        Some(Arc::new(sweep))
    }

    fn stamp(&mut self) -> Option<Option<i64>> {
        let flag = self.byte()?;
        let stamp_ns = self.number()? as i64;
        Some((flag == HAS_STAMP).then_some(stamp_ns))
    }

    fn packed_u64(&mut self) -> Option<u64> {
        self.packed()
    }

    fn packed_i64(&mut self) -> Option<i64> {
        self.packed()
    }

    fn packed<T: integer_encoding::VarInt>(&mut self) -> Option<T> {
        let (value, bytes) = T::decode_var(self.0)?;
        self.take(bytes)?;
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    fn entries() -> Vec<CatalogEntry> {
        let rays = RayConfig { max_range_m: Some(60.5), ..RayConfig::default() };
        let sweep = Sweep::new([(0, Some(Isometry3::identity())), (50, None)]).unwrap();
        let scan = KeptRecord {
            number: 7,
            stamp_ns: Some(-3),
            frame: KeptFrame::Sensor([1.0, -0.0, 3.5e-300, 0.1, 0.2, 0.3, 0.9]),
            rays,
            points: 12,
            has_intensities: true,
            has_colours: true,
            has_classes: false,
            updates: 99,
            place: SegmentPlace { segment: 3, offset: 1 << 40, bytes: 77 },
            moving: Some(KeptMarks {
                marked: 5,
                place: Some(SegmentPlace { segment: 4, offset: 9, bytes: 8 }),
            }),
            sweep: Some(Arc::new(sweep)),
            body_from_sensor: Some([1.5, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]),
            tiles: vec![TileIndex::new(-5, i32::MAX, 0), TileIndex::new(i32::MAX, i32::MIN, 2)],
        };
        let in_world = KeptRecord {
            frame: KeptFrame::World([0.5; 3]),
            has_intensities: false,
            has_colours: false,
            has_classes: true,
            moving: None,
            sweep: None,
            body_from_sensor: None,
            stamp_ns: None,
            tiles: vec![],
            ..scan.clone()
        };
        vec![
            CatalogEntry::Kept(Box::new(scan)),
            CatalogEntry::Kept(Box::new(in_world)),
            CatalogEntry::Listed(ScanRecord::new(8, None, [1.0, 2.0, 3.0])),
            CatalogEntry::Unlisted(1, 6),
            CatalogEntry::Removed(9, 9),
            CatalogEntry::Operation("clear".to_owned()),
        ]
    }

    #[test]
    fn entries_round_trip() {
        for entry in entries() {
            let mut payload = Vec::new();
            entry.write(5, &mut payload);
            assert_eq!(CatalogEntry::read(&payload), Some((5, entry.clone())));
            payload.push(0);
            let longer = CatalogEntry::read(&payload);
            assert!(longer.is_none() || matches!(entry, CatalogEntry::Operation(_)), "{longer:?}");
        }
    }

    #[test]
    fn damaged_entries_never_panic() {
        for entry in entries() {
            let mut payload = Vec::new();
            entry.write(5, &mut payload);
            for length in 0..payload.len() {
                let _ = CatalogEntry::read(&payload[..length]);
            }
            for at in 0..payload.len() {
                for by in [1, 0x7f, 0x80, 0xff] {
                    let mut changed = payload.clone();
                    changed[at] ^= by;
                    let _ = CatalogEntry::read(&changed);
                }
            }
        }
    }
}

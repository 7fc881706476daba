use crate::space::Point;
use serde::Serialize;

/// Record of a scan of a map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ScanRecord {
    /// Number of the scan in the map, from 1.
    pub number: u64,
    /// Time of the scan in nanoseconds since the epoch of its source, if known.
    pub stamp_ns: Option<i64>,
    /// Position of the sensor in the world frame, in metres.
    pub origin_m: Point,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Entry {
    Scan(ScanRecord),
    /// A revert of the map and its list of scans to this flush.
    Rewind(u64),
}

pub(super) const RECORD_BYTES: usize = 64;
const SCAN: u8 = 1;
const REWIND: u8 = 2;
/// Represents an unknown time.
const NO_STAMP: i64 = i64::MIN;

impl ScanRecord {
    /// Returns the record of a scan.
    pub fn new(number: u64, stamp_ns: Option<i64>, origin_m: Point) -> Self {
        Self { number, stamp_ns, origin_m }
    }
}

impl Entry {
    /// Encodes the entry with the number of its flush.
    pub(super) fn to_bytes(self, flush_number: u64) -> [u8; RECORD_BYTES] {
        let (kind, number, stamp_ns, origin_m) = match self {
            Self::Scan(scan) => (SCAN, scan.number, scan.stamp_ns.unwrap_or(NO_STAMP), scan.origin_m),
            Self::Rewind(number) => (REWIND, number, NO_STAMP, [0.0; 3]),
        };
        let mut bytes = [0; RECORD_BYTES];
        bytes[0] = kind;
        bytes[8..16].copy_from_slice(&flush_number.to_le_bytes());
        bytes[16..24].copy_from_slice(&number.to_le_bytes());
        bytes[24..32].copy_from_slice(&stamp_ns.to_le_bytes());
        for (axis, coordinate) in origin_m.into_iter().enumerate() {
            bytes[32 + 8 * axis..40 + 8 * axis].copy_from_slice(&coordinate.to_le_bytes());
        }
        let checksum = crc32fast::hash(&bytes[..60]);
        bytes[60..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// Decodes a record into its flush and entry; `None` if it is damaged.
    pub(super) fn from_bytes(bytes: &[u8; RECORD_BYTES]) -> Option<(u64, Self)> {
        let word =
            |at: usize| <[u8; 8]>::try_from(&bytes[at..at + 8]).map(u64::from_le_bytes).unwrap_or_default();
        let checksum = crc32fast::hash(&bytes[..60]).to_le_bytes();
        if bytes[60..] != checksum {
            return None;
        }
        let number = word(16);
        let stamp_ns = Some(word(24) as i64).filter(|&stamp| stamp != NO_STAMP);
        let origin_m = [32, 40, 48].map(|at| f64::from_bits(word(at)));
        let entry = match bytes[0] {
            SCAN => Self::Scan(ScanRecord { number, stamp_ns, origin_m }),
            REWIND => Self::Rewind(number),
            _ => return None,
        };
        Some((word(8), entry))
    }
}

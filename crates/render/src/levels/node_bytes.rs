//! Encoding of a node, which viewers also read:
//!
//! ```text
//!  0  [u8; 4] "VXN1"                 44  u16  voxels along the edge
//!  4  u32     voxels, n              46  u8   0 occupied, 1 free, 2 unknown, 3 difference, 4 comparison
//!  8  [f64;3] lower corner, metres   47  u8   layer: 0 none, 1 colour, 2 intensity, 3 class, 4 time
//! 32  f64     edge of a voxel, m     48  f32  log-odds of value 0, and of 255, and of the map's threshold
//! 40  u32     last scan              60  u32  0
//! 64  x[n] y[n] z[n] value[n] count[n], one byte each; x, y and z as wrapping differences to the previous voxel
//! ```
//!
//! The values of the layer follow (`layer_planes`).
//!
//! Little endian, compressed with gzip. Neighbours differ little, so a voxel takes about two bytes.

use super::cells::{Cell, Cells, Scale, place};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use std::io::{self, Read, Write};

const MAGIC: [u8; 4] = *b"VXN1";
const HEADER_BYTES: usize = 64;
/// Uncompressed size of a voxel in bytes.
const VOXEL_BYTES: usize = 5;
/// Upper bound on the number of voxels of a node.
const MAX_VOXELS: usize = 1 << 24;
/// Value of `last scan` if it is unknown.
const NO_SCAN: u32 = u32::MAX;

/// Header of a node, without its voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) corner_m: [f64; 3],
    pub(super) voxel_edge_m: f64,
    pub(super) edge: i64,
    pub(super) kind: u8,
    pub(super) scale: Scale,
    pub(super) threshold: f64,
}

/// Returns the compressed bytes of a node.
pub(super) fn encode(head: &Head, cells: &Cells) -> Vec<u8> {
    encode_layered(head, cells, 0, &[])
}

/// Returns the compressed bytes of a node with the values of a layer, by its number.
pub(super) fn encode_layered(head: &Head, cells: &Cells, layer: u8, values: &[u8]) -> Vec<u8> {
    let count = cells.cells.len();
    let mut bytes = Vec::with_capacity(HEADER_BYTES + VOXEL_BYTES * count + values.len());
    bytes.extend(MAGIC);
    bytes.extend((count as u32).to_le_bytes());
    bytes.extend(head.corner_m.map(f64::to_le_bytes).as_flattened());
    bytes.extend(head.voxel_edge_m.to_le_bytes());
    let last_scan = u32::try_from(cells.last_scan).ok().filter(|&scan| scan > 0);
    bytes.extend(last_scan.unwrap_or(NO_SCAN).to_le_bytes());
    bytes.extend((head.edge as u16).to_le_bytes());
    bytes.extend([head.kind, layer]);
    for log_odds in [head.scale.least, head.scale.most, head.threshold] {
        bytes.extend((log_odds as f32).to_le_bytes());
    }
    bytes.extend([0; 4]);
    for shift in [0, 8, 16] {
        let mut before = 0;
        bytes.extend(cells.cells.iter().map(|cell| {
            let at = (cell.place >> shift) as u8;
            at.wrapping_sub(std::mem::replace(&mut before, at))
        }));
    }
    bytes.extend(cells.cells.iter().map(|cell| cell.value));
    bytes.extend(cells.cells.iter().map(|cell| cell.count));
    bytes.extend(values);
    let mut gzip = GzEncoder::new(Vec::with_capacity(bytes.len() / 4), Compression::new(6));
    gzip.write_all(&bytes).and_then(|()| gzip.finish()).unwrap_or_default()
}

/// Decodes the voxels from the bytes of [`encode`], which have no layer.
pub(super) fn decode(compressed: &[u8]) -> io::Result<Cells> {
    let wrong = |reason| io::Error::new(io::ErrorKind::InvalidData, reason);
    let mut bytes = Vec::new();
    let most = HEADER_BYTES + VOXEL_BYTES * MAX_VOXELS;
    GzDecoder::new(compressed).take(most as u64).read_to_end(&mut bytes)?;
    let (head, voxels) =
        bytes.split_at_checked(HEADER_BYTES).ok_or_else(|| wrong("node without a header"))?;
    let word = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    let count = word(4) as usize;
    if head[..4] != MAGIC || count.checked_mul(VOXEL_BYTES) != Some(voxels.len()) {
        return Err(wrong("not a node, or a node with a wrong length"));
    }
    let plane = |number: usize| voxels[number * count..(number + 1) * count].iter().copied();
    let mut at = [0_u8; 3];
    let steps = plane(0).zip(plane(1)).zip(plane(2));
    let cells = steps.zip(plane(3)).zip(plane(4)).map(|((((x, y), z), value), count)| {
        at = [at[0].wrapping_add(x), at[1].wrapping_add(y), at[2].wrapping_add(z)];
        Cell { place: place(at.map(i64::from)), value, count }
    });
    let last_scan = match word(40) {
        NO_SCAN => 0,
        scan => u64::from(scan),
    };
    Ok(Cells { cells: cells.collect(), last_scan })
}

/// Returns the box of a range of positions, in metres.
pub(super) fn bounds_m(head: &Head, bounds: [[u8; 3]; 2]) -> [[f64; 3]; 2] {
    let [low, high] = bounds;
    let at = |k: usize, place: i64| head.corner_m[k] + place as f64 * head.voxel_edge_m;
    [[0, 1, 2].map(|k| at(k, i64::from(low[k]))), [0, 1, 2].map(|k| at(k, i64::from(high[k]) + 1))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decoded_voxels_equal_the_encoded_ones() {
        let places = [0, 0x0000_007f, 0x0001_0000, 0x007f_7f7f];
        let cells = places.map(|place| Cell { place, value: place as u8, count: 7 }).to_vec();
        let cells = Cells { cells, last_scan: 12 };
        let head = Head {
            corner_m: [1.0, -2.0, 3.0],
            voxel_edge_m: 0.1,
            edge: 128,
            kind: 0,
            scale: Scale { least: 0.0, most: 3.5 },
            threshold: 0.0,
        };
        let bytes = encode(&head, &cells);
        assert_eq!(decode(&bytes).unwrap(), cells);
        for cut in 0..bytes.len() {
            assert!(decode(&bytes[..cut]).is_err(), "cut to {cut} bytes");
        }
    }
}

use anyhow::{Context, Result, ensure};
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use voxtile::space::VoxelIndex;

/// A finest voxel of a contender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRecord {
    /// Index along x, y and z.
    pub index: VoxelIndex,
    /// Number of updates; 0 from a contender that does not count them.
    pub observation_count: i32,
    /// Log-odds, widened if the contender stores `f32`.
    pub log_odds: f64,
}

/// Bytes of a voxel in a file: index 3 x `i32`, count `i32`, log-odds `f64`, little-endian.
const RECORD_BYTES: usize = 24;

/// Writes voxels in any order.
///
/// # Errors
///
/// Fails if the output cannot be written.
pub fn write_voxels(out: &mut impl Write, voxels: impl Iterator<Item = VoxelRecord>) -> io::Result<()> {
    for voxel in voxels {
        for number in voxel.index.into_iter().chain([voxel.observation_count]) {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(&voxel.log_odds.to_le_bytes())?;
    }
    out.flush()
}

/// Reads voxels written by [`write_voxels`] or by the contender in C++.
///
/// # Errors
///
/// Fails if the file cannot be read or ends within a voxel.
pub fn read_voxels(path: &Path) -> Result<Vec<VoxelRecord>> {
    let bytes = fs::read(path).with_context(|| format!("{}: cannot read the voxels", path.display()))?;
    let (records, rest) = bytes.as_chunks::<RECORD_BYTES>();
    ensure!(rest.is_empty(), "{}: ends within a voxel; write it again", path.display());
    Ok(records.iter().map(voxel_of).collect())
}

fn voxel_of(record: &[u8; RECORD_BYTES]) -> VoxelRecord {
    let whole = |at: usize| i32::from_le_bytes(std::array::from_fn(|byte| record[at + byte]));
    VoxelRecord {
        index: [whole(0), whole(4), whole(8)],
        observation_count: whole(12),
        log_odds: f64::from_le_bytes(std::array::from_fn(|byte| record[16 + byte])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_voxels_are_read_back() {
        let voxels = [
            VoxelRecord { index: [-1, 2, i32::MAX], observation_count: 3, log_odds: -0.4 },
            VoxelRecord { index: [i32::MIN, 0, 1], observation_count: 0, log_odds: 1e-300 },
        ];
        let mut bytes = Vec::new();
        write_voxels(&mut bytes, voxels.into_iter()).unwrap();
        let (records, rest) = bytes.as_chunks();
        assert!(rest.is_empty());
        assert_eq!(records.iter().map(voxel_of).collect::<Vec<_>>(), voxels);
    }
}

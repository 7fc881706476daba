use super::input::Input;
use super::symbol::MAX_STATES;
use super::{MAGIC, VERSION};
use crate::error::{DecodeError, FormatError};
use crate::space::VoxelBox;
use std::io::Read;

pub(super) const HEADER_BYTES: usize = 36;

/// Size in bytes of the header of version 1, with which every version begins.
pub(super) const HEADER_1_BYTES: usize = 24;

/// Header of a compact table.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) voxels: usize,
    pub(super) bricks: usize,
    pub(super) states: usize,
    /// Number of groups. This field and the following ones are 0 in version 1.
    pub(super) groups: usize,
    pub(super) codebook_bytes: usize,
    pub(super) codebook_crc: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Version {
    /// Groups without an index. The first brick of a group is encoded as the difference from the last brick before it.
    One,
    Two,
}

impl Header {
    /// Reads the header of a table of the tile of `voxels`.
    pub(super) fn read(
        input: &mut Input<impl Read>,
        voxels: &VoxelBox,
    ) -> Result<(Version, Self), DecodeError> {
        let mut header = [0; HEADER_1_BYTES];
        input.read(&mut header)?;
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| header[at + k]));
        let wrong = |offset, reason: String| Err(FormatError::at_offset(offset, reason).into());
        if u32_at(0) != MAGIC {
            return wrong(0, format!("the magic number is {:#010x}, not {MAGIC:#010x}", u32_at(0)));
        }
        let version = match u32_at(4) {
            1 => Version::One,
            VERSION => Version::Two,
            other => {
                let reason =
                    format!("version {other} is not known; this program reads versions 1 and {VERSION}");
                return wrong(4, reason);
            }
        };
        let count = u64::from(u32_at(8)) | u64::from(u32_at(12)) << 32;
        let capacity = voxels_in(voxels);
        let Some(count) = usize::try_from(count).ok().filter(|&count| count as u64 <= capacity) else {
            return wrong(8, format!("{count} voxels in a tile of {capacity}"));
        };
        let [bricks, states] = [u32_at(16), u32_at(20)].map(|count| count as usize);
        if bricks > count || (bricks == 0) != (count == 0) {
            return wrong(16, format!("{count} voxels in {bricks} bricks"));
        }
        if states > count.min(MAX_STATES) {
            return wrong(20, format!("a codebook of {states} states for {count} voxels"));
        }
        let mut header =
            Self { voxels: count, bricks, states, groups: 0, codebook_bytes: 0, codebook_crc: 0 };
        if version == Version::Two {
            header.read_rest(input)?;
        }
        Ok((version, header))
    }

    /// Reads the fields that version 1 does not have.
    fn read_rest(&mut self, input: &mut Input<impl Read>) -> Result<(), DecodeError> {
        let offset = input.offset;
        let mut rest = [0; HEADER_BYTES - HEADER_1_BYTES];
        input.read(&mut rest)?;
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| rest[at + k]));
        [self.groups, self.codebook_bytes] = [u32_at(0), u32_at(4)].map(|count| count as usize);
        self.codebook_crc = u32_at(8);
        if self.groups > self.bricks || (self.groups == 0) != (self.bricks == 0) {
            let reason = format!("{} bricks in {} groups", self.bricks, self.groups);
            return Err(FormatError::at_offset(offset, reason).into());
        }
        Ok(())
    }

    pub(super) fn to_bytes(&self) -> [u8; HEADER_BYTES] {
        // The counts fit into 32 bits: a tile has at most 2^21.1 bricks.
        let [bricks, states, groups, codebook_bytes] =
            [self.bricks, self.states, self.groups, self.codebook_bytes].map(|count| count as u32);
        let mut header = [0; HEADER_BYTES];
        header[8..16].copy_from_slice(&(self.voxels as u64).to_le_bytes());
        for (at, number) in [
            (0, MAGIC),
            (4, VERSION),
            (16, bricks),
            (20, states),
            (24, groups),
            (28, codebook_bytes),
            (32, self.codebook_crc),
        ] {
            header[at..at + 4].copy_from_slice(&number.to_le_bytes());
        }
        header
    }
}

fn voxels_in(voxels: &VoxelBox) -> u64 {
    (0..3).map(|k| u64::from(voxels.end[k].abs_diff(voxels.min[k]))).product()
}

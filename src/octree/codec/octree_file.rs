use super::header::{Header, read_header};
use super::input::Input;
use super::{bt, ot};
use crate::error::{DecodeError, FormatError};
use crate::octree::Octree;
use crate::octree::block::{Block, BlockId};
use std::fmt;
use std::io::BufRead;

/// Which of OctoMap's two file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OctreeFormat {
    /// `.bt`: a voxel is free, occupied or unknown.
    Bt,
    /// `.ot`: log-odds of every node.
    Ot,
}

impl fmt::Display for OctreeFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bt => ".bt",
            Self::Ot => ".ot",
        })
    }
}

/// What a `.bt` or `.ot` file holds.
#[derive(Clone, Debug)]
pub struct OctreeFile {
    /// The nodes as they stand in the file, pruned or not.
    ///
    /// From `.bt` a leaf is [`OCTOMAP_MIN_LOG_ODDS`](super::OCTOMAP_MIN_LOG_ODDS) or
    /// [`OCTOMAP_MAX_LOG_ODDS`](super::OCTOMAP_MAX_LOG_ODDS) and an inner node the maximum of its children; from
    /// `.ot` every node is what the file says, even an inner one that is not that maximum.
    pub tree: Octree,
    /// Edge of a finest voxel in metres.
    pub resolution_m: f64,
    /// OctoMap's name of the tree's class, such as `OcTree` or `ColorOcTree`.
    pub id: String,
    /// The format that was found.
    pub format: OctreeFormat,
    /// The number of nodes that the header states. In `.bt` it is right, or the file is refused; in `.ot` OctoMap
    /// passes it over, and so does voxtile.
    pub stated_nodes: u64,
}

/// Reads a `.bt` or `.ot` file; the first line says which.
///
/// Reads to the last node and no further: as in OctoMap, what follows it is not looked at, and `input` stays
/// there. The colors of a `ColorOcTree` are dropped.
///
/// # Errors
///
/// [`DecodeError::Io`] if reading fails; [`DecodeError::Format`] with the byte offset for whatever is not such a
/// file, is cut short, has a node below the sixteenth level, log-odds or a resolution that are not finite, or
/// (`.bt`) another number of nodes than it states.
pub fn read(input: impl BufRead) -> Result<OctreeFile, DecodeError> {
    read_with_limit(input, usize::MAX)
}

/// Reads a `.bt` or `.ot` file as [`read`] does, but refuses one whose tree needs more than `max_bytes` of heap.
///
/// A tree needs up to 32 times the bytes of its `.bt` and 13 times those of its `.ot`, and while it grows up to
/// twice that.
///
/// # Errors
///
/// Those of [`read`], and [`DecodeError::Format`] at the node that is too many.
pub fn read_with_limit(input: impl BufRead, max_bytes: usize) -> Result<OctreeFile, DecodeError> {
    read_format(input, None, max_bytes)
}

/// Reads a `.bt` file as [`read`] does, and nothing else.
///
/// # Errors
///
/// Those of [`read`]; an `.ot` file is one.
pub fn read_bt(input: impl BufRead) -> Result<OctreeFile, DecodeError> {
    read_format(input, Some(OctreeFormat::Bt), usize::MAX)
}

/// Reads an `.ot` file as [`read`] does, and nothing else.
///
/// # Errors
///
/// Those of [`read`]; a `.bt` file is one.
pub fn read_ot(input: impl BufRead) -> Result<OctreeFile, DecodeError> {
    read_format(input, Some(OctreeFormat::Ot), usize::MAX)
}

fn read_format(
    input: impl BufRead,
    wanted: Option<OctreeFormat>,
    max_bytes: usize,
) -> Result<OctreeFile, DecodeError> {
    let mut input = Input::new(input);
    let header = read_header(&mut input)?;
    if let Some(wanted) = wanted.filter(|&wanted| wanted != header.format) {
        let reason = format!("the first line is that of {}, not of {wanted}", header.format);
        return Err(FormatError::at_offset(0, reason).into());
    }
    let growing = GrowingTree { tree: Octree::new(), max_bytes };
    let tree = match header.format {
        OctreeFormat::Bt => bt::read_nodes(&mut input, &header, growing)?,
        OctreeFormat::Ot => ot::read_nodes(&mut input, &header, growing)?,
    };
    let Header { format, id, nodes: stated_nodes, resolution_m } = header;
    Ok(OctreeFile { tree, resolution_m, id, format, stated_nodes })
}

/// A tree that is being read, with the limit of its memory.
pub(super) struct GrowingTree {
    pub tree: Octree,
    max_bytes: usize,
}

impl GrowingTree {
    /// A new inner node's block, if the limit allows one more.
    pub(super) fn add_inner(&mut self, input: &Input<impl BufRead>) -> Result<BlockId, DecodeError> {
        // The arena's own numbers end at 2^32 blocks; a file must not get there.
        let max_bytes = self.max_bytes.min((u32::MAX as usize / 2).saturating_mul(Block::SIZE));
        if self.tree.arena.used_bytes() + Block::SIZE > max_bytes {
            return Err(input.error(format!("the tree needs more than {max_bytes} bytes of memory")).into());
        }
        Ok(self.tree.add_inner())
    }
}

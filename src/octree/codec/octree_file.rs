use super::header::{Header, read_header};
use super::input::Input;
use super::{bt, ot};
use crate::error::{DecodeError, FormatError};
use crate::octree::Octree;
use crate::octree::block::{Block, BlockId};
use std::fmt;
use std::io::BufRead;

/// OctoMap file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OctreeFormat {
    /// `.bt`: a voxel is free, occupied or unknown.
    Bt,
    /// `.ot`: log-odds of each node.
    Ot,
    /// `.ot` of a `ColorOcTree`: log-odds and colour of each node. Only for writing: a file that is read has the format
    /// `Ot`, whatever its class.
    ColorOt,
}

impl fmt::Display for OctreeFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bt => ".bt",
            Self::Ot | Self::ColorOt => ".ot",
        })
    }
}

/// Content of a `.bt` or `.ot` file.
#[derive(Clone, Debug)]
pub struct OctreeFile {
    /// Nodes as in the file, pruned or not.
    ///
    /// In a tree from `.bt` a leaf is [`OCTOMAP_MIN_LOG_ODDS`](super::OCTOMAP_MIN_LOG_ODDS) or
    /// [`OCTOMAP_MAX_LOG_ODDS`](super::OCTOMAP_MAX_LOG_ODDS), and an inner node the maximum of its children. In a tree
    /// from `.ot` each node has the value in the file, even if an inner one is not that maximum.
    pub tree: Octree,
    /// Edge of a voxel in metres.
    pub resolution_m: f64,
    /// OctoMap's class name of the tree, such as `OcTree` or `ColorOcTree`.
    pub id: String,
    /// Format of the file.
    pub format: OctreeFormat,
    /// Number of nodes according to the header. In `.bt` a wrong number is an error; in `.ot` it is ignored, as in
    /// OctoMap.
    pub stated_nodes: u64,
}

/// Reads a `.bt` or `.ot` file; the first line determines the format.
///
/// Stops after the last node, like OctoMap; the rest of `input` is not read. The colors of a `ColorOcTree` are dropped.
///
/// # Errors
///
/// Fails with [`DecodeError::Io`] if reading fails, and with [`DecodeError::Format`] and the byte offset if the file
/// has another format or is truncated, a node is below the sixteenth level, log-odds or the resolution are not finite,
/// or (`.bt`) the number of nodes is wrong.
pub fn read(input: impl BufRead) -> Result<OctreeFile, DecodeError> {
    read_with_limit(input, usize::MAX)
}

/// Reads a `.bt` or `.ot` file as [`read`] does, but fails if the tree needs more than `max_bytes` of heap.
///
/// A tree needs up to 32 times the bytes of its `.bt` file and 13 times those of its `.ot` file; while it grows, up to
/// twice that.
///
/// # Errors
///
/// Same errors as [`read`]; also fails with [`DecodeError::Format`] at the node that exceeds the limit.
pub fn read_with_limit(input: impl BufRead, max_bytes: usize) -> Result<OctreeFile, DecodeError> {
    read_format(input, None, max_bytes)
}

/// Reads a `.bt` file like [`read`].
///
/// # Errors
///
/// Same errors as [`read`]; also fails if the file is an `.ot` file.
pub fn read_bt(input: impl BufRead) -> Result<OctreeFile, DecodeError> {
    read_format(input, Some(OctreeFormat::Bt), usize::MAX)
}

/// Reads an `.ot` file like [`read`].
///
/// # Errors
///
/// Same errors as [`read`]; also fails if the file is a `.bt` file.
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
        OctreeFormat::Ot | OctreeFormat::ColorOt => ot::read_nodes(&mut input, &header, growing)?,
    };
    let Header { format, id, nodes: stated_nodes, resolution_m } = header;
    Ok(OctreeFile { tree, resolution_m, id, format, stated_nodes })
}

/// Tree being read, with a memory limit.
pub(super) struct GrowingTree {
    pub tree: Octree,
    max_bytes: usize,
}

impl GrowingTree {
    /// Adds an inner node's block, if the limit permits it.
    pub(super) fn add_inner(&mut self, input: &Input<impl BufRead>) -> Result<BlockId, DecodeError> {
        // The arena is limited to 2^32 blocks, which a file must not reach.
        let max_bytes = self.max_bytes.min((u32::MAX as usize / 2).saturating_mul(Block::SIZE));
        if self.tree.arena.used_bytes() + Block::SIZE > max_bytes {
            return Err(input.error(format!("the tree needs more than {max_bytes} bytes of memory")).into());
        }
        Ok(self.tree.add_inner())
    }
}

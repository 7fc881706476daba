use super::header::{BT_MAGIC, Counted, Header, OT_MAGIC, check_resolution, read_header};
use super::tree::Octree;
use super::{bt, ot};
use crate::error::{DecodeError, FormatError};
use std::io::BufRead;

/// What an octree file holds.
#[derive(Clone, Debug)]
pub struct OctreeFile {
    /// The tree, as it stands in the file: what the file did not prune is not pruned.
    pub tree: Octree,
    /// Edge of a finest voxel in metres.
    pub resolution_m: f64,
    /// Which of OctoMap's two formats.
    pub format: OctreeFormat,
}

/// Which of OctoMap's two formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OctreeFormat {
    /// `.bt`: free or occupied.
    Binary,
    /// `.ot`: log-odds.
    Full,
}

/// Reads a `.bt` or `.ot` file; the first line tells which. The `.bt` format without that line, which OctoMap wrote
/// before 2010, is read too. What follows the tree is left unread, as OctoMap leaves it.
///
/// Leaves of a `.bt` come back at OctoMap's clamps, inner nodes as the maximum of their children. Colours are dropped.
///
/// # Errors
///
/// A file that is neither, ends early, or says what cannot be, with the offset.
pub fn read_octree(input: impl BufRead) -> Result<OctreeFile, DecodeError> {
    let mut input = Counted::new(input);
    let start: [u8; 4] = input.bytes("its first line")?;
    // Legacy: an i32 3 in place of the first line.
    if start == 3_i32.to_le_bytes() {
        let resolution_m = f64::from_le_bytes(input.bytes("the header")?);
        let nodes = u64::from(u32::from_le_bytes(input.bytes("the header")?));
        check_resolution(resolution_m, 4)?;
        return read_tree(input, Header { id: "OcTree".into(), nodes, resolution_m }, OctreeFormat::Binary);
    }
    let mut line = start.to_vec();
    while line.len() < 128 && line.last() != Some(&b'\n') {
        line.extend(input.bytes::<1>("its first line")?);
    }
    let format = if line.starts_with(BT_MAGIC.as_bytes()) {
        OctreeFormat::Binary
    } else if line.starts_with(OT_MAGIC.as_bytes()) {
        OctreeFormat::Full
    } else {
        let reason = format!("the first line must begin with `{BT_MAGIC}` or `{OT_MAGIC}`");
        return Err(FormatError::at_offset(0, reason).into());
    };
    let header = read_header(&mut input)?;
    read_tree(input, header, format)
}

fn read_tree<R: BufRead>(
    mut input: Counted<R>,
    header: Header,
    format: OctreeFormat,
) -> Result<OctreeFile, DecodeError> {
    let at = input.offset;
    let tree = match (format, header.id.as_str()) {
        // `1` is what OctoMap called an OcTree before 2011.
        (_, "OcTree" | "1" | "ColorOcTree") if header.nodes == 0 => Octree::new(),
        (OctreeFormat::Binary, "OcTree" | "1" | "ColorOcTree") => bt::read_payload(&mut input)?,
        (OctreeFormat::Full, "OcTree" | "1") => ot::read_payload(&mut input, false)?,
        (OctreeFormat::Full, "ColorOcTree") => ot::read_payload(&mut input, true)?,
        (_, id) => {
            let reason = format!("a tree of type `{id}`; OcTree and ColorOcTree are read");
            return Err(FormatError::at_offset(at, reason).into());
        }
    };
    if format == OctreeFormat::Binary && tree.len_nodes() as u64 != header.nodes {
        let reason = format!("the header says {} nodes, the tree has {}", header.nodes, tree.len_nodes());
        return Err(FormatError::at_offset(at, reason).into());
    }
    Ok(OctreeFile { tree, resolution_m: header.resolution_m, format })
}

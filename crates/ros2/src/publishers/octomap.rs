use super::bounded_file::BoundedFile;
use crate::messages::{Header, Octomap};
use anyhow::anyhow;
use voxtile::octree::OctreeFormat;
use voxtile::query::OctreeExport;
use voxtile::{Aabb, MapQueries, MapView};

/// Memory for each part of the tree that is built separately.
const MEMORY_BYTES: usize = 32 << 20;
/// Last line of a file's header.
const LAST_HEADER_LINE: &[u8] = b"\ndata\n";

/// Returns the voxels of a region as an OctoMap tree for `octomap_msgs::msgToMap`.
///
/// # Errors
///
/// Voxels outside OctoMap's keys, a tree larger than a message may be, or a tile that cannot be read.
pub fn octomap(
    map: &impl MapView,
    region: &Aabb,
    format: OctreeFormat,
    header: Header,
) -> anyhow::Result<Octomap> {
    let resolution = map.config().grid.resolution_m();
    let export = OctreeExport { format, region: Some(region), origin: [0; 3], memory_bytes: MEMORY_BYTES };
    let (mut spool, mut file) = (BoundedFile::default(), BoundedFile::default());
    map.write_octree::<anyhow::Error>(&export, &mut spool, &mut file)?;
    let mut file = file.into_bytes();
    let end = file.windows(LAST_HEADER_LINE.len()).position(|line| line == LAST_HEADER_LINE);
    let end = end.ok_or_else(|| anyhow!("the octree has no header"))? + LAST_HEADER_LINE.len();
    file.drain(..end);
    let binary = format == OctreeFormat::Bt;
    Ok(Octomap { header, binary, id: "OcTree".to_owned(), resolution, data: file })
}

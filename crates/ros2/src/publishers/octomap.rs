use super::bounded_file::BoundedFile;
use crate::messages::{Header, Octomap};
use anyhow::anyhow;
use voxtile::octree::OctreeFormat;
use voxtile::query::OctreeExport;
use voxtile::{Aabb, Layers, MapQueries, MapView};

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
    let format = format_of(format, &map.config().layers());
    let export = OctreeExport { format, region: Some(region), origin: [0; 3], memory_bytes: MEMORY_BYTES };
    let (mut spool, mut file) = (BoundedFile::default(), BoundedFile::default());
    map.write_octree::<anyhow::Error>(&export, &mut spool, &mut file)?;
    let mut file = file.into_bytes();
    let end = file.windows(LAST_HEADER_LINE.len()).position(|line| line == LAST_HEADER_LINE);
    let end = end.ok_or_else(|| anyhow!("the octree has no header"))? + LAST_HEADER_LINE.len();
    file.drain(..end);
    let binary = format == OctreeFormat::Bt;
    Ok(Octomap { header, binary, id: class_of(format).to_owned(), resolution, data: file })
}

/// Returns the format of a tree of a map with these layers: with log-odds, nodes also have the colours of the map.
pub fn format_of(format: OctreeFormat, layers: &Layers) -> OctreeFormat {
    match format {
        OctreeFormat::Ot if layers.colour => OctreeFormat::ColorOt,
        other => other,
    }
}

/// Returns the name of a tree's class in OctoMap.
pub fn class_of(format: OctreeFormat) -> &'static str {
    match format {
        OctreeFormat::Bt | OctreeFormat::Ot => "OcTree",
        OctreeFormat::ColorOt => "ColorOcTree",
    }
}

use crate::json;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use voxtile::octree::OctreeFile;
use voxtile_pipeline::octree_file::read;

#[derive(Debug, Serialize)]
struct Info {
    resolution_m: f64,
    id: String,
    nodes: u64,
    leaves: u64,
    free_voxels: u64,
    occupied_voxels: u64,
}

/// Prints the properties of an octree file without expanding it.
pub fn print_info(path: &Path, json: bool, out: &mut impl Write) -> anyhow::Result<()> {
    let OctreeFile { tree, resolution_m, id, .. } = read(path)?;
    let voxels = tree.count_voxels(0.0);
    let info = Info {
        resolution_m,
        id,
        nodes: tree.node_count(),
        leaves: tree.leaf_count(),
        free_voxels: voxels.free,
        occupied_voxels: voxels.occupied,
    };
    if json {
        return json::print(&info, out);
    }
    let Info { id, nodes, leaves, free_voxels, occupied_voxels, .. } = info;
    writeln!(out, "file         OctoMap's {id}, resolution {resolution_m} m")?;
    writeln!(out, "nodes        {nodes}, {leaves} of them leaves")?;
    writeln!(out, "voxels       {free_voxels} free, {occupied_voxels} occupied")?;
    Ok(())
}

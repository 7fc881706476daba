use crate::args::Args;
use crate::files::{load_layer, open_map};
use crate::json;
use crate::output;
use std::path::Path;
use voxtile::Mapper;
use voxtile_share::merge_layer;

pub fn run(args: &Args, layer: &Path, map: &Path) -> anyhow::Result<()> {
    let layer = load_layer(layer, args.max_voxels)?;
    let mut mapper = open_map(map, layer.grid(), args.memory.as_u64() as usize)?;
    let report = merge_layer(&layer, &mut mapper)?;
    mapper.flush()?;
    if args.json {
        json::print(&report)?;
    } else {
        output::print(format_args!(
            "folded    {} voxels: {} got a hit, {} were known",
            report.voxels, report.hits, report.known
        ))?;
    }
    Ok(())
}

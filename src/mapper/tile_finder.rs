use super::paging::MemoryPlan;
use super::trace_rules::trace_rules;
use crate::config::{Layers, MapConfig, RayConfig};
use crate::error::Result;
use crate::scan::{Overflow, PackedUpdates, ScanPoints, ScanTracer, Stop, TraceRules};
use crate::space::TileIndex;
use crate::store::Disk;
use std::path::Path;
use std::sync::Arc;

/// Finds the tiles that a scan changes, without a map.
pub(crate) struct TileFinder {
    config: MapConfig,
    tracer: ScanTracer,
    disk: Arc<dyn Disk>,
}

impl TileFinder {
    /// Creates a finder for maps with this configuration. It uses as much memory as the configuration allows for a
    /// scan.
    pub(crate) fn new(config: &MapConfig, disk: Arc<dyn Disk>, stop: Stop) -> Self {
        let bytes = MemoryPlan::of(config).scan_bytes;
        let mut tracer = ScanTracer::with_memory_bytes(bytes);
        tracer.stop_with(stop);
        Self { config: config.clone(), tracer, disk }
    }

    /// Returns the tiles that a scan changes. Data that do not fit in memory are written to unnamed files in `folder`.
    pub(crate) fn tiles_of(
        &mut self,
        scan: &dyn ScanPoints,
        rays: &RayConfig,
        folder: &Path,
    ) -> Result<Vec<TileIndex>> {
        self.config.rays = *rays;
        let max_bytes = MemoryPlan::of(&self.config).updates_bytes;
        let mut tiles = Vec::new();
        let make_scratch = &|| self.disk.scratch(folder);
        let spill = &mut |part: Vec<(TileIndex, PackedUpdates)>| {
            tiles.extend(part.into_iter().map(|(tile, _)| tile));
            Ok(())
        };
        let overflow = Overflow { max_bytes, max_tiles: usize::MAX, folder, make_scratch, spill };
        let rules = TraceRules { layers: Layers::NONE, ..trace_rules(&self.config, None) };
        let updates = self.tracer.trace_points(rules, scan, Some(overflow))?;
        self.tracer.stop().check()?;
        tiles.extend(updates.tiles.into_iter().map(|(tile, _)| tile));
        Ok(tiles)
    }
}

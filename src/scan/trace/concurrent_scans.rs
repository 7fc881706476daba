use super::scan_hits::BYTES_PER_POINT;
use super::scan_rays::{PerScanUpdates, ScanRays};
use super::scan_tracer::{ScanTracer, TraceRules};
use crate::config::InsertMode;
use crate::error::Result;
use crate::scan::scan_points::ScanPoints;
use crate::scan::spill::ScanParts;
use crate::scan::updates::ScanUpdates;
use crate::space::TileSelection;
use rayon::prelude::*;

impl ScanTracer {
    /// Traces scans concurrently, each on its share of the cores. Different scans share nothing, whereas parts of one
    /// scan mark the same voxels and have to be merged.
    ///
    /// Returns `None` for a scan that does not fit into its share of the memory limit and must be traced alone.
    ///
    /// # Errors
    ///
    /// Same errors as [`ScanTracer::trace`], for each scan.
    pub(crate) fn trace_concurrently(
        &mut self,
        rules: TraceRules<'_>,
        scans: &[&dyn ScanPoints],
    ) -> Vec<Result<Option<ScanUpdates>>> {
        let selection = rules.selection();
        let rules = rules.with_selection(selection.as_deref());
        let traced_tiles = rules.traced();
        let max_threads = (rayon::current_num_threads() / scans.len().max(1)).max(1);
        let mut tracers = self.divided(scans.len(), max_threads);
        let traced = tracers
            .par_iter_mut()
            .zip(scans)
            .map(|(tracer, scan)| tracer.trace_whole(rules, traced_tiles.as_deref(), *scan, max_threads))
            .collect();
        for mut tracer in tracers {
            self.per_scan.append(&mut tracer.per_scan);
            self.per_ray.append(&mut tracer.per_ray);
        }
        traced
    }

    #[cfg(test)]
    pub(crate) fn collectors(&self) -> usize {
        self.per_scan.len().max(self.per_ray.len())
    }

    /// Number of scans, of `scans` given ones, that may be traced concurrently.
    pub(crate) fn max_concurrent(&self, scans: usize) -> usize {
        self.limit.collectors(scans.min(rayon::current_num_threads()))
    }

    /// Divides the tracer into tracers with equal shares of the memory and of the collectors.
    fn divided(&mut self, parts: usize, collectors: usize) -> Vec<Self> {
        let limit = self.limit.divided(parts);
        let divided = (0..parts).map(|_| Self {
            per_scan: self.per_scan.drain(..collectors.min(self.per_scan.len())).collect(),
            per_ray: self.per_ray.drain(..collectors.min(self.per_ray.len())).collect(),
            limit,
            stop: self.stop.clone(),
        });
        divided.collect()
    }

    /// Traces a scan whose updates fit into memory; `None` if they do not.
    fn trace_whole(
        &mut self,
        rules: TraceRules<'_>,
        traced: Option<&TileSelection>,
        scan: &dyn ScanPoints,
        max_threads: usize,
    ) -> Result<Option<ScanUpdates>> {
        let scan_rays = ScanRays::new(rules, traced, scan, max_threads, &self.stop)?;
        if !rules.layers.is_none()
            && !self.limit.has_room_for_bytes(scan.len().saturating_mul(BYTES_PER_POINT))
        {
            return Ok(None);
        }
        let layers = rules.layers;
        let updates = match (rules.rays.insert_mode, self.limit.is_none()) {
            (InsertMode::PerScan, true) => scan_rays.per_scan(layers, &mut self.per_scan)?,
            (InsertMode::PerScan, false) => {
                let parts = ScanParts::refused(rules.mapped, &self.stop);
                match scan_rays.per_scan_in_parts(layers, &mut self.per_scan, &self.limit, &parts)? {
                    PerScanUpdates::Whole(updates) => updates,
                    PerScanUpdates::InParts(..) => return Ok(None),
                }
            }
            (InsertMode::PerRay, true) => {
                let mut updates = match rules.are_rays_in_order() {
                    true => scan_rays.per_ray_in_order()?,
                    false => scan_rays.per_ray(&mut self.per_ray)?,
                };
                scan_rays.add_hits(layers, &mut updates)?;
                updates
            }
            // The size of these updates is unknown before they are collected, so the caller must trace the scan in
            // parts.
            (InsertMode::PerRay, false) => return Ok(None),
        };
        self.stop.check()?;
        Ok(Some(updates))
    }
}

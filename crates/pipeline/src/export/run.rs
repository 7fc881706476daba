use super::options::ExportOptions;
use super::summary::{ExportSummary, Written};
use super::{files, octree, stream, tileset};
use crate::memory;
use crate::watch::Watch;
use voxtile_formats::write::{OutputFormat, Writer};

/// An export with checked options.
pub(super) struct Export<'a> {
    pub options: &'a ExportOptions,
    pub format: OutputFormat,
    pub watch: &'a Watch,
}

/// Exports a map. If it is stopped, the output is unchanged.
///
/// # Errors
///
/// The options are invalid, the map cannot be read, or the output cannot be written.
pub fn export(options: &ExportOptions, watch: &Watch) -> anyhow::Result<ExportSummary> {
    let export = Export { options, format: options.checked_format()?, watch };
    match export.format.writer {
        Writer::Stream(_) => stream::export(&export),
        Writer::Octree(format) => octree::export(&export, format),
        Writer::Tileset => tileset::export(&export),
        Writer::Files(_) | Writer::NotBuilt => files::export(&export),
    }
}

impl Export<'_> {
    pub fn summary(&self, voxels: u64, written: Written) -> ExportSummary {
        let file = self.options.output.clone();
        ExportSummary { file, voxels, peak_rss_bytes: memory::peak_bytes(), written }
    }
}

use super::origin::ExportOrigin;
use super::origin_file::OriginFile;
use super::run::Export;
use super::summary::{ExportSummary, Written};
use crate::output::OutputFile;
use std::io::{self, Write};
use voxtile::Error;
use voxtile::space::Grid;

/// Output file whose coordinates may have another origin than the map's. A companion file then records that origin.
pub(super) struct MovedFile<'a> {
    export: &'a Export<'a>,
    /// Companion file; `None` for a stream.
    origin_file: Option<OriginFile>,
}

impl<'a> MovedFile<'a> {
    /// Prepares the output of an export.
    ///
    /// # Errors
    ///
    /// Another file has the name of the companion file.
    pub fn of(export: &'a Export<'a>) -> voxtile::Result<Self> {
        Ok(Self { export, origin_file: OriginFile::of(&export.options.output)? })
    }

    /// Writes the file and, if the origin differs, its companion file.
    pub fn write<T>(
        &self,
        origin: &ExportOrigin,
        grid: &Grid,
        write: impl FnOnce(&mut dyn Write) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let (output, stop) = (&self.export.options.output, self.export.watch.stop());
        let mut file = OutputFile::create(output)?.stop_with(stop.clone());
        let written = write(file.out()).map_err(|error| match error.downcast::<io::Error>() {
            // The I/O error does not name the file.
            Ok(error) => Error::io(output, "write", error).into(),
            Err(error) => error,
        });
        stop.check()?;
        let value = written?;
        match &self.origin_file {
            // The companion file is written first. After a crash there may be a companion file without its output, but
            // never a shifted output without its companion file.
            Some(origin_file) if origin.is_moved() => {
                let hash = file.hash()?;
                origin_file.write(output, hash, origin, grid)?;
                file.finish()?;
            }
            Some(origin_file) => {
                file.finish()?;
                origin_file.remove()?;
            }
            None => file.finish()?,
        }
        Ok(value)
    }

    /// Returns the summary of the export.
    pub fn summary(&self, voxels: u64, origin: &ExportOrigin) -> ExportSummary {
        let origin_file = self.origin_file.as_ref().filter(|_| origin.is_moved());
        let written = Written::Stream {
            origin_m: origin.corner_m,
            origin_voxel: origin.voxel,
            origin_file: origin_file.map(|file| file.path().to_owned()),
            requested_m: origin.requested_m,
        };
        self.export.summary(voxels, written)
    }
}

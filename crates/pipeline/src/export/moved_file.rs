use super::origin::ExportOrigin;
use super::origin_file::OriginFile;
use super::run::Export;
use super::summary::{ExportSummary, Written};
use crate::output::OutputFile;
use std::io::{self, Write};
use voxtile::Error;
use voxtile::space::Grid;

/// One file whose coordinates may begin elsewhere than the map's; then a file beside it says so.
pub(super) struct MovedFile<'a> {
    export: &'a Export<'a>,
    /// `None` for a stream, which has nothing beside it.
    beside: Option<OriginFile>,
}

impl<'a> MovedFile<'a> {
    /// The output of an export.
    ///
    /// # Errors
    ///
    /// Something else has the name of the file beside.
    pub fn of(export: &'a Export<'a>) -> voxtile::Result<Self> {
        Ok(Self { export, beside: OriginFile::of(&export.options.output)? })
    }

    /// Writes all of it, and beside it where it is.
    pub fn write<T>(
        &self,
        origin: &ExportOrigin,
        grid: &Grid,
        write: impl FnOnce(&mut dyn Write) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let (output, stop) = (&self.export.options.output, self.export.watch.stop());
        let mut file = OutputFile::create(output)?.stop_with(stop.clone());
        let written = write(file.out()).map_err(|error| match error.downcast::<io::Error>() {
            // It does not say by itself which file it is about.
            Ok(error) => Error::io(output, "write", error).into(),
            Err(error) => error,
        });
        stop.check()?;
        let value = written?;
        match &self.beside {
            // First: who has only one of the two has one too many, and no shifted file that does not say so.
            Some(beside) if origin.is_moved() => {
                let hash = file.hash()?;
                beside.write(output, hash, origin, grid)?;
                file.finish()?;
            }
            Some(beside) => {
                file.finish()?;
                beside.remove()?;
            }
            None => file.finish()?,
        }
        Ok(value)
    }

    /// What was written.
    pub fn summary(&self, voxels: u64, origin: &ExportOrigin) -> ExportSummary {
        let beside = self.beside.as_ref().filter(|_| origin.is_moved());
        let written = Written::Stream {
            origin_m: origin.corner_m,
            origin_voxel: origin.voxel,
            origin_file: beside.map(|beside| beside.path().to_owned()),
            asked_m: origin.asked_m,
        };
        self.export.summary(voxels, written)
    }
}

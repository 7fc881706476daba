use super::counted::Counted;
use super::options::WriteOptions;
use super::row::{VoxelSink, VoxelsHead};
use super::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use voxtile::octree::OctreeFormat;

/// Output format of maps: a row of [`OutputFormats`](super::OutputFormats).
#[derive(Clone, Copy, Debug)]
pub struct OutputFormat {
    /// Name in options, such as `copc`.
    pub name: &'static str,
    /// File extension without the dot, such as `copc.laz`. `None` for a folder format, which is only selected by its
    /// name.
    pub extension: Option<&'static str>,
    /// Description for help texts.
    pub help: &'static str,
    /// Cargo feature that the format requires, if any.
    pub feature: Option<&'static str>,
    /// Supported options, apart from an origin.
    pub takes: &'static [OutputOption],
    /// Supported origins of coordinates.
    pub origin: Origin,
    /// Reason why other options are refused, with advice.
    pub refusal: &'static str,
    /// Whether a terminal can display it.
    pub is_text: bool,
    /// Whether the format distinguishes free from unobserved voxels and therefore contains all observed voxels by
    /// default.
    pub needs_free_voxels: bool,
    /// Writer of the format.
    pub writer: Writer,
}

/// Option that only some formats support.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputOption {
    /// Only voxels in a box.
    Region,
    /// Occupied voxels, free ones, all, or those above a probability.
    Which,
    /// The mean of the points in a voxel in place of its center.
    MeanPoints,
    /// Only voxels of some classes.
    Classes,
    /// Only voxels between two heights.
    Heights,
    /// Edge of the square of a file.
    Cell,
    /// 16-bit positions.
    Quantized,
    /// A coordinate reference system.
    Crs,
    /// Another unit than metres.
    Unit,
}

/// Supported origins of a file's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Only the origin of the map.
    Map,
    /// A corner of a voxel, which is stored in `FILE.origin.json`.
    Corner,
    /// As `Corner`. If single precision is too coarse for the map's coordinates, an origin is chosen automatically.
    CornerNearby,
    /// Any point, which the file itself stores.
    Point,
}

/// Writer of a format.
#[derive(Clone, Copy, Debug)]
pub enum Writer {
    /// One stream of bytes, voxel by voxel, which can be a pipe.
    Stream(OpenStream),
    /// A file or a folder with companion files, voxel by voxel.
    Files(OpenFiles),
    /// OctoMap tree as one stream of bytes, written by the engine.
    Octree(OctreeFormat),
    /// A folder with levels of detail of a whole map.
    Tileset,
    /// Not available in this build.
    NotBuilt,
}

/// Starts a stream.
pub type OpenStream =
    for<'a> fn(&VoxelsHead, Box<dyn Write + 'a>, &WriteOptions) -> Result<Box<dyn VoxelSink + 'a>>;

/// Starts a file or a folder at a path.
pub type OpenFiles = fn(&VoxelsHead, &Path, &WriteOptions) -> Result<Box<dyn VoxelSink>>;

impl OutputFormat {
    /// Returns whether the format can be written to a pipe.
    pub fn is_stream(&self) -> bool {
        matches!(self.writer, Writer::Stream(_) | Writer::Octree(_))
    }

    /// Checks that this build supports the format.
    ///
    /// # Errors
    ///
    /// The build does not support the format.
    pub fn check_built(&self) -> Result<()> {
        let Writer::NotBuilt = self.writer else { return Ok(()) };
        let feature = self.feature.unwrap_or_default();
        Err(self.refused(&format!("this build does not support it: build with the feature `{feature}`")))
    }

    /// Starts writing voxels to a file, or to a folder for a folder format. The output is complete when the sink is
    /// finished.
    ///
    /// The caller renames, syncs and removes files. A folder must be empty or absent.
    ///
    /// # Errors
    ///
    /// The resolution, bounding box or options are invalid; the format is not supported by this build or is not made of
    /// voxels; or an I/O error occurs.
    pub fn open(&self, head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Box<dyn VoxelSink>> {
        self.check_built()?;
        check(head)?;
        let sink = match self.writer {
            Writer::Files(open) => open(head, path, options)?,
            Writer::Stream(open) => {
                let file = File::create(path).map_err(|error| Error::io(path, "create", error))?;
                open(head, Box::new(BufWriter::with_capacity(1 << 17, file)), options)?
            }
            _ => return Err(self.refused("is created from a whole map, not from single voxels")),
        };
        Ok(Box::new(Counted::new(sink, options.final_path.clone(), head.voxels)))
    }

    /// Starts a stream of voxels. Errors name `options.final_path`. Writes are small, so `out` should be buffered.
    ///
    /// # Errors
    ///
    /// As for [`OutputFormat::open`]. Also fails for a format that is not a stream.
    pub fn open_stream<'a>(
        &self,
        head: &VoxelsHead,
        out: impl Write + 'a,
        options: &WriteOptions,
    ) -> Result<Box<dyn VoxelSink + 'a>> {
        check(head)?;
        let Writer::Stream(open) = self.writer else {
            return Err(self.refused("is not a stream format: use an output file"));
        };
        let sink = open(head, Box::new(out), options)?;
        Ok(Box::new(Counted::new(sink, options.final_path.clone(), head.voxels)))
    }

    fn refused(&self, reason: &str) -> Error {
        Error::argument(self.name, reason)
    }
}

fn check(head: &VoxelsHead) -> Result<()> {
    if !(head.resolution_m.is_finite() && head.resolution_m > 0.0) {
        let reason = format!("{} m is not a valid voxel size", head.resolution_m);
        return Err(Error::argument("resolution", reason));
    }
    let bounds = head.bounds_m.as_flattened();
    if head.voxels > 0 && !bounds.iter().all(|bound| bound.is_finite()) {
        let reason = format!("{:?} is not a valid box", head.bounds_m);
        return Err(Error::argument("bounds", reason));
    }
    Ok(())
}

use super::counted::Counted;
use super::options::WriteOptions;
use super::row::{VoxelSink, VoxelsHead};
use super::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use voxtile::octree::OctreeFormat;

/// A format that maps are written in: a row of [`OutputFormats`](super::OutputFormats).
#[derive(Clone, Copy, Debug)]
pub struct OutputFormat {
    /// Its name, as a person types it: `copc`.
    pub name: &'static str,
    /// The end of its files' names without the dot: `copc.laz`. `None` for a folder, which its name alone asks for.
    pub extension: Option<&'static str>,
    /// What it is, for help texts.
    pub help: &'static str,
    /// The feature of this crate that it needs, if any.
    pub feature: Option<&'static str>,
    /// The options that it takes, beside an origin.
    pub takes: &'static [OutputOption],
    /// Where its coordinates may begin.
    pub origin: Origin,
    /// Why it takes no other option, and what to do.
    pub refusal: &'static str,
    /// Whether a terminal can show it.
    pub is_text: bool,
    /// Whether it tells free voxels from such that nobody saw, and so has all observed voxels unless asked otherwise.
    pub needs_free_voxels: bool,
    /// How it is written.
    pub writer: Writer,
}

/// An option that some formats take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputOption {
    /// Only voxels in a box.
    Region,
    /// Occupied voxels, free ones, all, or those from a probability on.
    Which,
    /// Only voxels between two heights.
    Heights,
    /// The edge of the square of a file.
    Cell,
    /// Positions as numbers of 16 bits.
    Quantized,
}

/// Where the coordinates of a file may begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Where the map's do.
    Map,
    /// At a corner of a voxel, which `FILE.origin.json` names.
    Corner,
    /// The same. Where single precision is too coarse for the map's coordinates, an origin is chosen.
    CornerNearby,
    /// At any point, which the file itself names.
    Point,
}

/// How a format is written.
#[derive(Clone, Copy, Debug)]
pub enum Writer {
    /// One stream of bytes, voxel after voxel, so that it can go to a pipe.
    Stream(OpenStream),
    /// A file or a folder, and files beside it, voxel after voxel.
    Files(OpenFiles),
    /// OctoMap's tree, one stream of bytes, which the engine writes.
    Octree(OctreeFormat),
    /// A folder with the levels of detail of a whole map.
    Tileset,
    /// Not at all: this program was built without it.
    NotBuilt,
}

/// Starts a stream.
pub type OpenStream =
    for<'a> fn(&VoxelsHead, Box<dyn Write + 'a>, &WriteOptions) -> Result<Box<dyn VoxelSink + 'a>>;

/// Starts a file or a folder at a path.
pub type OpenFiles = fn(&VoxelsHead, &Path, &WriteOptions) -> Result<Box<dyn VoxelSink>>;

impl OutputFormat {
    /// Whether it can be written to a pipe.
    pub fn is_stream(&self) -> bool {
        matches!(self.writer, Writer::Stream(_) | Writer::Octree(_))
    }

    /// Whether this program was built to write it.
    ///
    /// # Errors
    ///
    /// It was not.
    pub fn check_built(&self) -> Result<()> {
        let Writer::NotBuilt = self.writer else { return Ok(()) };
        let feature = self.feature.unwrap_or_default();
        Err(self.refused(&format!("this program was built without it; build with the feature `{feature}`")))
    }

    /// Starts a file of voxels, or a folder where the format is one, at a path of its own. It is whole when the sink is
    /// finished.
    ///
    /// Nothing is renamed, synchronised or removed: who calls does that. A folder must be empty or not there yet.
    ///
    /// # Errors
    ///
    /// A resolution, a box or options that make no sense; a format that this program was built without, or that is not
    /// made of voxels; the system refuses.
    pub fn open(&self, head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Box<dyn VoxelSink>> {
        self.check_built()?;
        check(head)?;
        let sink = match self.writer {
            Writer::Files(open) => open(head, path, options)?,
            Writer::Stream(open) => {
                let file = File::create(path).map_err(|error| Error::io(path, "create", error))?;
                open(head, Box::new(BufWriter::with_capacity(1 << 17, file)), options)?
            }
            _ => return Err(self.refused("is made of a whole map, not of voxels")),
        };
        Ok(Box::new(Counted::new(sink, options.final_path.clone(), head.voxels)))
    }

    /// Starts a stream of voxels; errors name `options.final_path`. Bytes come in small parts: buffer them.
    ///
    /// # Errors
    ///
    /// As for [`OutputFormat::open`]; a format that is not one stream.
    pub fn open_stream<'a>(
        &self,
        head: &VoxelsHead,
        out: impl Write + 'a,
        options: &WriteOptions,
    ) -> Result<Box<dyn VoxelSink + 'a>> {
        check(head)?;
        let Writer::Stream(open) = self.writer else {
            return Err(self.refused("is not a stream of voxels; name a file"));
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
        let reason = format!("{} m is no edge of a voxel", head.resolution_m);
        return Err(Error::argument("resolution", reason));
    }
    let bounds = head.bounds_m.as_flattened();
    if head.voxels > 0 && !bounds.iter().all(|bound| bound.is_finite()) {
        let reason = format!("{:?} is no box around the voxels", head.bounds_m);
        return Err(Error::argument("bounds", reason));
    }
    Ok(())
}

use crate::output::is_standard_output;
use std::path::PathBuf;
use voxtile::space::{Aabb, Point};
use voxtile::{Error, Result};
use voxtile_formats::write::{Origin, OutputFormat, OutputFormats, OutputOption};

/// What an export is asked for. `None` is the default that is named here.
#[derive(Clone, Debug)]
pub struct ExportOptions {
    /// The map: a folder, `FOLDER@SNAPSHOT`, a URL, or a file of OctoMap.
    pub map: PathBuf,
    /// The file or folder to write; `-` is standard output.
    pub output: PathBuf,
    /// The name of a format: that of the output's extension.
    pub format: Option<String>,
    /// The formats that are known.
    pub formats: OutputFormats,
    /// Which voxels are written: the occupied ones; all where a format tells free voxels from unseen ones.
    pub which: Option<WhichVoxels>,
    /// Flat maps: the lowest height that counts, in metres.
    pub z_min_m: Option<f64>,
    /// Flat maps: the greatest height that counts, in metres.
    pub z_max_m: Option<f64>,
    /// Autoware: edge of the square of a file, in whole metres: 20.
    pub cell_m: Option<f64>,
    /// Meshes: positions as numbers of 16 bits (`KHR_mesh_quantization`) in place of 32. Not every program reads them.
    pub is_quantized: bool,
    /// Only voxels whose center is in this box are written.
    pub region: Option<Aabb>,
    /// The file's coordinates are those of the map less this, in metres: 0 0 0. The nearest corner of a voxel counts,
    /// but for Autoware.
    pub origin_m: Option<Point>,
    /// Memory in bytes for the part of an octree file that is put together at a time, beside that of one tile.
    pub memory_bytes: usize,
}

/// Which voxels are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WhichVoxels {
    /// Those from the map's occupancy threshold on.
    Occupied,
    /// Those that were observed and are below it.
    Free,
    /// All that were observed.
    All,
    /// Those of at least this probability, from 0 to 1.
    AtLeast(f64),
}

impl ExportOptions {
    /// A whole map as the output's extension says, with all defaults.
    pub fn new(map: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            map: map.into(),
            output: output.into(),
            format: None,
            formats: OutputFormats::default(),
            which: None,
            z_min_m: None,
            z_max_m: None,
            cell_m: None,
            is_quantized: false,
            region: None,
            origin_m: None,
            memory_bytes: 64 << 20,
        }
    }

    /// The format to write.
    ///
    /// # Errors
    ///
    /// A name or an extension of no known format; one that the options do not fit; one that was not built in.
    pub fn checked_format(&self) -> Result<OutputFormat> {
        let format = self.known_format()?;
        if let Some(WhichVoxels::AtLeast(probability)) = self.which
            && !(0.0..=1.0).contains(&probability)
        {
            return Err(Error::argument("min_probability", "must be from 0 to 1"));
        }
        if is_standard_output(&self.output) && !format.is_stream() {
            let what = if format.extension.is_some() { "file" } else { "folder" };
            let reason = format!("{} is not written as a stream; name a {what}", format.name);
            return Err(Error::argument("output", reason));
        }
        self.check_taken(&format)?;
        format.check_built()?;
        Ok(format)
    }

    fn known_format(&self) -> Result<OutputFormat> {
        let list = |wanted: &dyn Fn(&OutputFormat) -> Option<String>| {
            self.formats.all().iter().filter_map(wanted).collect::<Vec<_>>().join(" ")
        };
        if let Some(name) = &self.format {
            return self.formats.of_name(name).copied().ok_or_else(|| {
                let known = list(&|format| Some(format.name.to_owned()));
                Error::argument("format", format!("`{name}` is no known format; known are {known}"))
            });
        }
        if let Some(format) = self.formats.of_path(&self.output) {
            return Ok(*format);
        }
        let reason = if is_standard_output(&self.output) {
            let known = list(&|format| format.is_stream().then(|| format.name.to_owned()));
            format!("standard output has no extension; add `format`: {known}")
        } else {
            let known = list(&|format| Some(format!(".{}", format.extension?)));
            let output = self.output.display();
            format!("{output}: its extension is of no known format; known are {known}; or add `format`")
        };
        Err(Error::argument("output", reason))
    }

    /// Whether the format takes all options that are given.
    fn check_taken(&self, format: &OutputFormat) -> Result<()> {
        let has_heights = self.z_min_m.is_some() || self.z_max_m.is_some();
        let which = match self.which {
            Some(WhichVoxels::AtLeast(_)) => "min_probability",
            _ => "what",
        };
        let given = [
            (OutputOption::Region, self.region.is_some(), "region"),
            (OutputOption::Which, self.which.is_some(), which),
            (OutputOption::Heights, has_heights, "z_min, z_max"),
            (OutputOption::Cell, self.cell_m.is_some(), "cell"),
            (OutputOption::Quantized, self.is_quantized, "quantize"),
        ];
        let (name, refusal) = (format.name, format.refusal);
        for (option, _, argument) in given.into_iter().filter(|&(_, is_given, _)| is_given) {
            if !format.takes.contains(&option) {
                let takers = self.formats.all().iter().filter(|other| other.takes.contains(&option));
                let takers: Vec<&str> = takers.map(|other| other.name).collect();
                let which = match takers.len() {
                    1..=4 => format!("formats that do: {}; ", takers.join(" ")),
                    _ => String::new(),
                };
                let reason = format!("{name} does not take it; {which}{refusal}");
                return Err(Error::argument(argument, reason));
            }
        }
        if self.origin_m.is_some() && format.origin == Origin::Map {
            let reason = format!("{name} keeps true coordinates; {refusal}");
            return Err(Error::argument("origin", reason));
        }
        Ok(())
    }
}

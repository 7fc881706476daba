use crate::output::is_standard_output;
use std::path::PathBuf;
use voxtile::space::{Aabb, Point};
use voxtile::{Error, Result};
use voxtile_formats::write::{FileUnit, Origin, OutputFormat, OutputFormats, OutputOption};

/// Settings of an export. `None` means the default named here.
#[derive(Clone, Debug)]
pub struct ExportOptions {
    /// Map: a folder, `FOLDER@SNAPSHOT`, a URL, or an OctoMap file.
    pub map: PathBuf,
    /// File or folder to write; `-` is standard output.
    pub output: PathBuf,
    /// Name of the format. Default: the one of the output's extension.
    pub format: Option<String>,
    /// Available formats.
    pub formats: OutputFormats,
    /// Voxels to write. Default: occupied voxels, or all for formats that distinguish free from unobserved voxels.
    pub which: Option<WhichVoxels>,
    /// Whether the map's layers (colours, intensities, classes, times) are written by formats that can store them: a
    /// `.ot` file of a map with colours is a `ColorOcTree`.
    pub with_layers: bool,
    /// Writes the mean of the points that hit a voxel in place of its center. The map needs the layer shape. Voxels
    /// without a hit remain at their center.
    pub mean_points: bool,
    /// Only voxels whose class with most votes is one of these. The map needs the layer class. Default: all.
    pub only_classes: Vec<u8>,
    /// 2D grids: minimum height in metres.
    pub z_min_m: Option<f64>,
    /// 2D grids: maximum height in metres.
    pub z_max_m: Option<f64>,
    /// Autoware: edge of the square of a file, in whole metres. Default: 20.
    pub cell_m: Option<f64>,
    /// Meshes: 16-bit positions (`KHR_mesh_quantization`) instead of 32-bit ones. Not all programs support them.
    pub is_quantized: bool,
    /// Only voxels with their center in this box are written.
    pub region: Option<Aabb>,
    /// Origin of the file's coordinates in the map, in metres, rounded to the nearest voxel corner except for Autoware.
    /// Default: the map's origin.
    pub origin_m: Option<Point>,
    /// Coordinate reference system of the file: well-known text, or `EPSG:2230` if only the code is known. Default:
    /// that of the map.
    pub crs: Option<String>,
    /// Unit of the file. Default: that of `crs`, otherwise metres.
    pub unit: Option<FileUnit>,
    /// Memory in bytes for the part of an octree file being built, in addition to one tile.
    pub memory_bytes: usize,
}

/// Selection of voxels by state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WhichVoxels {
    /// Voxels at or above the map's occupancy threshold.
    Occupied,
    /// Observed voxels below the threshold.
    Free,
    /// All observed voxels.
    All,
    /// Voxels with at least this probability, from 0 to 1.
    AtLeast(f64),
}

impl ExportOptions {
    /// Creates the options to export a whole map with all defaults. The output's extension determines the format.
    pub fn new(map: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            map: map.into(),
            output: output.into(),
            format: None,
            formats: OutputFormats::default(),
            which: None,
            with_layers: true,
            mean_points: false,
            only_classes: Vec::new(),
            z_min_m: None,
            z_max_m: None,
            cell_m: None,
            is_quantized: false,
            region: None,
            origin_m: None,
            crs: None,
            unit: None,
            memory_bytes: 64 << 20,
        }
    }

    /// Returns the format to write.
    ///
    /// # Errors
    ///
    /// The name or extension is unknown, the options do not fit the format, or the format is not available in this
    /// build.
    pub fn checked_format(&self) -> Result<OutputFormat> {
        let format = self.known_format()?;
        if let Some(WhichVoxels::AtLeast(probability)) = self.which
            && !(0.0..=1.0).contains(&probability)
        {
            return Err(Error::argument("min_probability", "must be from 0 to 1"));
        }
        if is_standard_output(&self.output) && !format.is_stream() {
            let what = if format.extension.is_some() { "file" } else { "folder" };
            let reason = format!("{} cannot be written to standard output: use a {what}", format.name);
            return Err(Error::argument("output", reason));
        }
        self.check_taken(&format)?;
        format.check_built()?;
        Ok(format)
    }

    /// Returns the unit of the file.
    ///
    /// # Errors
    ///
    /// The coordinate reference system has another unit, or one that files cannot have.
    pub(super) fn file_unit(&self) -> Result<FileUnit> {
        let Some(crs) = &self.crs else { return Ok(self.unit.unwrap_or_default()) };
        match (FileUnit::of_crs(crs)?, self.unit) {
            (Some(own), Some(unit)) if own != unit => {
                let (unit, own) = (unit.name(), own.name());
                Err(Error::argument(
                    "unit",
                    format!("{unit}, but the unit of {crs:.80} is {own}; omit one of the two"),
                ))
            }
            (own, unit) => Ok(unit.or(own).unwrap_or_default()),
        }
    }

    /// Returns the coordinate reference system of the file.
    ///
    /// # Errors
    ///
    /// The file has another unit than the system of the map.
    pub(super) fn file_crs(&self, of_map: Option<&String>) -> Result<Option<String>> {
        let unit = self.file_unit()?;
        match (&self.crs, of_map) {
            (None, Some(of_map)) if unit != FileUnit::Metre => {
                let reason = format!(
                    "{}, but the coordinate system of the map is in metres ({of_map:.80}); name that of the file with \
                     `crs`",
                    unit.name()
                );
                Err(Error::argument("unit", reason))
            }
            (own, of_map) => Ok(own.as_ref().or(of_map).cloned()),
        }
    }

    fn known_format(&self) -> Result<OutputFormat> {
        let list = |wanted: &dyn Fn(&OutputFormat) -> Option<String>| {
            self.formats.all().iter().filter_map(wanted).collect::<Vec<_>>().join(" ")
        };
        if let Some(name) = &self.format {
            return self.formats.of_name(name).copied().ok_or_else(|| {
                let known = list(&|format| Some(format.name.to_owned()));
                Error::argument("format", format!("`{name}` is an unknown format; known formats: {known}"))
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
            format!("{output}: its extension is unknown; known extensions: {known}; or add `format`")
        };
        Err(Error::argument("output", reason))
    }

    /// Checks that the format supports all given options.
    fn check_taken(&self, format: &OutputFormat) -> Result<()> {
        let has_heights = self.z_min_m.is_some() || self.z_max_m.is_some();
        let which = match self.which {
            Some(WhichVoxels::AtLeast(_)) => "min_probability",
            _ => "what",
        };
        let unit = if self.unit.is_some() { "unit" } else { "crs" };
        let given = [
            (OutputOption::Region, self.region.is_some(), "region"),
            (OutputOption::Which, self.which.is_some(), which),
            (OutputOption::MeanPoints, self.mean_points, "mean_points"),
            (OutputOption::Classes, !self.only_classes.is_empty(), "only_class"),
            (OutputOption::Heights, has_heights, "z_min, z_max"),
            (OutputOption::Cell, self.cell_m.is_some(), "cell"),
            (OutputOption::Quantized, self.is_quantized, "quantize"),
            (OutputOption::Crs, self.crs.is_some(), "crs"),
            (OutputOption::Unit, self.file_unit()? != FileUnit::Metre, unit),
        ];
        let (name, refusal) = (format.name, format.refusal);
        for (option, _, argument) in given.into_iter().filter(|&(_, is_given, _)| is_given) {
            if !format.takes.contains(&option) {
                let takers = self.formats.all().iter().filter(|other| other.takes.contains(&option));
                let takers: Vec<&str> = takers.map(|other| other.name).collect();
                let which = match takers.len() {
                    1..=4 => format!("formats that support it: {}; ", takers.join(" ")),
                    _ => String::new(),
                };
                let reason = format!("{name} does not support it; {which}{refusal}");
                return Err(Error::argument(argument, reason));
            }
        }
        if self.origin_m.is_some() && format.origin == Origin::Map {
            let reason = format!("{name} always has map coordinates; {refusal}");
            return Err(Error::argument("origin", reason));
        }
        Ok(())
    }
}

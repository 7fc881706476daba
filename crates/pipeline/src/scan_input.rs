use crate::input_chain::InputChain;
use crate::kept_source::{KeptSource, is_map};
use crate::new_poses::PoseFile;
use crate::place::url_of;
use crate::scan_place::scans_at;
use crate::watch::Watch;
use std::collections::HashSet;
use std::fmt;
use std::io::{BufReader, stdin};
use std::path::{Path, PathBuf};
use voxtile::scan::Stop;
use voxtile::{Error, Result};
use voxtile_formats::{
    ReadOptions, Registry, Returns, ScanSource, divide_inputs, open_scan_files, open_scans,
    read_scan_stream_with,
};

/// Maximum length of an input name stored in a map, in characters.
const MAX_LETTERS: usize = 200;

/// End of the name of an input of several files.
const OTHERS: &str = " and other files";

/// Returns whether the scans are read from standard input.
pub fn is_standard_input(scans: &Path) -> bool {
    scans == Path::new("-")
}

/// Scans that a map records as one input: a file, a folder, a map, a URL or a stream, or several files of clouds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScanInput {
    first: PathBuf,
    /// Further files of clouds, in order.
    others: Vec<PathBuf>,
}

impl ScanInput {
    /// Creates an input of one path.
    pub fn of(path: impl Into<PathBuf>) -> Self {
        Self { first: path.into(), others: Vec::new() }
    }

    /// Returns the path, unless there are several.
    pub fn path(&self) -> Option<&Path> {
        self.others.is_empty().then_some(&*self.first)
    }

    /// Returns the first path.
    pub fn first(&self) -> &Path {
        &self.first
    }

    /// Returns whether the input can be read again.
    pub fn is_on_disk(&self) -> bool {
        self.first.is_file() || self.first.is_dir()
    }

    /// Returns the name of the input that a map stores: the last component of its path (the last two if it is `scans`),
    /// or the label of a stream. Later files do not change it.
    pub fn name(&self, source: &dyn ScanSource) -> String {
        if is_standard_input(&self.first) {
            return source.fingerprint().unwrap_or_else(|_| "standard input".to_owned());
        }
        self.name_of_paths()
    }

    /// As [`ScanInput::name`], without a label.
    pub fn name_of_paths(&self) -> String {
        let path = self.first.canonicalize().unwrap_or_else(|_| self.first.clone());
        let part = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let last = part(&path).unwrap_or_else(|| self.first.display().to_string());
        let name = match path.parent().and_then(part) {
            Some(parent) if last == "scans" => format!("{parent}/{last}"),
            _ => last,
        };
        if self.others.is_empty() {
            return name.chars().take(MAX_LETTERS).collect();
        }
        name.chars().take(MAX_LETTERS - OTHERS.len()).collect::<String>() + OTHERS
    }

    /// Opens the scans. Standard input must be a scan stream. Waiting for a bucket can be stopped.
    ///
    /// # Errors
    ///
    /// The input cannot be read, the options do not fit it, or [`Error::Stopped`].
    pub fn open(&self, options: &ReadOptions, watch: &Watch) -> Result<Box<dyn ScanSource + Send>> {
        let Some(scans) = self.path() else {
            let paths: Vec<PathBuf> = std::iter::once(&self.first).chain(&self.others).cloned().collect();
            return open_scan_files(&paths, options);
        };
        if options.format.is_none() && is_map(scans, watch.stop())? {
            if !options.classes.is_everything() || options.returns != Returns::All {
                let reason =
                    format!("{} is a map; its kept scans have no classes and returns", scans.display());
                return Err(Error::argument("only_class, skip_class, returns", reason));
            }
            let source = KeptSource::open(scans, PoseFile::of_reading(options).as_ref())?;
            return Ok(options.selection.clone().of(Box::new(source)));
        }
        if let Some(url) = url_of(scans) {
            return scans_at(url, options, watch);
        }
        if !is_standard_input(scans) {
            return open_scans(scans, options);
        }
        if options.poses.is_some() {
            return Err(Error::argument("poses", "a scan stream has its own poses; omit the option"));
        }
        let input = BufReader::with_capacity(1 << 18, stdin());
        let stream = read_scan_stream_with(input, Path::new("standard input"), false, options)?;
        Ok(options.selection.clone().of(Box::new(stream)))
    }
}

impl fmt::Display for ScanInput {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let first = self.first.display();
        match self.others.len() {
            0 => write!(formatter, "{first}"),
            1 => write!(formatter, "{first} and another file"),
            others => write!(formatter, "{first} and {others} other files"),
        }
    }
}

/// Inputs that were given together, in order. There is at least one.
#[derive(Clone, Debug)]
pub struct ScanInputs {
    inputs: Vec<ScanInput>,
    /// Remarks on paths that were left out.
    remarks: Vec<String>,
}

impl ScanInputs {
    /// Divides paths into inputs: consecutive files of clouds of one format and folder are one input, see
    /// [`divide_inputs`].
    ///
    /// # Errors
    ///
    /// A path does not exist, cannot be read, is given twice, or is standard input and there are others.
    pub fn of(paths: &[PathBuf], options: &ReadOptions, stop: &Stop) -> Result<Self> {
        if let [path] = paths {
            return Ok(Self::from(ScanInput::of(path)));
        }
        check_together(paths, stop)?;
        let divided = divide_inputs(paths, options)?;
        let left_out = divided.left_out.iter();
        let remarks = left_out.map(|path| format!("{} is not a cloud and was left out", path.display()));
        let inputs = divided.inputs.into_iter().filter_map(|paths| {
            let mut paths = paths.into_iter();
            Some(ScanInput { first: paths.next()?, others: paths.collect() })
        });
        let found = Self { inputs: inputs.collect(), remarks: remarks.collect() };
        match found.inputs.is_empty() {
            true => Err(Error::argument("SCANS", "none of the given files has scans")),
            false => Ok(found),
        }
    }

    /// Returns the inputs.
    pub fn inputs(&self) -> &[ScanInput] {
        &self.inputs
    }

    /// Returns the inputs to change them.
    #[cfg(feature = "bucket")]
    pub(crate) fn inputs_mut(&mut self) -> &mut [ScanInput] {
        &mut self.inputs
    }

    /// Returns remarks for the user on paths that were left out.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// Opens the scans of all inputs, one input after the other.
    ///
    /// # Errors
    ///
    /// As for [`ScanInput::open`].
    pub fn open(&self, options: &ReadOptions, watch: &Watch) -> Result<Box<dyn ScanSource + Send>> {
        match &self.inputs[..] {
            [input] if self.remarks.is_empty() => input.open(options, watch),
            _ => {
                let chain = InputChain::open(self, options, watch)?;
                Ok(options.selection.clone().of(Box::new(chain)))
            }
        }
    }
}

impl From<ScanInput> for ScanInputs {
    fn from(input: ScanInput) -> Self {
        Self { inputs: vec![input], remarks: Vec::new() }
    }
}

/// Checks paths that are given together, before any of them is read.
fn check_together(paths: &[PathBuf], stop: &Stop) -> Result<()> {
    if paths.is_empty() {
        return Err(Error::argument("SCANS", "there are none: give a file or a folder"));
    }
    let registry = Registry::default();
    let mut places = HashSet::new();
    for path in paths {
        let wrong = |reason: &str| Error::argument(path.display().to_string(), reason);
        if is_standard_input(path) {
            return Err(wrong("standard input cannot be combined with other inputs"));
        }
        let place = path.canonicalize();
        if place.is_err() && url_of(path).is_none() && !is_map(path, stop)? {
            // The error names what is missing.
            registry.guess(path, &[])?;
        }
        if !places.insert(place.unwrap_or_else(|_| path.clone())) {
            return Err(wrong("is given twice: its scans would count twice"));
        }
    }
    Ok(())
}

/// Opens the scans of paths, as [`ScanInputs::open`].
///
/// # Errors
///
/// As for [`ScanInputs::of`] and [`ScanInputs::open`].
pub fn open_paths(
    paths: &[PathBuf],
    options: &ReadOptions,
    watch: &Watch,
) -> Result<Box<dyn ScanSource + Send>> {
    ScanInputs::of(paths, options, watch.stop())?.open(options, watch)
}

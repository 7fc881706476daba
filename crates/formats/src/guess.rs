use crate::input_format::{Detection, InputFormat, Open};
use crate::read::foreign;
use crate::read::glance::first_bytes;
use crate::read::listing::{Listing, extension_of};
use crate::read::pcd_scans;
use crate::read_options::ReadOptions;
use crate::registry::Registry;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

impl Registry {
    /// Detects the format of a file or folder from its content, then from its name. In a folder, files listed in
    /// `not_clouds` are ignored.
    ///
    /// # Errors
    ///
    /// The path cannot be read, its format is unknown, or the format must be converted first.
    pub fn guess(&self, path: &Path, not_clouds: &[PathBuf]) -> Result<&InputFormat> {
        let meta = std::fs::metadata(path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => argument(path, why_missing(path)),
            _ => Error::io(path, "open", error),
        })?;
        if meta.is_dir() { self.guess_folder(path, not_clouds) } else { self.guess_file(path) }
    }

    /// Returns the path to read and its format. If `path` has a subfolder `scans` with the clouds, that subfolder is
    /// the path.
    pub(crate) fn find(&self, path: &Path, options: &ReadOptions) -> Result<(PathBuf, &InputFormat)> {
        let named = options.format.as_deref().map(|name| self.named(name)).transpose()?;
        let not_clouds = options.not_clouds();
        let inner = path.join("scans");
        let packed = self.packed_recording(path).map(|format| format.name);
        if named.is_some_and(|named| packed != Some(named.name)) && path.is_file() {
            // Archives are rejected by their content, whatever format was requested.
            if let Some(archive) = foreign::archive_of(&first_bytes(path)?) {
                return Err(archive.error(path));
            }
        }
        if !inner.is_dir() {
            return Ok((path.to_owned(), named.map_or_else(|| self.guess(path, &not_clouds), Ok)?));
        }
        let pcd = self.named("pcd")?;
        let is_pcd =
            |folder| named.is_none_or(|named| named.name == pcd.name) && pcd_scans::is_folder(folder);
        // A folder of PCD files often contains unrelated text files.
        if !is_pcd(path) && is_pcd(&inner) {
            return Ok((inner, pcd));
        }
        match (self.guess(path, &not_clouds), named) {
            (Ok(guessed), named) => Ok((path.to_owned(), named.unwrap_or(guessed))),
            (Err(_), Some(named)) => Ok((inner, named)),
            (Err(_), None) => self.guess(&inner, &not_clouds).map(|format| (inner.clone(), format)),
        }
    }

    /// Returns the format that has this signature at the start of the file, if any.
    pub(crate) fn of_start(&self, start: &[u8]) -> Option<&InputFormat> {
        let start = foreign::without_bom(start);
        self.formats().iter().find(|format| match format.detection {
            Detection::Start(is_it) | Detection::StartOrName(is_it) => is_it(start),
            _ => false,
        })
    }

    fn guess_file(&self, path: &Path) -> Result<&InputFormat> {
        let extension = extension_of(path);
        let of = |is_it: fn(&Detection) -> bool| {
            let mut formats = self.formats().iter();
            formats.find(|format| is_it(&format.detection) && format.has_extension(&extension))
        };
        if let Some(named) = of(|detection| matches!(detection, Detection::Name)) {
            return Ok(named);
        }
        let start = first_bytes(path)?;
        if start.is_empty() {
            return Err(argument(path, "the file is empty"));
        }
        if let Some(known) = self.of_start(&start).or_else(|| self.packed_recording(path)) {
            return Ok(known);
        }
        if let Some(foreign) = foreign::of_bytes(&start) {
            return Err(foreign.error(path));
        }
        if let Some(named) = of(|detection| matches!(detection, Detection::StartOrName(_))) {
            return Ok(named);
        }
        if let Some(foreign) = foreign::of_extension(&extension) {
            return Err(foreign.error(path));
        }
        let mut why_not = None;
        for format in self.formats() {
            let Detection::Look(check) = format.detection else { continue };
            let is_named = format.has_extension(&extension);
            match check(&start, is_named) {
                Ok(()) => return Ok(format),
                Err(reason) if is_named => why_not = Some((format.title, reason)),
                Err(_) => {}
            }
        }
        let beginning = foreign::beginning_of(&start);
        Err(match (why_not, of(|_| true)) {
            (Some((title, reason)), _) => argument(path, format!("is not a valid {title}: {reason}")),
            (None, Some(_)) => argument(
                path,
                format!(
                    "has the extension .{extension}, but its content is not of that format: is it damaged?{beginning}"
                ),
            ),
            _ => argument(
                path,
                format!("has an unknown format{beginning}; known formats: {}", self.names(", ")),
            ),
        })
    }

    fn guess_folder(&self, path: &Path, not_clouds: &[PathBuf]) -> Result<&InputFormat> {
        if let Some(format) = self.formats().iter().find(|format| (format.is_folder)(path)) {
            return Ok(format);
        }
        let listing = Listing::read(path, not_clouds)?;
        let mut counts = BTreeMap::new();
        for file in listing.clouds() {
            let format = self.in_folder(&extension_of(file)).or_else(|| self.packed_recording(file));
            if let Some(format) = format {
                counts.entry(format.name).or_insert((format, file, 0_u64)).2 += 1;
            }
        }
        // Text files and pictures often accompany clouds, so their formats are removed while others are present. If
        // only text files and pictures remain, the pictures are the input if camera intrinsics are known.
        let mut aside: Vec<&str> =
            self.formats().iter().filter(|format| format.is_aside).map(|format| format.name).collect();
        if !listing.has_depths() {
            aside.reverse();
        }
        for name in aside {
            if counts.len() > 1 {
                counts.remove(name);
            }
        }
        let mut found = counts.values();
        match (found.next(), found.next()) {
            (Some((format, ..)), None) if matches!(format.open, Open::Folder(_)) => Ok(format),
            (Some((format, ..)), None) if matches!(format.detection, Detection::Look(_)) => {
                let texts = listing.texts(format);
                match texts.clouds.first() {
                    Some(file) => self.guess_file(file),
                    None => Err(argument(path, listing.why_nothing(&self.names(", "), &texts.others))),
                }
            }
            // The first file distinguishes LAS from LAZ; this also reports a damaged file early.
            (Some((_, file, _)), None) => self.guess_file(file),
            (Some((one, _, count)), Some((other, _, others))) => {
                let (one, other) = (one.name, other.name);
                let reason = format!(
                    "contains files of format {one} ({count}) and of format {other} ({others}); select one with `format`"
                );
                Err(argument(path, reason))
            }
            (None, _) => Err(argument(path, listing.why_nothing(&self.names(", "), &[]))),
        }
    }

    /// Returns the format of a recording that is compressed as a whole, such as `a.mcap.zstd`.
    fn packed_recording(&self, path: &Path) -> Option<&InputFormat> {
        let is_packed = matches!(extension_of(path).as_str(), "zst" | "zstd");
        let inner = extension_of(Path::new(path.file_stem().filter(|_| is_packed)?));
        let is_it = |format: &&InputFormat| {
            ["bag", "mcap", "db3"].contains(&format.name) && format.has_extension(&inner)
        };
        self.formats().iter().find(is_it)
    }

    /// Returns the format of files with this extension (lower case) in a folder of clouds.
    fn in_folder(&self, extension: &str) -> Option<&InputFormat> {
        let may_be = |format: &&InputFormat| {
            !matches!(format.detection, Detection::Name) && format.has_extension(extension)
        };
        self.formats().iter().find(may_be)
    }
}

fn argument(path: &Path, reason: impl Into<String>) -> Error {
    Error::argument(path.display().to_string(), reason)
}

/// Returns the error text for a path that does not exist.
fn why_missing(path: &Path) -> String {
    match std::fs::read_link(path) {
        Err(_) => "there is no such file or folder".to_owned(),
        Ok(target) if target.to_string_lossy().contains(".git/annex/") => {
            "is a git-annex link to a file that was not downloaded: get it with `git annex get`".to_owned()
        }
        Ok(target) => format!("is a link to {}, which does not exist", target.display()),
    }
}

use super::target::{TargetKind, check_target, folder_of, is_standard_output, sync_folder, target_kind};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use voxtile::scan::Stop;
use voxtile::{Error, Result};

/// A file that is written atomically.
///
/// The bytes go to a uniquely named temporary file next to the target, which is renamed to the target at the end.
/// Therefore two commands with the same target leave the complete file of one of them, symbolic links are never
/// followed, and the remains of a killed program do not block others.
///
/// Standard output (`-`), a pipe or a device cannot be renamed: it receives all bytes at the end, from a temporary
/// file.
#[derive(Debug)]
pub struct OutputFile {
    target: PathBuf,
    out: Out,
}

/// Writer that fails once it is stopped.
#[derive(Debug)]
struct Out {
    bytes: BufWriter<Unfinished>,
    stop: Stop,
}

#[derive(Debug)]
enum Unfinished {
    /// Next to the target.
    Named(NamedTempFile),
    /// Unnamed; copied to the target at the end.
    Copied(File),
}

impl OutputFile {
    /// Creates the temporary file.
    ///
    /// # Errors
    ///
    /// The target is a symbolic link, a folder or within a map, or the folder is not writable.
    pub fn create(target: &Path) -> Result<Self> {
        let unfinished = match target_kind(target)? {
            TargetKind::File => named_temporary(target).map(Unfinished::Named),
            TargetKind::Stream => tempfile::tempfile().map(Unfinished::Copied),
        };
        let unfinished = unfinished.map_err(|error| Error::io(target, "create", error))?;
        let out = Out { bytes: BufWriter::with_capacity(1 << 18, unfinished), stop: Stop::default() };
        Ok(Self { target: target.to_owned(), out })
    }

    /// Checks that an image file can be created at a path. Standard output is not possible, because it is used for the
    /// summary.
    ///
    /// # Errors
    ///
    /// As for [`OutputFile::create`]. Also fails for standard output.
    pub fn check_picture(target: &Path) -> Result<()> {
        if is_standard_output(target) {
            return Err(Error::argument(
                "output",
                "an image needs an output file, because standard output is used for the summary",
            ));
        }
        check_target(target).map(drop)
    }

    /// Makes writes fail once the stop is set.
    pub fn stop_with(mut self, stop: Stop) -> Self {
        self.out.stop = stop;
        self
    }

    /// Returns the writer. Its errors do not name the file; see [`OutputFile::written`].
    pub fn out(&mut self) -> &mut impl Write {
        &mut self.out
    }

    /// Adds the name of the file to an error.
    ///
    /// # Errors
    ///
    /// The error of `result`.
    pub fn written<T>(&self, result: io::Result<T>) -> Result<T> {
        result.map_err(|error| Error::io(&self.target, "write", error))
    }

    /// Returns the hash of all bytes written so far.
    ///
    /// # Errors
    ///
    /// An I/O error occurs.
    pub fn hash(&mut self) -> Result<blake3::Hash> {
        let mut hasher = blake3::Hasher::new();
        let bytes = &mut self.out.bytes;
        let hashed = bytes.flush().and_then(|()| {
            let file = bytes.get_mut().file();
            file.rewind()?;
            // Reading to the end restores the write position.
            io::copy(file, &mut hasher)
        });
        self.written(hashed)?;
        Ok(hasher.finalize())
    }

    /// Renames the file to the target and syncs it, or copies it to standard output or a pipe.
    ///
    /// # Errors
    ///
    /// An I/O error occurs. The target is then unchanged, unless only the sync of its folder failed.
    pub fn finish(self) -> anyhow::Result<()> {
        let Self { target, out } = self;
        let refused = |error| Error::io(&target, "write", error);
        match out.bytes.into_inner().map_err(|error| refused(error.into_error()))? {
            Unfinished::Named(file) => {
                file.as_file().sync_all().map_err(refused)?;
                // Check again: the target may have been created in the meantime.
                check_target(&target)?;
                file.persist(&target).map_err(|error| Error::io(&target, "replace", error.error))?;
                let synced = sync_folder(folder_of(&target));
                Ok(synced.map_err(|error| Error::io(&target, "make durable", error))?)
            }
            Unfinished::Copied(file) if is_standard_output(&target) => {
                // Without the file name: the caller handles a closed pipe.
                Ok(copy(file, &mut io::stdout().lock())?)
            }
            Unfinished::Copied(file) => {
                let mut stream = File::options().write(true).open(&target).map_err(refused)?;
                Ok(copy(file, &mut stream).map_err(refused)?)
            }
        }
    }
}

impl Write for Out {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stop.check().map_err(io::Error::other)?;
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.bytes.flush()
    }
}

impl Unfinished {
    fn file(&mut self) -> &mut File {
        match self {
            Self::Named(file) => file.as_file_mut(),
            Self::Copied(file) => file,
        }
    }
}

impl Write for Unfinished {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Creates an unnamed temporary file for intermediate data, in the target's folder if the target is a file.
///
/// # Errors
///
/// The target is invalid as for [`OutputFile::create`], or the folder is not writable.
pub fn scratch_for(target: &Path) -> Result<File> {
    let file = match target_kind(target)? {
        TargetKind::File => tempfile::tempfile_in(folder_of(target)),
        TargetKind::Stream => tempfile::tempfile(),
    };
    file.map_err(|error| Error::io(target, "create a temporary file next to", error))
}

fn named_temporary(target: &Path) -> io::Result<NamedTempFile> {
    let mut prefix = target.file_name().unwrap_or_default().to_owned();
    prefix.push(".");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part");
    // The umask determines the permissions, as for any new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(target))
}

fn copy(mut from: File, to: &mut impl Write) -> io::Result<()> {
    from.rewind()?;
    io::copy(&mut from, to)?;
    to.flush()
}

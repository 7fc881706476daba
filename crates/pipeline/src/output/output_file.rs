use super::target::{Place, check_target, folder_of, is_standard_output, place_of, sync_folder};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use voxtile::scan::Stop;
use voxtile::{Error, Result};

/// A file that appears whole or not at all.
///
/// Its bytes go to a file of their own beside the target, with a name that nothing else has, which takes the target's
/// name at the end. So two commands that write to one name leave the whole file of one of them, a link is never
/// followed, and what a killed program leaves is in no other's way.
///
/// Standard output (`-`), a pipe or a device has no name to take: it gets all bytes at the end, from a temporary file.
#[derive(Debug)]
pub struct OutputFile {
    target: PathBuf,
    out: Out,
}

/// Takes bytes until it is asked to stop.
#[derive(Debug)]
struct Out {
    bytes: BufWriter<Unfinished>,
    stop: Stop,
}

#[derive(Debug)]
enum Unfinished {
    /// Beside its place.
    Named(NamedTempFile),
    /// Without a name, until it is copied to where it goes.
    Copied(File),
}

impl OutputFile {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// A link, a folder, a place inside of a map; a folder that refuses.
    pub fn create(target: &Path) -> Result<Self> {
        let unfinished = match place_of(target)? {
            Place::File => named_beside(target).map(Unfinished::Named),
            Place::Stream => tempfile::tempfile().map(Unfinished::Copied),
        };
        let unfinished = unfinished.map_err(|error| Error::io(target, "create", error))?;
        let out = Out { bytes: BufWriter::with_capacity(1 << 18, unfinished), stop: Stop::default() };
        Ok(Self { target: target.to_owned(), out })
    }

    /// Whether a file can be made at a path. Standard output, which has the summary, is none.
    ///
    /// # Errors
    ///
    /// As for [`OutputFile::create`]; standard output.
    pub fn check_picture(target: &Path) -> Result<()> {
        if is_standard_output(target) {
            return Err(Error::argument(
                "output",
                "a picture needs a file: standard output is for the summary",
            ));
        }
        check_target(target).map(drop)
    }

    /// Once the stop is set, writing fails.
    pub fn stop_with(mut self, stop: Stop) -> Self {
        self.out.stop = stop;
        self
    }

    /// What the bytes go to; its errors do not name the file, [`OutputFile::written`] does.
    pub fn out(&mut self) -> &mut impl Write {
        &mut self.out
    }

    /// The result of writing, with the name of the file.
    ///
    /// # Errors
    ///
    /// That of the result.
    pub fn written<T>(&self, result: io::Result<T>) -> Result<T> {
        result.map_err(|error| Error::io(&self.target, "write", error))
    }

    /// The hash of all that was written so far.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn hash(&mut self) -> Result<blake3::Hash> {
        let mut hasher = blake3::Hasher::new();
        let bytes = &mut self.out.bytes;
        let hashed = bytes.flush().and_then(|()| {
            let file = bytes.get_mut().file();
            file.rewind()?;
            // To the end, where writing goes on.
            io::copy(file, &mut hasher)
        });
        self.written(hashed)?;
        Ok(hasher.finalize())
    }

    /// Gives the file its name, durably; or sends all of it to where it goes.
    ///
    /// # Errors
    ///
    /// A disk that refuses: what had the name has it still. Only the very last step, to make the name durable, can fail
    /// when the file has it.
    pub fn finish(self) -> anyhow::Result<()> {
        let Self { target, out } = self;
        let refused = |error| Error::io(&target, "write", error);
        match out.bytes.into_inner().map_err(|error| refused(error.into_error()))? {
            Unfinished::Named(file) => {
                file.as_file().sync_all().map_err(refused)?;
                // Again, for what has come to be there meanwhile.
                check_target(&target)?;
                file.persist(&target).map_err(|error| Error::io(&target, "replace", error.error))?;
                let synced = sync_folder(folder_of(&target));
                Ok(synced.map_err(|error| Error::io(&target, "make durable", error))?)
            }
            Unfinished::Copied(file) if is_standard_output(&target) => {
                // As it is: `main` knows a reader that has seen enough.
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

/// A file without a name for what is put together on the way to `target`, on the same disk where that is a file. It is
/// gone with the process.
///
/// # Errors
///
/// A target that is none, as for [`OutputFile::create`]; a folder that refuses.
pub fn scratch_for(target: &Path) -> Result<File> {
    let file = match place_of(target)? {
        Place::File => tempfile::tempfile_in(folder_of(target)),
        Place::Stream => tempfile::tempfile(),
    };
    file.map_err(|error| Error::io(target, "create a temporary file beside", error))
}

fn named_beside(target: &Path) -> io::Result<NamedTempFile> {
    let mut prefix = target.file_name().unwrap_or_default().to_owned();
    prefix.push(".");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part");
    // As for any file that a program makes: the user's umask decides who may read it.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(target))
}

fn copy(mut from: File, to: &mut impl Write) -> io::Result<()> {
    from.rewind()?;
    io::copy(&mut from, to)?;
    to.flush()
}

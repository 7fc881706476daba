use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use voxtile::scan::Stop;
use voxtile::store::check_outside_of_maps;
use voxtile::{Error, Result};

/// A file that a command makes: it is there whole or not at all.
///
/// Its bytes go to a file of their own beside the target, with a name that nothing else has, which takes the target's
/// name at the end. So two commands that write to one name leave the whole file of one of them, a link is never
/// followed, and what a killed command leaves is in nobody's way.
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

/// Whether a path stands for standard output.
pub fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

/// What a path names that is to be written to.
enum Place {
    File,
    Stream,
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
    pub fn written<T>(&self, result: io::Result<T>) -> Result<T> {
        result.map_err(|error| Error::io(&self.target, "write", error))
    }

    /// The hash of all that was written so far.
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
pub fn scratch_for(target: &Path) -> Result<File> {
    let file = match place_of(target)? {
        Place::File => tempfile::tempfile_in(folder_of(target)),
        Place::Stream => tempfile::tempfile(),
    };
    file.map_err(|error| Error::io(target, "create a temporary file beside", error))
}

/// Whether a picture can be made at a path; what goes to standard output is the summary.
pub fn check_picture(target: &Path) -> Result<()> {
    if is_standard_output(target) {
        return Err(Error::argument(
            "--output",
            "a picture needs a file: standard output is for the summary",
        ));
    }
    check_target(target).map(drop)
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

fn place_of(target: &Path) -> Result<Place> {
    if is_standard_output(target) {
        return Ok(Place::Stream);
    }
    check_target(target)
}

fn check_target(target: &Path) -> Result<Place> {
    let reason = match fs::symlink_metadata(target) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(Error::io(target, "look at", error)),
        Ok(metadata) if metadata.is_file() => None,
        Ok(metadata) if metadata.is_dir() => Some("is a folder; name a file in it"),
        Ok(metadata) if metadata.is_symlink() => Some(
            "is a symbolic link, and links are not followed; name the file itself, or - for standard output",
        ),
        // A pipe or a device.
        Ok(_) => return Ok(Place::Stream),
    };
    if target.file_name().is_none() {
        return Err(Error::argument("--output", format!("{} is no name of a file", target.display())));
    }
    match reason {
        Some(reason) => Err(Error::argument("--output", format!("{} {reason}", target.display()))),
        None => check_outside_of_maps(target).map(|()| Place::File),
    }
}

fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn copy(mut from: File, to: &mut impl Write) -> io::Result<()> {
    from.rewind()?;
    io::copy(&mut from, to)?;
    to.flush()
}

fn sync_folder(folder: &Path) -> io::Result<()> {
    // Only Unix lets a folder be opened and synced, and who may write to it need not be allowed to read it.
    match File::open(folder) {
        Ok(folder) if cfg!(unix) => folder.sync_all(),
        _ => Ok(()),
    }
}

/// A file or a folder that another library writes under its own name, and files beside it: in a folder of its own until
/// all of it is whole.
pub struct StagedOutput {
    target: PathBuf,
    staging: tempfile::TempDir,
}

impl StagedOutput {
    /// Begins an output.
    ///
    /// # Errors
    ///
    /// A link, a place inside of a map; a folder that is not empty; a folder that refuses.
    pub fn beside(target: &Path) -> Result<Self> {
        check_staged_target(target)?;
        let staging = tempfile::Builder::new().prefix(".voxtile-").tempdir_in(folder_of(target));
        let staging = staging.map_err(|error| Error::io(target, "create", error))?;
        Ok(Self { target: target.to_owned(), staging })
    }

    /// Where all of it is written.
    pub fn folder(&self) -> &Path {
        self.staging.path()
    }

    /// Where the output itself is written.
    ///
    /// # Errors
    ///
    /// A path without a name.
    pub fn path(&self) -> Result<PathBuf> {
        let name = self.target.file_name().ok_or_else(|| Error::argument("--output", "has no name"))?;
        Ok(self.folder().join(name))
    }

    /// Gives everything its name, durably, the output itself last. Returns the files beside it.
    ///
    /// # Errors
    ///
    /// A name that something else has: then all of it is as it was. A disk that refuses.
    pub fn finish(self) -> Result<Vec<PathBuf>> {
        let own = self.path()?;
        let folder = folder_of(&self.target);
        let beside = self.beside_output(&own)?;
        let name_of = |from: &Path| from.file_name().map_or(self.target.clone(), |name| folder.join(name));
        let mut names: Vec<PathBuf> = beside.iter().map(|from| name_of(from)).collect();
        // All before the first gets its name.
        for (from, to) in beside.iter().zip(&names) {
            check_staged(from, to)?;
            self.check_beside(from, to)?;
        }
        names.push(name_of(&own));
        check_staged(&own, &self.target)?;
        for (from, to) in beside.iter().chain([&own]).zip(&names) {
            take_name(from, to).map_err(|error| Error::io(to, "replace", error))?;
        }
        names.pop();
        sync_folder(folder).map_err(|error| Error::io(&self.target, "make durable", error))?;
        Ok(names)
    }

    /// What was written beside the output itself, in order.
    fn beside_output(&self, own: &Path) -> Result<Vec<PathBuf>> {
        let list = fs::read_dir(self.folder()).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let list = list.map_err(|error| Error::io(self.folder(), "list", error))?;
        let mut beside: Vec<PathBuf> =
            list.iter().map(fs::DirEntry::path).filter(|path| path != own).collect();
        beside.sort_unstable();
        Ok(beside)
    }

    /// Nobody has named the files beside an output. One that is there belongs to an earlier output of this name, or
    /// is what an export left that was killed, or is of somebody else.
    fn check_beside(&self, from: &Path, to: &Path) -> Result<()> {
        if self.target.exists() || !to.exists() || is_same(from, to)? {
            return Ok(());
        }
        let hint =
            "a file beside the output needs this name; move or remove what has it, or name another output";
        Err(Error::AlreadyExists { path: to.to_owned(), hint })
    }
}

/// Whether two files have the same content.
fn is_same(a: &Path, b: &Path) -> Result<bool> {
    let len = |path: &Path| {
        fs::metadata(path).map(|metadata| metadata.len()).map_err(|error| Error::io(path, "look at", error))
    };
    let content = |path: &Path| fs::read(path).map_err(|error| Error::io(path, "read", error));
    Ok(len(a)? == len(b)? && content(a)? == content(b)?)
}

/// Makes a file or folder durable that is about to get a name.
fn check_staged(from: &Path, to: &Path) -> Result<()> {
    sync_all(from).map_err(|error| Error::io(from, "make durable", error))?;
    if to.is_dir() && !from.is_dir() {
        let reason = "is a folder, and a file needs its name; name another output, or remove it first";
        return Err(Error::argument(to.display().to_string(), reason));
    }
    check_staged_target(to)
}

fn take_name(from: &Path, to: &Path) -> io::Result<()> {
    if from.is_dir() && to.is_dir() {
        fs::remove_dir(to)?;
    }
    fs::rename(from, to)
}

/// A new file, a file that is replaced, or an empty folder.
fn check_staged_target(target: &Path) -> Result<()> {
    if !target.is_dir() {
        return match check_target(target)? {
            Place::File => Ok(()),
            Place::Stream => {
                let reason = format!("{} is no regular file", target.display());
                Err(Error::argument("--output", reason))
            }
        };
    }
    let is_empty = std::fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_none());
    if is_empty {
        return Ok(());
    }
    let reason = "is a folder with content; name another, or remove it first";
    Err(Error::argument(target.display().to_string(), reason))
}

/// Makes a file durable, or a folder with its files.
fn sync_all(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        for entry in std::fs::read_dir(path)? {
            sync_all(&entry?.path())?;
        }
        return sync_folder(path);
    }
    File::open(path)?.sync_all()
}

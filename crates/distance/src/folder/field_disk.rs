use std::fmt;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// Beginning of the names of unfinished files.
pub(super) const UNFINISHED: &str = ".voxtile-";

/// Operations on the files of a field. Tests replace it to make them fail.
pub(super) trait FieldDisk: fmt::Debug + Send + Sync {
    fn create_folder(&self, path: &Path) -> io::Result<()>;

    fn list(&self, folder: &Path) -> io::Result<Vec<String>>;

    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// Creates an unfinished file, which is removed unless it is renamed.
    fn create(&self, folder: &Path) -> io::Result<NamedTempFile>;

    fn write(&self, file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()>;

    /// Syncs a file or a folder.
    fn sync(&self, path: &Path) -> io::Result<()>;

    fn rename(&self, file: NamedTempFile, to: &Path) -> io::Result<()>;

    fn remove(&self, path: &Path) -> io::Result<()>;
}

/// The file system.
#[derive(Debug)]
pub(super) struct FsDisk;

impl FieldDisk for FsDisk {
    fn create_folder(&self, path: &Path) -> io::Result<()> {
        fs::create_dir_all(path)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<String>> {
        fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned())).collect()
    }

    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        fs::read(path)
    }

    fn create(&self, folder: &Path) -> io::Result<NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(UNFINISHED);
        // The umask determines the permissions, as for any new file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(folder)
    }

    fn write(&self, file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()> {
        file.write_all(bytes)
    }

    fn sync(&self, path: &Path) -> io::Result<()> {
        // Only Unix opens folders.
        if cfg!(unix) || path.is_file() {
            File::options().read(true).write(path.is_file()).open(path)?.sync_all()
        } else {
            Ok(())
        }
    }

    fn rename(&self, file: NamedTempFile, to: &Path) -> io::Result<()> {
        file.persist(to)?;
        Ok(())
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }
}

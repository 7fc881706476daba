use std::fs::File;
use std::path::Path;
use voxtile::scan::Pose;
use voxtile::{Error, Result};

/// Fingerprint of an input; see [`ScanSource::fingerprint`](super::ScanSource::fingerprint).
#[derive(Default)]
pub(crate) struct Fingerprint {
    hasher: blake3::Hasher,
    files: u64,
    bytes: u64,
}

impl Fingerprint {
    pub(crate) fn of_file(path: &Path) -> Result<String> {
        let mut fingerprint = Self::default();
        fingerprint.add_file(path)?;
        Ok(fingerprint.finish())
    }

    pub(crate) fn add_file(&mut self, path: &Path) -> Result<()> {
        let bytes = self.add_content(path).map_err(|error| Error::io(path, "read", error))?;
        self.hasher.update(path.file_name().unwrap_or_default().as_encoded_bytes());
        self.hasher.update(&[0]);
        self.hasher.update(&bytes.to_le_bytes());
        self.files += 1;
        self.bytes += bytes;
        Ok(())
    }

    pub(crate) fn add_pose(&mut self, world_from_sensor: &Pose) {
        for value in world_from_sensor.isometry().to_homogeneous().iter() {
            self.hasher.update(&value.to_bits().to_le_bytes());
        }
    }

    pub(crate) fn finish(self) -> String {
        let hash = &self.hasher.finalize().to_hex()[..32];
        let files = if self.files == 1 { "file" } else { "files" };
        format!("{} {files}, {} bytes, blake3 {hash}", self.files, self.bytes)
    }

    fn add_content(&mut self, path: &Path) -> std::io::Result<u64> {
        let file = File::open(path)?;
        let bytes = file.metadata()?.len();
        self.hasher.update_reader(file)?;
        Ok(bytes)
    }
}

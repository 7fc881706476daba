use crate::files::{save_layer, set_aside};
use crate::reports::{Kind, Reports};
use crate::robot_name::RobotName;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use voxtile::space::Grid;
use voxtile_share::{VoxelSet, read_layer_within};

/// File of a robot's layer.
pub struct LayerStore {
    path: PathBuf,
    /// Whether the file could neither be read nor renamed. It is then never overwritten.
    is_kept: bool,
    /// Digest of the content of the file.
    saved: Option<String>,
}

/// Limits of a loaded layer.
#[derive(Clone, Copy)]
pub struct LayerLimits {
    pub grid: Option<Grid>,
    pub max_voxels: u64,
    pub max_bytes: usize,
}

impl LayerStore {
    pub fn new(folder: &Path, robot: &RobotName) -> Self {
        Self { path: folder.join(format!("{robot}.layer")), is_kept: false, saved: None }
    }

    /// Returns the last saved layer. Renames an unreadable file, so that a person can examine it.
    pub fn load(
        &mut self,
        robot: &RobotName,
        limits: LayerLimits,
        reports: &mut Reports,
    ) -> Option<VoxelSet> {
        let reason = match self.read(limits) {
            Ok(layer) => return layer,
            Err(error) => format!("{error:#}"),
        };
        match set_aside(&self.path) {
            Ok(aside) => reports.report(robot, Kind::Read, || {
                format!(
                    "{reason}; file kept as {}, the layer is requested from the robot again",
                    aside.display()
                )
            }),
            Err(error) => {
                self.is_kept = true;
                reports.report(robot, Kind::Read, || {
                    format!("{reason}; cannot rename the file ({error}): this robot's layer is not saved")
                });
            }
        }
        None
    }

    fn read(&mut self, limits: LayerLimits) -> anyhow::Result<Option<VoxelSet>> {
        let file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => anyhow::bail!("{}: cannot open the layer: {error}", self.path.display()),
        };
        let mut layer = read_layer_within(&mut BufReader::new(file), limits.max_voxels, limits.max_bytes)
            .map_err(|error| error.in_input(&self.path))?;
        if let Some(grid) = limits.grid.filter(|grid| grid != layer.grid()) {
            let (theirs, ours) = (crate::files::lengths(layer.grid()), crate::files::lengths(&grid));
            anyhow::bail!("{}: the layer has {theirs}, but the map has {ours}", self.path.display());
        }
        self.saved = Some(layer.digest().to_string());
        Ok(Some(layer))
    }

    /// Saves the layer if it changed. A failure is reported, and the next call retries.
    pub fn save(&mut self, robot: &RobotName, layer: &mut VoxelSet, reports: &mut Reports) {
        if self.is_kept {
            return;
        }
        let digest = layer.digest().to_string();
        if self.saved.as_ref() == Some(&digest) {
            return;
        }
        match save_layer(&self.path, layer) {
            Ok(()) => {
                self.saved = Some(digest);
                reports.is_over(robot, Kind::Save);
            }
            Err(error) => reports.report(robot, Kind::Save, || format!("{error:#}; will retry")),
        }
    }

    /// Returns whether the file holds a layer with this digest.
    pub fn has(&self, layer: &mut VoxelSet) -> bool {
        self.saved.as_ref() == Some(&layer.digest().to_string())
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}

use crate::files::{save_layer, set_aside};
use crate::reports::{Kind, Reports};
use crate::robot_name::RobotName;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use voxtile::space::Grid;
use voxtile_share::{VoxelSet, read_layer_within};

/// The file of a robot's layer.
pub struct LayerStore {
    path: PathBuf,
    /// Whether there is a file that could neither be read nor moved away: it is not written over.
    is_kept: bool,
    /// The digest of what is in the file.
    saved: Option<String>,
}

/// What a layer may take.
#[derive(Clone, Copy)]
pub struct LayerRoom {
    pub grid: Option<Grid>,
    pub max_voxels: u64,
    pub max_bytes: usize,
}

impl LayerStore {
    pub fn new(folder: &Path, robot: &RobotName) -> Self {
        Self { path: folder.join(format!("{robot}.layer")), is_kept: false, saved: None }
    }

    /// The layer as it was last saved. A file that holds none is moved aside, so that a person can look at it.
    pub fn load(&mut self, robot: &RobotName, room: LayerRoom, reports: &mut Reports) -> Option<VoxelSet> {
        let reason = match self.read(room) {
            Ok(layer) => return layer,
            Err(error) => format!("{error:#}"),
        };
        match set_aside(&self.path) {
            Ok(aside) => reports.tell(robot, Kind::Read, || {
                format!("{reason}; it is kept as {} and the robot is asked anew", aside.display())
            }),
            Err(error) => {
                self.is_kept = true;
                reports.tell(robot, Kind::Read, || {
                    format!("{reason}; it cannot be moved aside ({error}), so nothing of this robot is saved")
                });
            }
        }
        None
    }

    fn read(&mut self, room: LayerRoom) -> anyhow::Result<Option<VoxelSet>> {
        let file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => anyhow::bail!("{}: cannot open the layer: {error}", self.path.display()),
        };
        let mut layer = read_layer_within(&mut BufReader::new(file), room.max_voxels, room.max_bytes)
            .map_err(|error| error.in_input(&self.path))?;
        if let Some(grid) = room.grid.filter(|grid| grid != layer.grid()) {
            let (theirs, ours) = (crate::files::lengths(layer.grid()), crate::files::lengths(&grid));
            anyhow::bail!("{}: a layer of {theirs}, but the map has {ours}", self.path.display());
        }
        self.saved = Some(layer.digest().to_string());
        Ok(Some(layer))
    }

    /// Saves the layer, if it changed. A failure is told, and tried again next time.
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
            Err(error) => reports.tell(robot, Kind::Save, || format!("{error:#}; it is tried again")),
        }
    }

    /// Whether a layer with this digest is in the file.
    pub fn has(&self, layer: &mut VoxelSet) -> bool {
        self.saved.as_ref() == Some(&layer.digest().to_string())
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}

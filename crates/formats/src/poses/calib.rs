use super::RigidPose;
use super::matrix::matrix_of;
use crate::read::lines::Lines;
use std::path::Path;
use voxtile::{FormatError, Result};

/// Reads the pose of the lidar in the camera frame from the `Tr:` line of a KITTI `calib.txt`.
pub(super) fn read(path: &Path) -> Result<RigidPose> {
    let mut lines = Lines::open(path)?;
    while let Some((_, line)) = lines.next()? {
        let Some((name, numbers)) = line.split_once(':') else { continue };
        if !matches!(name.trim(), "Tr" | "Tr_velo_to_cam" | "Tr_velo_cam") {
            continue;
        }
        let words = numbers.split_ascii_whitespace();
        let numbers: std::result::Result<Vec<f64>, _> = words.map(str::parse).collect();
        let numbers = numbers.map_err(|_| lines.error("`Tr:` is not followed by 12 numbers"))?;
        return matrix_of(&numbers).map_err(|reason| lines.error(reason));
    }
    Err(FormatError::at_line(1, "there is no line `Tr:` with the pose of the lidar in the camera frame")
        .in_input(path))
}

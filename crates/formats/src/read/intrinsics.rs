use super::lines::Lines;
use super::regular::check_regular;
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// Pinhole camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal lengths in x and y, in pixels.
    pub focal_px: [f64; 2],
    /// Principal point: column and row, in pixels.
    pub center_px: [f64; 2],
}

/// Common names of files with camera intrinsics.
const NAMES: [&str; 3] = ["camera-intrinsics.txt", "intrinsics.txt", "camera.txt"];
/// Limit for the numbers in a file; no supported form has more.
const MAX_NUMBERS: usize = 64;

impl Intrinsics {
    /// Creates a camera from `fx fy cx cy`, in pixels.
    ///
    /// # Errors
    ///
    /// A focal length is not above 0, or a number is not finite.
    pub fn new(numbers: [f64; 4]) -> Result<Self> {
        let [fx, fy, cx, cy] = numbers;
        if !numbers.iter().all(|number| number.is_finite()) || fx <= 0.0 || fy <= 0.0 {
            let reason =
                format!("fx {fx}, fy {fy}, cx {cx}, cy {cy}: focal lengths must be above 0, in pixels");
            return Err(Error::argument("intrinsics", reason));
        }
        Ok(Self { focal_px: [fx, fy], center_px: [cx, cy] })
    }

    /// Reads a file with a 3x3 matrix or with `fx fy cx cy`. `#` starts a comment.
    ///
    /// # Errors
    ///
    /// The file has other numbers, or the camera has distortion: its images must be rectified first.
    pub fn read(path: &Path) -> Result<Self> {
        let mut lines = Lines::open(path)?;
        let mut numbers: Vec<f64> = Vec::new();
        while let Some((_, line)) = lines.next()? {
            let line = line.split('#').next().unwrap_or_default();
            for word in line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty()) {
                numbers.push(word.parse().map_err(|_| lines.error(format!("`{word:.40}` is not a number")))?);
            }
            if numbers.len() > MAX_NUMBERS {
                break;
            }
        }
        let wrong = |reason: &str| Err(FormatError::at_line(1, reason).in_input(path));
        match numbers.as_slice() {
            &[fx, skew, cx, zero, fy, cy, a, b, one] => {
                if (skew, zero, a, b, one) != (0.0, 0.0, 0.0, 0.0, 1.0) {
                    return wrong(
                        "the matrix is not fx 0 cx, 0 fy cy, 0 0 1: cameras with skew are not supported",
                    );
                }
                Self::new([fx, fy, cx, cy])
            }
            &[fx, fy, cx, cy] => Self::new([fx, fy, cx, cy]),
            &[fx, fy, cx, cy, ref distortion @ ..] if distortion.len() <= 5 => {
                if distortion.iter().any(|number| *number != 0.0) {
                    return wrong("the camera has distortion: rectify the images first");
                }
                Self::new([fx, fy, cx, cy])
            }
            other => {
                wrong(&format!("{} numbers; a camera is a 3x3 matrix or fx fy cx cy, in pixels", other.len()))
            }
        }
    }

    /// Finds the camera of a folder: the given file, a file in the folder, or one in its parent.
    pub(super) fn find(folder: &Path, given: Option<&Path>) -> Result<Self> {
        if let Some(path) = given {
            return Self::read(path);
        }
        let folders: Vec<PathBuf> =
            std::iter::once(folder.to_owned()).chain(folder.parent().map(Path::to_owned)).collect();
        let mut paths = folders.iter().flat_map(|folder| NAMES.map(|name| folder.join(name)));
        let found = paths.find(|path| path.exists() && !path.is_dir());
        let Some(path) = found else {
            let reason = format!(
                "depth images need camera intrinsics: give a file with fx fy cx cy in pixels or a 3x3 matrix with \
                 `intrinsics` FILE, or put it in the folder or its parent as {}",
                NAMES.join(" or ")
            );
            return Err(Error::argument(folder.display().to_string(), reason));
        };
        check_regular(&path)?;
        Self::read(&path)
    }

    /// Returns whether one of these files has the name of a camera file.
    pub(super) fn is_in(files: &[PathBuf]) -> bool {
        files.iter().any(|path| path.file_name().is_some_and(|name| NAMES.iter().any(|known| name == *known)))
    }

    /// Returns the direction of a pixel, with depth 1.
    pub(super) fn direction(&self, column: f64, row: f64) -> [f64; 3] {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.center_px);
        [(column - cx) / fx, (row - cy) / fy, 1.0]
    }
}

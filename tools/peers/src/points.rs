use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::Path;

/// Writes points in metres: 3 x `f32` each, little-endian.
///
/// # Errors
///
/// Fails if the file cannot be written.
pub fn write_points(path: &Path, points: &[[f32; 3]]) -> Result<()> {
    let bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    fs::write(path, bytes).with_context(|| format!("{}: cannot write the points", path.display()))
}

/// Reads points written by [`write_points`].
///
/// # Errors
///
/// Fails if the file cannot be read or ends within a point.
pub fn read_points(path: &Path) -> Result<Vec<[f32; 3]>> {
    let bytes = fs::read(path).with_context(|| format!("{}: cannot read the points", path.display()))?;
    let (points, rest) = bytes.as_chunks::<12>();
    ensure!(rest.is_empty(), "{}: ends within a point; write it again", path.display());
    let coordinate =
        |point: &[u8; 12], k: usize| f32::from_le_bytes(std::array::from_fn(|byte| point[4 * k + byte]));
    Ok(points.iter().map(|point| std::array::from_fn(|k| coordinate(point, k))).collect())
}

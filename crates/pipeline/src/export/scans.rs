//! Export of the scans that a map keeps, as a folder of PCD files with their poses that `build` and other programs
//! read.

use crate::map_at::MapAt;
use crate::output::StagedOutput;
use crate::watch::Watch;
use serde::Serialize;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use voxtile::mapper::KeptScan;
use voxtile::scan::ScanPoints;
use voxtile::{Error, Result};

/// Summary of exported scans.
#[derive(Debug, Default, Serialize)]
pub struct ExportedScans {
    /// Number of scans.
    pub scans: u64,
    /// Number of points of all scans.
    pub points: u64,
    /// Whether the points are in the world frame. Readers must be configured accordingly.
    pub world_frame: bool,
}

/// Name of the pose file in TUM format: seconds, position, quaternion.
pub const POSES_NAME: &str = "poses_tum.txt";

/// Writes the scans that a map keeps into a new folder, atomically.
///
/// # Errors
///
/// The map cannot be read, it has scans in the world frame and others in the sensor frame, or the folder is not empty
/// or cannot be written.
pub fn export_scans(map: &Path, folder: &Path, watch: &Watch) -> anyhow::Result<ExportedScans> {
    let reader = MapAt::of(map)?.open()?;
    let (mut records, mut all, mut are_stamped) = (reader.kept_scans()?, 0, true);
    while let Some(record) = records.next_record()? {
        all += 1;
        are_stamped &= record.stamp_ns.is_some();
    }
    let staged = StagedOutput::beside(folder)?;
    let unfinished = staged.path()?;
    fs::create_dir(&unfinished).map_err(|error| Error::io(&unfinished, "create", error))?;
    let progress = watch.over_scans(Some(all));
    let poses = unfinished.join(POSES_NAME);
    let open = File::create_new(&poses).map_err(|error| Error::io(&poses, "create", error))?;
    let mut lines = BufWriter::new(open);
    let mut exported = ExportedScans::default();
    // File names sort in the order of the scans.
    let digits = all.to_string().len().max(6);
    for scan in reader.kept_scans()? {
        watch.stop().check()?;
        let scan = scan?;
        let is_in_world = scan.world_from_sensor().is_none();
        if exported.scans > 0 && is_in_world != exported.world_frame {
            let reason = "has scans in the world frame and others in the sensor frame, which cannot be exported to one \
                          folder";
            return Err(Error::argument(map.display().to_string(), reason).into());
        }
        let path = unfinished.join(format!("{:0digits$}.pcd", scan.number()));
        write_pcd(&scan, &path)?;
        write_pose(&scan, are_stamped, &mut lines).map_err(|error| Error::io(&poses, "write", error))?;
        exported.world_frame = is_in_world;
        exported.scans += 1;
        exported.points += scan.len() as u64;
        progress.step();
    }
    lines.flush().map_err(|error| Error::io(&poses, "write", error))?;
    progress.say("syncing");
    staged.finish()?;
    drop(progress);
    Ok(exported)
}

fn write_pose(scan: &KeptScan, is_stamped: bool, out: &mut impl Write) -> io::Result<()> {
    let stamp_ns = scan.stamp_ns().filter(|_| is_stamped).unwrap_or_default();
    let [x, y, z] = scan.origin();
    let [qx, qy, qz, qw] = scan.world_from_sensor().map_or([0.0, 0.0, 0.0, 1.0], |pose| pose.quaternion());
    let stamp = decimal_seconds(stamp_ns);
    // Rust formats an `f64` with the fewest digits that parse to the same bits.
    writeln!(out, "{stamp} {x} {y} {z} {qx} {qy} {qz} {qw}")
}

/// Formats nanoseconds as seconds. The sign is separate: the whole part of -0.5 s is 0, which has no sign.
fn decimal_seconds(stamp_ns: i64) -> String {
    let (sign, all) = (if stamp_ns < 0 { "-" } else { "" }, stamp_ns.unsigned_abs());
    format!("{sign}{}.{:09}", all / 1_000_000_000, all % 1_000_000_000)
}

/// Writes the points as they were inserted: as `float32` if that is exact, else as `float64`.
fn write_pcd(scan: &KeptScan, path: &Path) -> Result<()> {
    let mut is_narrow = true;
    scan.for_each_own_chunk(0..scan.len(), &mut |points, _| {
        let is_f32 = |x: &f64| f64::from(*x as f32).to_bits() == x.to_bits() || x.is_nan();
        is_narrow &= points.iter().flatten().all(is_f32);
        is_narrow
    })?;
    let (size, points) = (if is_narrow { 4 } else { 8 }, scan.len());
    let (field, four, float, one) = match scan.has_intensities() {
        true => (" intensity", " 4", " F", " 1"),
        false => ("", "", "", ""),
    };
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z{field}\nSIZE {size} {size} {size}{four}\n\
         TYPE F F F{float}\nCOUNT 1 1 1{one}\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\n\
         DATA binary\n"
    );
    let cannot = |error| Error::io(path, "write", error);
    let mut out = BufWriter::with_capacity(1 << 18, File::create_new(path).map_err(cannot)?);
    out.write_all(header.as_bytes()).map_err(cannot)?;
    let mut written = Ok(());
    scan.for_each_own_chunk(0..points, &mut |points, intensities| {
        written = points.iter().enumerate().try_for_each(|(at, point)| {
            for x in point {
                match is_narrow {
                    true => out.write_all(&(*x as f32).to_le_bytes())?,
                    false => out.write_all(&x.to_le_bytes())?,
                }
            }
            intensities.map_or(Ok(()), |intensities| out.write_all(&intensities[at].to_le_bytes()))
        });
        written.is_ok()
    })?;
    written.and_then(|()| out.flush()).map_err(cannot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_stamps_are_formatted_correctly() {
        for (stamp_ns, text) in [
            (-500_000_000, "-0.500000000"),
            (-1, "-0.000000001"),
            (-1_250_000_000, "-1.250000000"),
            (-2_000_000_000, "-2.000000000"),
            (0, "0.000000000"),
            (1_600_000_000_000_000_001, "1600000000.000000001"),
            (i64::MIN, "-9223372036.854775808"),
        ] {
            assert_eq!(decimal_seconds(stamp_ns), text);
        }
    }
}

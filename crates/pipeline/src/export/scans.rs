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
use voxtile::scan::{MovingMarks, ScanPoints};
use voxtile::{Error, Result};

/// Summary of exported scans.
#[derive(Debug, Default, Serialize)]
pub struct ExportedScans {
    /// Number of scans.
    pub scans: u64,
    /// Number of points of all scans.
    pub points: u64,
    /// Number of exported points that are marked as moving.
    pub moving_points: u64,
    /// Whether the points are in the world frame. Readers must be configured accordingly.
    pub world_frame: bool,
}

/// Name of the pose file in TUM format: seconds, position, quaternion.
pub const POSES_NAME: &str = "poses_tum.txt";

/// Points to export.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhichPoints {
    /// All points.
    #[default]
    All,
    /// The points that are marked as moving, of the scans that have any.
    Moving,
}

/// Writes the scans that a map keeps into a new folder, atomically. If any point is marked as moving, each file has a
/// field `moving`, 0 or 1.
///
/// # Errors
///
/// The map cannot be read, it has scans in the world frame and others in the sensor frame, or the folder is not empty
/// or cannot be written.
pub fn export_scans(
    map: &Path,
    folder: &Path,
    which: WhichPoints,
    watch: &Watch,
) -> anyhow::Result<ExportedScans> {
    let reader = MapAt::of(map)?.open()?;
    let (mut records, mut all, mut are_stamped, mut has_moving) = (reader.kept_scans()?, 0, true, false);
    while let Some(record) = records.next_record()? {
        all += 1;
        has_moving |= record.moving.is_some();
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
        let moving = scan.moving().map_or(0, MovingMarks::marked);
        if which == WhichPoints::Moving && moving == 0 {
            progress.step();
            continue;
        }
        let is_in_world = scan.world_from_sensor().is_none();
        if exported.scans > 0 && is_in_world != exported.world_frame {
            let reason = "has scans in the world frame and others in the sensor frame, which cannot be exported to one \
                          folder";
            return Err(Error::argument(map.display().to_string(), reason).into());
        }
        let path = unfinished.join(format!("{:0digits$}.pcd", scan.number()));
        PcdFile { scan: &scan, which, has_moving }.write(&path)?;
        write_pose(&scan, are_stamped, &mut lines).map_err(|error| Error::io(&poses, "write", error))?;
        exported.world_frame = is_in_world;
        exported.scans += 1;
        exported.points += if which == WhichPoints::Moving { moving } else { scan.len() as u64 };
        exported.moving_points += moving;
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

/// A scan as a PCD file.
struct PcdFile<'a> {
    scan: &'a KeptScan,
    which: WhichPoints,
    /// Whether there is a field of the marks.
    has_moving: bool,
}

impl PcdFile<'_> {
    /// Writes the points as they were inserted: as `float32` if that is exact, else as `float64`.
    fn write(&self, path: &Path) -> Result<()> {
        let (scan, is_narrow) = (self.scan, self.is_narrow()?);
        let cannot = |error| Error::io(path, "write", error);
        let mut out = BufWriter::with_capacity(1 << 18, File::create_new(path).map_err(cannot)?);
        out.write_all(self.header(is_narrow).as_bytes()).map_err(cannot)?;
        let mut marks = scan.moving().map(MovingMarks::iter);
        let mut written = Ok(());
        scan.for_each_own_chunk(0..scan.len(), &mut |points, intensities| {
            written = points.iter().enumerate().try_for_each(|(at, point)| {
                let is_moving = marks.as_mut().and_then(Iterator::next).unwrap_or(false);
                if self.which == WhichPoints::Moving && !is_moving {
                    return Ok(());
                }
                for x in point {
                    match is_narrow {
                        true => out.write_all(&(*x as f32).to_le_bytes())?,
                        false => out.write_all(&x.to_le_bytes())?,
                    }
                }
                if let Some(intensities) = intensities {
                    out.write_all(&intensities[at].to_le_bytes())?;
                }
                if self.has_moving { out.write_all(&[u8::from(is_moving)]) } else { Ok(()) }
            });
            written.is_ok()
        })?;
        written.and_then(|()| out.flush()).map_err(cannot)
    }

    fn is_narrow(&self) -> Result<bool> {
        let mut is_narrow = true;
        self.scan.for_each_own_chunk(0..self.scan.len(), &mut |points, _| {
            let is_f32 = |x: &f64| f64::from(*x as f32).to_bits() == x.to_bits() || x.is_nan();
            is_narrow &= points.iter().flatten().all(is_f32);
            is_narrow
        })?;
        Ok(is_narrow)
    }

    fn header(&self, is_narrow: bool) -> String {
        let size = if is_narrow { "4" } else { "8" };
        // Name, size in bytes and type.
        let mut fields = vec![("x", size, "F"), ("y", size, "F"), ("z", size, "F")];
        fields.extend(self.scan.has_intensities().then_some(("intensity", "4", "F")));
        fields.extend(self.has_moving.then_some(("moving", "1", "U")));
        let row = |of: fn(&(&'static str, &'static str, &'static str)) -> &'static str| {
            fields.iter().map(of).collect::<Vec<_>>().join(" ")
        };
        let points = match self.which {
            WhichPoints::All => self.scan.len() as u64,
            WhichPoints::Moving => self.scan.moving().map_or(0, MovingMarks::marked),
        };
        format!(
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\n\
             WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n",
            row(|field| field.0),
            row(|field| field.1),
            row(|field| field.2),
            row(|_| "1"),
        )
    }
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

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use voxtile::Scan;
use voxtile_formats::ScanStreamWriter;
use workload::SurveyName;

/// An input that needs much memory, and the settings of its map.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HardScan {
    pub name: String,
    /// The input.
    pub points: Points,
    pub resolution_m: f64,
    pub tile_size_m: f64,
    pub limit_mib: usize,
    /// Whether each ray is inserted on its own (`--insert per-ray`).
    pub per_ray: bool,
    /// Whether a background flush begins after each scan instead of every minute.
    pub is_flushed: bool,
    /// Whether the map has two files per tile instead of one compact file.
    pub is_octomap: bool,
    /// Other options of `voxtile build`.
    pub options: Vec<String>,
}

/// Points of an input.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Points {
    /// Scans with rays all around a sensor.
    Fan {
        /// Number of scans. The sensor advances by a fifth of `reach_m` between scans.
        scans: u32,
        rays: u32,
        /// Length of the rays, in metres.
        reach_m: f64,
        /// Vertical opening: 0 is level, 1 the whole sphere.
        opening: f64,
        /// Whether the rays end beyond the range, so that nothing is hit.
        is_sky: bool,
    },
    /// A PCD file of equal points, compressed to almost nothing.
    Packed {
        points: u32,
    },
    Survey {
        survey: SurveyName,
        scans: usize,
    },
}

/// Cost of the command.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BuildCost {
    /// Peak of its resident memory, in bytes.
    pub peak_bytes: u64,
    pub cpu_s: f64,
    pub tiles: u64,
    pub digest: String,
}

/// Rays of a scan of a survey.
const SURVEY_RAYS: u32 = 4_000;
/// Larger than any map here.
const UNLIMITED_MIB: usize = 1 << 24;

impl HardScan {
    pub fn description(&self) -> String {
        let points = match &self.points {
            Points::Fan { scans, rays, reach_m, is_sky, .. } => {
                let of = if *scans > 1 { format!("{scans} scans of ") } else { String::new() };
                let (up_to, hits) = if *is_sky { ("", " that hit nothing") } else { ("up to ", "") };
                format!("{of}{rays} rays of {up_to}{reach_m} m{hits}")
            }
            Points::Packed { points } => format!("a packed PCD file of {points} points"),
            Points::Survey { survey, scans } => format!("`{}`, {scans} scans", survey.name()),
        };
        let each = if self.per_ray { ", every ray" } else { "" };
        let flushed = if self.is_flushed { ", flushed after each scan" } else { "" };
        let form = if self.is_octomap { ", two files a tile" } else { "" };
        let options: String = self.options.iter().map(|option| format!(" {option}")).collect();
        format!(
            "{points}{each}{flushed}{form}{options}; voxels of {} m, tiles of {} m",
            self.resolution_m, self.tile_size_m
        )
    }

    /// Writes the input and returns its path.
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<PathBuf> {
        let (file, packed) = match &self.points {
            Points::Packed { points } => ("hard.pcd", Some(*points)),
            _ => ("hard.scans", None),
        };
        let path = folder.join(file);
        let mut out = BufWriter::new(File::create(&path)?);
        match packed {
            Some(points) => write_packed(points, &mut out)?,
            None => {
                let mut stream = ScanStreamWriter::new(&mut out, &self.name, false)?;
                self.scans().try_for_each(|scan| stream.write_world(&scan))?;
            }
        }
        out.flush()?;
        Ok(path)
    }

    fn scans(&self) -> Box<dyn Iterator<Item = Scan>> {
        match self.points {
            Points::Fan { scans, rays, reach_m, opening, is_sky } => {
                let length_m = if is_sky { 2.0 * reach_m } else { reach_m };
                Box::new(
                    (0..scans).map(move |scan| fan(rays, length_m, opening, f64::from(scan) * reach_m / 5.0)),
                )
            }
            Points::Survey { survey, scans } => Box::new(survey.scans(1, 0, SURVEY_RAYS).take(scans)),
            Points::Packed { .. } => Box::new(std::iter::empty()),
        }
    }

    /// Runs the command next to this program on the input, with the limit or without one.
    ///
    /// # Errors
    ///
    /// Fails if the command is missing or fails.
    pub fn build(&self, input: &Path, map: &Path, is_limited: bool) -> Result<BuildCost> {
        let reach_m = match self.points {
            Points::Fan { reach_m, .. } => reach_m,
            _ => 60.0,
        };
        let memory = format!("{}MiB", if is_limited { self.limit_mib } else { UNLIMITED_MIB });
        let number = |number: f64| number.to_string();
        let (resolution, tile, reach) =
            (number(self.resolution_m), number(self.tile_size_m), number(reach_m));
        let mut arguments = vec!["build", "--json", "--memory", &memory];
        arguments.extend(["--storage", if self.is_octomap { "octomap" } else { "compact" }]);
        arguments.extend(self.options.iter().map(String::as_str));
        arguments.extend(["--resolution", &resolution, "--tile-size", &tile, "--max-range", &reach]);
        arguments.extend(["--insert", if self.per_ray { "per-ray" } else { "per-scan" }]);
        if self.is_flushed {
            arguments.extend(["--flush-every", "0s"]);
        }
        let before = children_cpu_s()?;
        let output = command()?.args(arguments).arg(input).arg("-o").arg(map).output()?;
        let cpu_s = children_cpu_s()? - before;
        let errors = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "{}: {}: {errors}", self.name, output.status);
        let built: serde_json::Value = serde_json::from_slice(&output.stdout)?;
        let number = |key: &str| built[key].as_u64().with_context(|| format!("the summary has no {key}"));
        let digest = command()?.arg("digest").arg(map).stderr(Stdio::inherit()).output()?;
        ensure!(digest.status.success(), "{}: no digest: {}", self.name, digest.status);
        let digest = String::from_utf8(digest.stdout)?;
        fs::remove_dir_all(map).with_context(|| format!("{}: cannot remove", map.display()))?;
        Ok(BuildCost {
            peak_bytes: number("peak_rss_bytes")?,
            cpu_s,
            tiles: number("tiles")?,
            digest: digest.split_whitespace().next().context("no digest")?.to_owned(),
        })
    }
}

fn command() -> Result<Command> {
    let program = std::env::current_exe()?.with_file_name("voxtile");
    ensure!(program.is_file(), "{}: missing; build the command `voxtile` first", program.display());
    Ok(Command::new(program))
}

/// CPU time of the processes that this one has waited for, in seconds.
fn children_cpu_s() -> Result<f64> {
    /// USER_HZ, which is 100 on x86-64 and AArch64 Linux.
    const TICKS_PER_SECOND: f64 = 100.0;
    let stat = fs::read_to_string("/proc/self/stat")?;
    // The 16th and 17th fields; the name before `)` may contain anything.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |at: usize| fields.get(at).and_then(|ticks| ticks.parse::<f64>().ok());
    let ticks = ticks(13).zip(ticks(14)).context("/proc/self/stat: no CPU time of children")?;
    Ok((ticks.0 + ticks.1) / TICKS_PER_SECOND)
}

/// Rays in all directions of a band around a sensor, with lengths varied as over a rough surface.
fn fan(rays: u32, reach_m: f64, opening: f64, ahead_m: f64) -> Scan {
    let origin = [0.03 + ahead_m, 0.04, 1.8];
    let point = |k: u32| {
        let (azimuth, up) =
            (f64::from(k) * 2.399_963, opening * (2.0 * (f64::from(k) + 0.5) / f64::from(rays) - 1.0));
        let reach = reach_m * (0.85 + 0.15 * (f64::from(k) * 0.37).sin());
        let flat = (1.0 - up * up).max(0.0).sqrt() * reach;
        [origin[0] + flat * azimuth.cos(), origin[1] + flat * azimuth.sin(), origin[2] + up * reach]
    };
    Scan { origin, points: (0..rays).map(point).collect(), intensities: None }
}

/// Writes points at (3, 4, 5) m: each field is one value and LZF copies of it from four bytes back.
fn write_packed(points: u32, out: &mut impl Write) -> Result<()> {
    let mut packed: Vec<u8> = Vec::new();
    for value in [3.0_f32, 4.0, 5.0] {
        packed.push(3);
        packed.extend(value.to_le_bytes());
        let mut left = 4 * (points as usize - 1);
        while left > 0 {
            // A copy has at least three bytes, so no remainder may be shorter.
            let length = if left > 264 + 2 { 264 } else { left.min(264) };
            let length = if left > length && left - length < 3 { length - 3 } else { length };
            let code = length - 2;
            if code < 7 {
                packed.extend([(code as u8) << 5, 3]);
            } else {
                packed.extend([7 << 5, (code - 7) as u8, 3]);
            }
            left -= length;
        }
    }
    write!(
        out,
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary_compressed\n"
    )?;
    out.write_all(&(packed.len() as u32).to_le_bytes())?;
    out.write_all(&(12 * points).to_le_bytes())?;
    out.write_all(&packed)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_file_has_the_requested_number_of_points() {
        for points in [1, 2, 67, 68, 1000, 70_001] {
            let mut file = Vec::new();
            write_packed(points, &mut file).unwrap();
            let cloud = voxtile_formats::read_pcd(&file).unwrap();
            assert_eq!(cloud.points_in_sensor, vec![[3.0, 4.0, 5.0]; points as usize]);
        }
    }
}

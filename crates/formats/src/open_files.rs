//! Paths that are given together, as a shell's `tiles/*.laz` gives them.

use crate::CloudSource;
use crate::input_format::{InputFormat, Open};
use crate::open::{check, check_returns, open_file};
use crate::poses::{PoseSource, PosedClouds, Rules, find_poses};
use crate::read::companions::is_surely_named;
use crate::read::file_order::{name_of, sort_naturally};
use crate::read::files::Files;
use crate::read::from_origin::FromOrigin;
use crate::read::listing::extension_of;
use crate::read::name_stamps::NameStamps;
use crate::read::of_classes::OfClasses;
use crate::read::regular::check_regular;
use crate::read::{open_input, pcd_scans};
use crate::read_options::ReadOptions;
use crate::registry::Registry;
use crate::scans::{GuardedScans, ScanSource};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Paths that were given together, divided into inputs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DividedInputs {
    /// Inputs in the order of the paths. One with several paths is a list of files for [`open_scan_files`].
    pub inputs: Vec<Vec<PathBuf>>,
    /// Files that accompany clouds and were left out: poses, times, cameras.
    pub left_out: Vec<PathBuf>,
}

/// Divides paths that were given together into inputs. Consecutive files of clouds of one format and one folder are one
/// input, as the folder would be; with [`ReadOptions::poses`] also those of several folders. The parts of a recording
/// that was split (`drive_0.mcap drive_1.mcap`, in any order) are one input too. Any other path, such as a recording or
/// a folder, is an input of its own.
///
/// # Errors
///
/// A file cannot be read or has an unknown format.
pub fn divide_inputs(paths: &[PathBuf], options: &ReadOptions) -> Result<DividedInputs> {
    Registry::default().divide_inputs(paths, options)
}

/// Opens several files of clouds of one format as one input, in the given order; see [`divide_inputs`].
///
/// # Errors
///
/// As for [`open_scans`](crate::open_scans). Also fails if there is no file, or a file cannot be part of a list.
pub fn open_scan_files(paths: &[PathBuf], options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    Registry::default().open_scan_files(paths, options)
}

impl Registry {
    fn divide_inputs(&self, paths: &[PathBuf], options: &ReadOptions) -> Result<DividedInputs> {
        let mut divided = DividedInputs::default();
        let not_clouds: Vec<PathBuf> =
            options.not_clouds().iter().filter_map(|path| path.canonicalize().ok()).collect();
        let is_no_cloud = |path: &Path| {
            is_surely_named(path) || path.canonicalize().is_ok_and(|path| not_clouds.contains(&path))
        };
        let mut last: Option<Family<'_>> = None;
        for path in paths {
            if path.is_file() && is_no_cloud(path) {
                divided.left_out.push(path.clone());
                continue;
            }
            let format = self.format_in_list(path, options)?;
            let family = format.and_then(|format| Family::of(path, format, options));
            match divided.inputs.last_mut() {
                Some(input) if family.is_some() && family == last => input.push(path.clone()),
                _ => divided.inputs.push(vec![path.clone()]),
            }
            last = family;
        }
        divided.inputs = divided.inputs.into_iter().flat_map(in_order_of_parts).collect();
        Ok(divided)
    }

    /// Returns the format of a file that may be one of a list.
    fn format_in_list(&self, path: &Path, options: &ReadOptions) -> Result<Option<&InputFormat>> {
        if !path.is_file() {
            return Ok(None);
        }
        let (_, format) = self.find(path, options)?;
        let is_of_clouds = matches!(format.open, Open::Cloud(_) | Open::Stream(_) | Open::Clouds(_));
        let is_part = matches!(format.open, Open::Recording(_)) && part_of(path).is_some();
        Ok((is_of_clouds || is_part || is_pcd(format)).then_some(format))
    }

    fn open_scan_files(
        &self,
        paths: &[PathBuf],
        options: &ReadOptions,
    ) -> Result<Box<dyn ScanSource + Send>> {
        let Some(first) = paths.first() else {
            return Err(Error::argument("files", "there are none"));
        };
        let Some(format) = self.format_in_list(first, options)? else {
            let reason = "is no file of clouds: open it alone";
            return Err(Error::argument(first.display().to_string(), reason));
        };
        check_returns(first, format, options)?;
        let scans = GuardedScans::open(first, || open_list(paths, first, format, options))?;
        Ok(options.selection.clone().of(scans))
    }
}

fn is_pcd(format: &InputFormat) -> bool {
    format.name == "pcd"
}

/// Properties that are equal for all files of one input.
#[derive(Clone, Debug, PartialEq)]
struct Family<'p> {
    /// Extensions of the format. LAS and LAZ are one format here, so they may be mixed.
    extensions: &'static [&'static str],
    folder: Option<&'p Path>,
    /// Beginning of the names of the parts of a recording.
    recording: Option<&'p str>,
}

impl<'p> Family<'p> {
    fn of(path: &'p Path, format: &InputFormat, options: &ReadOptions) -> Option<Self> {
        let recording = match format.open {
            Open::Recording(_) => Some(part_of(path)?.0),
            _ => None,
        };
        // Without a pose file, each folder may have its own.
        let is_of_folder = recording.is_some() || options.poses.is_none();
        let folder = path.parent().filter(|_| is_of_folder);
        Some(Self { extensions: format.extensions, folder, recording })
    }
}

/// Splits the name of a part of a recording, such as `drive_12.bag`, into the recording's name and the part's number.
fn part_of(path: &Path) -> Option<(&str, u32)> {
    let mut stem = path.file_stem()?.to_str()?;
    for packed in [".bag", ".mcap", ".db3"] {
        // Compressed as a whole: `drive_12.mcap.zstd`.
        stem = stem.strip_suffix(packed).unwrap_or(stem);
    }
    let (recording, number) = stem.rsplit_once('_')?;
    // Longer numbers, and those with leading zeros, are dates and counters of recordings.
    let is_part = number.len() <= 4 && (number == "0" || !number.starts_with('0'));
    let number = number.bytes().all(|byte| byte.is_ascii_digit()).then(|| number.parse().ok())??;
    (is_part && !recording.is_empty()).then_some((recording, number))
}

/// Sorts the parts of a recording, which a shell lists as `drive_10` before `drive_2`. If numbers are missing, each file
/// is an input of its own.
fn in_order_of_parts(mut paths: Vec<PathBuf>) -> Vec<Vec<PathBuf>> {
    let is_recording = |path: &PathBuf| {
        ["bag", "active", "mcap", "db3", "zst", "zstd"].contains(&extension_of(path).as_str())
    };
    if paths.len() < 2 || !paths.iter().all(is_recording) {
        return vec![paths];
    }
    let number = |path: &PathBuf| part_of(path).map_or(0, |(_, number)| number);
    let mut sorted = paths.clone();
    sorted.sort_by_key(number);
    if sorted.windows(2).all(|pair| number(&pair[0]) + 1 == number(&pair[1])) {
        return vec![sorted];
    }
    paths.drain(..).map(|path| vec![path]).collect()
}

fn open_list(
    paths: &[PathBuf],
    first: &Path,
    format: &InputFormat,
    options: &ReadOptions,
) -> Result<Box<dyn ScanSource + Send>> {
    let folder = match first.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let remark = order_remark(paths);
    if is_pcd(format) {
        return pcd_scans::open_files(folder, paths.to_vec(), remark, options);
    }
    let clouds = match format.open {
        Open::Recording(_) => open_parts(paths, options)?,
        _ => open_clouds(paths, *format, remark, options)?,
    };
    let clouds = OfClasses::of(clouds, options);
    let own = ((format.has_poses)(first) || options.sensor_origin_m.is_some()).then_some(PoseSource::Scans);
    let poses = find_poses(folder, own, clouds.len_hint(), false, Rules::Strict, options)?;
    Ok(Box::new(PosedClouds::new(clouds, folder, poses, options.clouds.clone())?))
}

#[cfg(feature = "ros")]
fn open_parts(paths: &[PathBuf], options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    crate::ros::recording_clouds::open_parts(paths, options)
}

#[cfg(not(feature = "ros"))]
fn open_parts(_: &[PathBuf], _: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    Err(Error::argument("recording", "this build does not support recordings: build with the feature `ros`"))
}

fn open_clouds(
    paths: &[PathBuf],
    format: InputFormat,
    remark: Option<String>,
    options: &ReadOptions,
) -> Result<Box<dyn CloudSource>> {
    check(options)?;
    let (own_options, stamps) = (options.clone(), NameStamps::of(paths));
    let open = Box::new(move |path: &Path| {
        check_regular(path)?;
        if matches!(format.open, Open::Clouds(_)) {
            // Some libraries open the file themselves: check here that it can be opened.
            open_input(path)?;
        }
        open_file(path, &format, stamps, &own_options)
    });
    let is_one_each = !matches!(format.open, Open::Clouds(_));
    let name = format!("{}, {} files", format.title, paths.len());
    let remarks = stamps.remark().into_iter().chain(remark).collect();
    let files = Box::new(Files::new(name, paths.to_vec(), is_one_each, open).with_remarks(remarks));
    Ok(match options.sensor_origin_m {
        Some(origin_m) => Box::new(FromOrigin::new(files, origin_m)?),
        None => files,
    })
}

/// Returns a remark if the order of files of one folder is not that of their numbers: a shell lists `scan10` before
/// `scan2`.
fn order_remark(paths: &[PathBuf]) -> Option<String> {
    let mut sorted = paths.to_vec();
    sort_naturally(&mut sorted);
    let is_one_folder = paths.iter().all(|path| path.parent() == paths[0].parent());
    let at = (0..paths.len()).find(|&at| paths[at] != sorted[at]).filter(|_| is_one_folder)?;
    Some(format!(
        "the files are read in the order given: {} where the order of the numbers in their names has {}; give the folder \
         to read them in that order",
        name_of(&paths[at]),
        name_of(&sorted[at])
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn files_of_one_format_and_folder_are_one_input() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a", "b"] {
            fs::create_dir(folder.path().join(name)).unwrap();
        }
        let path = |name: &str| {
            let path = folder.path().join(name);
            let content: &[u8] = match path.extension().and_then(|extension| extension.to_str()) {
                Some("ply") => b"ply\nformat ascii 1.0\n",
                Some("pcd") => b"VERSION 0.7\n",
                Some("mcap") => b"\x89MCAP0\r\n",
                _ => b"1 2 3\n",
            };
            if !path.is_dir() {
                fs::write(&path, content).unwrap();
            }
            path
        };
        let names =
            ["a/1.ply", "a/2.ply", "a/poses.txt", "b/3.ply", "b/4.pcd", "b/5.pcd", "m.mcap", "n.mcap", "a"];
        let paths: Vec<PathBuf> = names.iter().map(|name| path(name)).collect();
        let divided = |options: &ReadOptions| {
            let divided = divide_inputs(&paths, options).unwrap();
            assert_eq!(divided.left_out, [path("a/poses.txt")]);
            divided.inputs.iter().map(Vec::len).collect::<Vec<_>>()
        };
        assert_eq!(divided(&ReadOptions::default()), [2, 1, 2, 1, 1, 1]);
        let poses = Some(path("times.txt"));
        assert_eq!(divided(&ReadOptions { poses, ..ReadOptions::default() }), [3, 2, 1, 1, 1]);
        let named = [path("a/times.txt"), path("a/x.txt"), path("a/y.txt")];
        let intrinsics_path = Some(path("a/x.txt"));
        let divided =
            divide_inputs(&named, &ReadOptions { intrinsics_path, ..ReadOptions::default() }).unwrap();
        assert_eq!((divided.inputs, divided.left_out), (vec![vec![path("a/y.txt")]], named[..2].to_vec()));
        let error = divide_inputs(&[path("a/1.ply"), path("what.pcap")], &ReadOptions::default());
        assert!(error.unwrap_err().to_string().contains("what.pcap"));
    }

    #[test]
    fn parts_of_a_split_recording_are_one_input() {
        let folder = tempfile::tempdir().unwrap();
        let divided = |names: &[&str]| {
            let paths: Vec<PathBuf> = names.iter().map(|name| folder.path().join(name)).collect();
            paths.iter().for_each(|path| fs::write(path, b"\x89MCAP0\r\n").unwrap());
            let name = |path: &PathBuf| path.file_stem().unwrap().to_str().unwrap().to_owned();
            let inputs = divide_inputs(&paths, &ReadOptions::default()).unwrap().inputs;
            inputs
                .iter()
                .map(|paths| paths.iter().map(name).collect::<Vec<_>>().join(" "))
                .collect::<Vec<_>>()
        };
        if !cfg!(feature = "ros") {
            return;
        }
        let parts = ["a_0.mcap", "a_1.mcap", "a_10.mcap", "a_2.mcap"];
        assert_eq!(divided(&parts), ["a_0", "a_1", "a_10", "a_2"]);
        let all: Vec<String> = (0..11).map(|number| format!("a_{number}.mcap")).collect();
        let mut listed: Vec<&str> = all.iter().map(String::as_str).collect();
        listed.sort_unstable();
        assert_eq!(divided(&listed), ["a_0 a_1 a_2 a_3 a_4 a_5 a_6 a_7 a_8 a_9 a_10"]);
        assert_eq!(divided(&["a_3.mcap", "b_4.mcap"]), ["a_3", "b_4"]);
        assert_eq!(divided(&["run_20240501.mcap", "run_20240502.mcap"]), ["run_20240501", "run_20240502"]);
        assert_eq!(divided(&["day1.mcap", "day2.mcap", "_1.mcap", "_2.mcap"]), ["day1", "day2", "_1", "_2"]);
    }

    #[test]
    fn an_order_against_the_numbers_is_a_remark() {
        let of = |names: &[&str]| order_remark(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(of(&["s/1.ply", "s/2.ply", "s/10.ply"]), None);
        assert_eq!(of(&["s/2.ply", "t/1.ply"]), None);
        let remark = of(&["s/1.ply", "s/10.ply", "s/2.ply"]).unwrap();
        assert!(remark.contains("10.ply where") && remark.contains("has 2.ply"), "{remark}");
    }
}

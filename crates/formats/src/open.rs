use crate::CloudSource;
use crate::class_selection::Returns;
use crate::input_format::{Detection, InputFormat, Open};
use crate::poses::PoseSource;
use crate::poses::PosedClouds;
use crate::poses::Rules;
use crate::poses::find_poses;
use crate::read::files::Files;
use crate::read::from_origin::FromOrigin;
use crate::read::listing::Listing;
use crate::read::name_stamps::NameStamps;
use crate::read::of_classes::{OfClasses, without_classes, without_returns};
use crate::read::one::OneCloud;
use crate::read::open_input;
use crate::read::regular::check_regular;
use crate::read_options::ReadOptions;
use crate::registry::Registry;
use crate::scans::{GuardedScans, ScanSource};
use std::path::Path;
use voxtile::{Error, Result};

/// Opens scans of any known format: a file, a folder of files, or a folder that contains such a folder named `scans`.
/// The format is detected from the content first, then from the name.
///
/// Files of a folder are read in natural order of their names (`scan2` before `scan10`). Scans without poses of their
/// own take them from [`ReadOptions::poses`], or from `poses_tum.txt` or `poses_kitti.txt` in the folder or in its
/// parent; see [`ScanSource::pose_source`].
///
/// # Errors
///
/// The format is unknown, the options do not fit it, a file cannot be read, the scans have no poses, or the poses do
/// not match the scans.
pub fn open_scans(path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    Registry::default().open_scans(path, options)
}

/// Opens clouds of any known format, ignoring pose files.
///
/// # Errors
///
/// As for [`open_scans`]. Also fails for a format that contains only scans with poses.
pub fn open_clouds(path: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    Registry::default().open_clouds(path, options)
}

impl Registry {
    /// As the free function [`open_scans`], for the formats of this registry.
    ///
    /// # Errors
    ///
    /// As for [`open_scans`].
    pub fn open_scans(&self, path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
        GuardedScans::open(path, || self.open_unguarded(path, options))
    }

    fn open_unguarded(&self, path: &Path, options: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
        let (path, format) = self.find(path, options)?;
        let has_poses = (format.has_poses)(&path);
        check_returns(&path, format, options)?;
        let scans = match format.open {
            Open::Scans(_) if has_poses && options.poses.is_some() => {
                let reason = format!("a {} has its own poses; omit the option", format.title);
                return Err(Error::argument("poses", reason));
            }
            // PCD and scan streams may have classes.
            Open::Scans(_) if !matches!(format.name, "pcd" | "scans") && !options.classes.is_everything() => {
                return Err(without_classes(&format!("{} ({})", path.display(), format.title)));
            }
            Open::Scans(open) => open(&path, options)?,
            _ => {
                let clouds = open_as(&path, format, options)?;
                let own = (has_poses || options.sensor_origin_m.is_some()).then_some(PoseSource::Scans);
                let are_images = matches!(format.name, "depth" | "tum-rgbd");
                let poses = find_poses(&path, own, clouds.len_hint(), are_images, Rules::Strict, options)?;
                Box::new(PosedClouds::new(clouds, &path, poses, options.clouds.clone())?)
            }
        };
        Ok(options.selection.clone().of(scans))
    }

    /// As the free function [`open_clouds`], for the formats of this registry.
    ///
    /// # Errors
    ///
    /// As for [`open_clouds`].
    pub fn open_clouds(&self, path: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
        let (path, format) = self.find(path, options)?;
        check_returns(&path, format, options)?;
        open_as(&path, format, options)
    }
}

fn open_as(path: &Path, format: &InputFormat, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    check(options)?;
    let wrong = |reason: String| Err(Error::argument(path.display().to_string(), reason));
    let is_folder = path.is_dir();
    let source = match format.open {
        Open::Recording(open) => return Ok(OfClasses::of(open(path, options)?, options)),
        Open::Scans(_) => {
            return wrong(format!("is {}, which contains scans with poses: open it as scans", format.title));
        }
        Open::Disabled(feature) => {
            let title = format.title;
            return wrong(format!(
                "is {title}, which this build does not support: build with the feature `{feature}`"
            ));
        }
        Open::Folder(open) if is_folder => open(path, options)?,
        Open::Folder(_) => return wrong(format!("is a file; {} needs a folder", format.title)),
        _ if is_folder => open_folder(path, *format, options)?,
        _ => open_file(path, format, NameStamps::default(), options)?,
    };
    let source = match options.sensor_origin_m {
        Some(origin_m) => Box::new(FromOrigin::new(source, origin_m)?),
        None => source,
    };
    Ok(OfClasses::of(source, options))
}

/// Checks that the points of a format have numbers of returns, if returns are selected.
pub(crate) fn check_returns(path: &Path, format: &InputFormat, options: &ReadOptions) -> Result<()> {
    if options.returns == Returns::All || matches!(format.name, "las" | "laz" | "copc") {
        return Ok(());
    }
    Err(without_returns(&format!("{}, {}", path.display(), format.title)))
}

pub(crate) fn check(options: &ReadOptions) -> Result<()> {
    if !(options.scan_period_s >= 0.0 && options.scan_period_s.is_finite()) {
        return Err(Error::argument(
            "scan period",
            "must be at least 0 seconds; 0 reads a file as one cloud",
        ));
    }
    if options.depth_scale.is_some_and(|scale| !(scale > 0.0 && scale.is_finite())) {
        return Err(Error::argument(
            "depth scale",
            "must be above 0: it is the number of depth units per metre",
        ));
    }
    Ok(())
}

fn open_folder(path: &Path, format: InputFormat, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    let listing = Listing::read(path, &options.not_clouds())?;
    let (paths, others) = match format.detection {
        Detection::Look(_) => {
            let texts = listing.texts(&format);
            (texts.clouds, texts.others)
        }
        _ => (listing.with_extension(&format), Vec::new()),
    };
    if paths.is_empty() && !others.is_empty() {
        let reason = listing.why_nothing(&format.extensions.join(", "), &others);
        return Err(Error::argument(path.display().to_string(), reason));
    }
    if paths.is_empty() {
        let reason = format!("no file in it ends with .{}", format.extensions.join(", ."));
        return Err(Error::argument(path.display().to_string(), reason));
    }
    let is_one_each = !matches!(format.open, Open::Clouds(_));
    let name = format!("{}, a folder", format.title);
    let (options, stamps) = (options.clone(), NameStamps::of(&paths));
    let open = Box::new(move |path: &Path| {
        check_regular(path)?;
        if matches!(format.open, Open::Clouds(_)) {
            // Some libraries open the file themselves: check here that it can be opened.
            open_input(path)?;
        }
        open_file(path, &format, stamps, &options)
    });
    let others = others.into_iter().map(|other| format!("{other} is not a cloud and was skipped"));
    let remarks = stamps.remark().into_iter().chain(others).collect();
    Ok(Box::new(Files::new(name, paths, is_one_each, open).with_remarks(remarks)))
}

pub(crate) fn open_file(
    path: &Path,
    format: &InputFormat,
    stamps: NameStamps,
    options: &ReadOptions,
) -> Result<Box<dyn CloudSource>> {
    if !matches!(format.open, Open::Stream(_)) {
        check_regular(path)?;
    }
    match format.open {
        Open::Cloud(open) | Open::Stream(open) => {
            Ok(Box::new(OneCloud::new(format.title, open(path, stamps.head_of(path), options)?)))
        }
        Open::Clouds(open) => open(path, options),
        _ => Err(Error::argument(
            path.display().to_string(),
            format!("{} cannot be read from a single file", format.title),
        )),
    }
}

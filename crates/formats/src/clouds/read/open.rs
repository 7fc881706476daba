use super::files::Files;
use super::format::Format;
use super::from_origin::FromOrigin;
use super::listing::Listing;
use super::one::{OneCloud, head_of};
use super::options::OpenOptions;
use super::regular::check_regular;
use super::{bin, depth_images, depth_tum, ply, text};
use crate::clouds::cloud::CloudSource;
use crate::clouds::error::{Error, Result};
use std::path::Path;

/// Opens a file of clouds, or a folder of files with clouds in the natural order of their names.
///
/// Names that are numbers, `1700000000123456789.bin` or `1403636579.763555.ply`, are the time stamps of their clouds:
/// nanoseconds, micro- and milliseconds or seconds since 1970. Smaller numbers are counters.
///
/// # Errors
///
/// Nothing there, or nothing that is known; a format that is read elsewhere or was left out of this build; a file that
/// is damaged at its start; options that do not fit.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn CloudSource>> {
    check(options)?;
    let format = match options.format {
        Some(format) => format,
        None => Format::guess_without(path, &options.beside())?,
    };
    let source =
        if path.is_dir() { open_folder(path, format, options)? } else { open_file(path, format, options)? };
    Ok(match options.sensor_origin_m {
        Some(origin_m) => Box::new(FromOrigin::new(source, origin_m)?),
        None => source,
    })
}

fn check(options: &OpenOptions) -> Result<()> {
    if !(options.scan_period_s >= 0.0 && options.scan_period_s.is_finite()) {
        return Err(Error::argument(
            "scan period",
            "must be seconds from 0 on; 0 leaves a file in one cloud",
        ));
    }
    if options.depth_scale.is_some_and(|scale| !(scale > 0.0 && scale.is_finite())) {
        return Err(Error::argument("depth scale", "must be above 0: the units of a depth image in a metre"));
    }
    Ok(())
}

fn open_folder(path: &Path, format: Format, options: &OpenOptions) -> Result<Box<dyn CloudSource>> {
    match format {
        Format::DepthTum => return depth_tum::open(path, options),
        Format::DepthImages => {
            let images = Listing::read(path, &options.beside())?.of(format);
            return depth_images::open(path, images, options);
        }
        _ => check_is_read_here(path, format)?,
    }
    let paths = Listing::read(path, &options.beside())?.of(format);
    if paths.is_empty() {
        let endings = format.extensions().join(", .");
        return Err(Error::argument(
            path.display().to_string(),
            format!("no file in it ends with .{endings}"),
        ));
    }
    let is_one_each = matches!(format, Format::Ply | Format::Text | Format::Bin);
    let name = format!("{format}, a folder");
    let options = options.clone();
    let open = Box::new(move |path: &std::path::PathBuf| {
        check_regular(path)?;
        open_file(path, format, &options)
    });
    Ok(Box::new(Files::new(name, paths, is_one_each, open)))
}

fn open_file(path: &Path, format: Format, options: &OpenOptions) -> Result<Box<dyn CloudSource>> {
    if !matches!(format, Format::Ply | Format::Text) {
        check_regular(path)?;
    }
    let head = head_of(path);
    let one = match format {
        Format::Ply => ply::open(path, head)?,
        Format::Text => text::open(path, head)?,
        Format::Bin => bin::open(path, head, options)?,
        #[cfg(feature = "las")]
        Format::Las | Format::Laz | Format::Copc => return super::las::open(path, options),
        #[cfg(feature = "e57")]
        Format::E57 => return super::e57::open(path, options.sensor_origin_m.is_some(), &options.budget()),
        other => {
            check_is_read_here(path, other)?;
            let reason = format!("is a file; {other} needs a folder");
            return Err(Error::argument(path.display().to_string(), reason));
        }
    };
    Ok(Box::new(OneCloud::new(format.to_string(), one)))
}

/// Says where other formats are read.
fn check_is_read_here(path: &Path, format: Format) -> Result<()> {
    let reason = match format {
        Format::Pcd => "is PCD, which voxtile itself reads: open it without this crate".to_owned(),
        Format::Bag1 | Format::Mcap | Format::Db3 | Format::Bag2Folder => {
            format!("is a recording ({format}): open it as one, its clouds are in topics")
        }
        Format::Las | Format::Laz | Format::Copc if !cfg!(feature = "las") => {
            format!("is {format}, which this build leaves out: build with the feature `las`")
        }
        Format::E57 if !cfg!(feature = "e57") => {
            "is E57, which this build leaves out: build with the feature `e57`".to_owned()
        }
        _ => return Ok(()),
    };
    Err(Error::argument(path.display().to_string(), reason))
}

//! `voxtile picture`: draws a map as a PNG.

mod ceiling;
mod drawn_json;
mod moving;

use crate::args::{BackgroundName, ColorName, MaxHeight, PictureArgs, ViewName};
use crate::json;
use crate::part::region_of;
use crate::progress::Progress;
use crate::quiet::summary_out;
pub use ceiling::Ceiling;
use drawn_json::DrawnJson;
use indicatif::HumanCount;
use moving::{add_moving, map_with_marks};
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use voxtile::mapper::{MapReader, MapView};
use voxtile::space::Point;
use voxtile::{Error, Result};
use voxtile_distance::DistanceOptions;
use voxtile_pipeline::output::{OutputFile, is_standard_output};
use voxtile_pipeline::{AnyMap, read_any_map};
use voxtile_render::classes::class_label;
use voxtile_render::{
    Background, ColorBy, ColorMap, Drawing, Drawn, Layer, Picture, SideAxis, View, time_labels,
};

/// Draws a map and prints a summary, to standard error if the picture is written to standard output. `is_quiet`
/// suppresses the summary.
pub fn run(args: &PictureArgs, is_quiet: bool) -> anyhow::Result<ExitCode> {
    let is_stream = is_standard_output(&args.output);
    if is_stream && io::stdout().is_terminal() {
        let reason = "standard output is a terminal; redirect it to a file or a pipe";
        return Err(Error::argument("output", reason).into());
    }
    let picture = picture_of(args)?;
    let drawn = match &args.since {
        None => read_any_map(&args.map, |map| {
            check_color(map, args.color)?;
            let with_marks = map_with_marks(args, map)?;
            let progress = Progress::over_tiles(0);
            let mut picture = complete(&picture, args, map)?;
            let on_progress = |done, all| progress.set(done, all);
            if args.from == ViewName::Oblique {
                return Ok((picture.draw(map, on_progress)?, None));
            }
            let drawing = match args.distance_slice {
                None => picture.start(map, on_progress)?,
                Some(_) => {
                    picture.start_distances(map, DistanceOptions::new(args.max_distance), on_progress)?
                }
            };
            drop(progress);
            Ok(finish(drawing, args, with_marks)?)
        }),
        Some(since) => {
            let before = state_before(&args.map, since);
            read_any_map(&args.map, |after| {
                let with_marks = map_with_marks(args, after)?;
                read_any_map(&before, |before| {
                    let progress = Progress::over_tiles(0);
                    let picture = complete(&picture, args, after)?;
                    let on_progress = |done, all| progress.set(done, all);
                    let drawing = picture.start_difference(before, after, on_progress)?;
                    drop(progress);
                    Ok(finish(drawing, args, with_marks)?)
                })
            })
        }
    };
    let (drawn, marked) = drawn?;
    write_png(&drawn, &args.output)?;
    if args.json {
        let of = DrawnJson::of(args, &args.output, &drawn, marked);
        let out: &mut dyn Write = if is_stream { &mut io::stderr() } else { &mut io::stdout() };
        json::print(&of, &mut { out })?;
    } else if !is_stream {
        writeln!(summary_out(false), "{}: {}", args.output.display(), caption(args, &drawn, marked))?;
    } else if !is_quiet {
        writeln!(io::stderr(), "{}", caption(args, &drawn, marked))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Finishes a drawing, with the marked points if their map is given. Also returns the number of all marked points.
fn finish(
    mut drawing: Drawing,
    args: &PictureArgs,
    with_marks: Option<&MapReader>,
) -> Result<(Drawn, Option<u64>)> {
    let marked = with_marks.map(|map| add_moving(map, args, &mut drawing)).transpose()?;
    Ok((drawing.finish(), marked))
}

/// Writes a picture atomically.
pub fn write_png(drawn: &Drawn, path: &Path) -> anyhow::Result<()> {
    let mut file = OutputFile::create(path)?;
    let written = drawn.image.write_png(file.out());
    file.written(written)?;
    file.finish()
}

/// Returns the sensor's positions that the map records. A damaged list of scans gives a warning and no trajectory.
pub fn path_of(map: &AnyMap) -> Vec<Point> {
    let AnyMap::Map(reader) = map else { return Vec::new() };
    match reader.scans() {
        Ok(scans) => scans.iter().map(|scan| scan.origin_m).collect(),
        Err(error) => {
            log::warn!("the trajectory is not drawn: {error:#}");
            Vec::new()
        }
    }
}

/// Returns the last component of a map's path, for a title.
pub fn name_of(map: &Path) -> String {
    let full = map.canonicalize().unwrap_or_else(|_| map.to_owned());
    full.file_name().unwrap_or(full.as_os_str()).to_string_lossy().into_owned()
}

impl From<ColorName> for ColorBy {
    fn from(name: ColorName) -> Self {
        match name {
            ColorName::Height => Self::Height,
            ColorName::Probability => Self::Probability,
            ColorName::Count => Self::Count,
            ColorName::LastScan => Self::LastScan,
            ColorName::Rgb => Self::Layer(Layer::Colour),
            ColorName::Intensity => Self::Layer(Layer::Intensity),
            ColorName::Class => Self::Layer(Layer::Class),
            ColorName::Age => Self::Layer(Layer::Time),
        }
    }
}

impl From<BackgroundName> for Background {
    fn from(name: BackgroundName) -> Self {
        match name {
            BackgroundName::Dark => Self::Dark,
            BackgroundName::Black => Self::Black,
            BackgroundName::White => Self::White,
            BackgroundName::Transparent => Self::Transparent,
        }
    }
}

/// Returns the color map of a name, or the default.
pub fn color_map_of(name: Option<&str>) -> &'static ColorMap {
    name.and_then(ColorMap::named).unwrap_or_else(ColorMap::voxtile)
}

fn picture_of(args: &PictureArgs) -> Result<Picture> {
    if args.from == ViewName::Oblique && (args.moving || args.since.is_some()) {
        let reason = "the oblique view shows a single map, without --moving and --since";
        return Err(Error::argument("--from", reason));
    }
    if args.from != ViewName::Oblique
        && let Some(option) = args.azimuth.map(|_| "--azimuth").or(args.elevation.map(|_| "--elevation"))
    {
        return Err(Error::argument(option, "needs --from oblique"));
    }
    let view = match (args.slice.or(args.distance_slice), args.from) {
        (Some(z_m), ViewName::Above) => View::Slice { z_m, thickness_m: args.thickness.unwrap_or(0.0) },
        (Some(_), _) => {
            let option = if args.slice.is_some() { "--slice" } else { "--distance-slice" };
            return Err(Error::argument(option, "needs the view from above; omit --from, or use --region"));
        }
        (None, ViewName::Above) => View::Above,
        (None, ViewName::SideX) => View::Side(SideAxis::X),
        (None, ViewName::SideY) => View::Side(SideAxis::Y),
        (None, ViewName::Oblique) => {
            View::Oblique { azimuth_deg: args.azimuth_deg(), elevation_deg: args.elevation_deg() }
        }
    };
    let size_px = [usize::from(args.size); 2];
    let mut picture = Picture::new().with_view(view).with_color(args.color.into()).with_size_px(size_px);
    picture = picture.with_grid(!args.no_grid).with_background(args.background.into());
    picture = picture.with_dpi(args.dpi.map(f64::from));
    if args.color_map.is_some() && matches!(args.color, ColorName::Rgb | ColorName::Class) {
        let reason = "--color rgb and --color class have their own colors; omit one of both";
        return Err(Error::argument("--color-map", reason));
    }
    picture = picture.with_color_map(color_map_of(args.color_map.as_deref()));
    if let Some(region) = &args.region {
        picture = picture.with_region(region_of(region)?);
    }
    Ok(picture)
}

/// Adds the trajectory, the height limit and the title.
fn complete(picture: &Picture, args: &PictureArgs, map: &AnyMap) -> Result<Picture> {
    let path = path_of(map);
    let is_layer = args.slice.or(args.distance_slice).is_some();
    // A picture of changes draws them over an unchanged ceiling. A region has an upper limit of its own.
    let is_whole = !is_layer && args.since.is_none() && args.region.is_none();
    let is_from_above = matches!(args.from, ViewName::Above | ViewName::Oblique);
    let ceiling = Ceiling::of(args.max_height, map, &path, is_from_above && is_whole)?;
    let path = if args.no_path { Vec::new() } else { path };
    let resolution_m = map.config().grid.resolution_m();
    let mut title = format!("{}: {resolution_m} m voxels", name_of(&args.map));
    if let Some(z_m) = args.slice.or(args.distance_slice) {
        title += &format!(", height {z_m} m");
    }
    if let Some(since) = &args.since {
        title += &format!(", since {}", since.display());
    }
    title += &ceiling.caption();
    Ok(picture.clone().with_path(path).with_title(title).with_max_height_m(ceiling.max_height_m))
}

fn check_color(map: &AnyMap, color: ColorName) -> Result<()> {
    match (map, color) {
        (AnyMap::Octree(_), ColorName::Count | ColorName::LastScan) => {
            let reason = "an OctoMap file has no counts and no scan numbers; use height or probability";
            Err(Error::argument("--color", reason))
        }
        _ => Ok(()),
    }
}

/// Returns the path of `since`: a map if such a path exists, else the snapshot of this name in `map`.
fn state_before(map: &Path, since: &Path) -> PathBuf {
    if since.exists() || since.to_string_lossy().contains(['@', std::path::MAIN_SEPARATOR]) {
        return since.to_owned();
    }
    let map = map
        .to_str()
        .and_then(|text| text.rsplit_once('@'))
        .filter(|_| !map.exists())
        .map_or(map, |(map, _)| map.as_ref());
    let mut name = OsString::from(map);
    name.push("@");
    name.push(since);
    name.into()
}

/// Returns a one-line summary of the picture. `marked` is the number of points of the map that are marked as moving.
fn caption(args: &PictureArgs, drawn: &Drawn, marked: Option<u64>) -> String {
    let Some(region) = drawn.region_m else { return "no observed voxels here".to_owned() };
    let axes = match args.from {
        ViewName::Above | ViewName::Oblique => [0, 1],
        ViewName::SideX => [0, 2],
        ViewName::SideY => [1, 2],
    };
    let [across, up] = axes.map(|axis| region.max[axis] - region.min[axis]);
    let dark = if color_map_of(args.color_map.as_deref()).is_diverging { "" } else { " (dark)" };
    let scale = match (drawn.range, args.color) {
        (None, ColorName::Class) if args.since.is_none() && !drawn.classes.is_empty() => {
            let labels: Vec<_> = drawn.classes.iter().map(|(class, _)| class_label(*class)).collect();
            format!("; classes {}", labels.join(", "))
        }
        (None, _) if drawn.cells_without_value == drawn.solid_cells && drawn.solid_cells > 0 => {
            "; no value to show: the points of the scans had none".to_owned()
        }
        (None, _) => String::new(),
        (Some([.., most]), _) if args.distance_slice.is_some() => {
            format!("; distance 0 m{dark} to {most} m")
        }
        (Some([least, most]), ColorName::Height) => format!("; height {least:.1} m{dark} to {most:.1} m"),
        (Some([least, most]), ColorName::Probability) => format!("; probability {least}{dark} to {most}"),
        (Some([least, most]), ColorName::Count) => format!("; count {least:.0}{dark} to {most:.0}"),
        (Some([least, most]), ColorName::LastScan) => format!("; last scan {least:.0}{dark} to {most:.0}"),
        (Some([least, most]), ColorName::Intensity) => format!("; intensity {least:.1}{dark} to {most:.1}"),
        (Some(range), ColorName::Age) => {
            let [first, last] = time_labels(range);
            format!("; last hit {first}{dark} to {last}")
        }
        (Some(_), ColorName::Rgb | ColorName::Class) => String::new(),
    };
    let ceiling = match (drawn.max_height_m, args.max_height) {
        (Some(height_m), MaxHeight::Auto) => {
            format!("; ceiling cut at {height_m:.2} m, the height of the sensor")
        }
        _ => String::new(),
    };
    let changes = if args.since.is_some() { "; blue appeared, orange vanished, grey unchanged" } else { "" };
    let moving = match (marked, drawn.moving_points.unwrap_or_default()) {
        (None, _) => String::new(),
        (Some(0), _) => "; no point is marked as moving: `voxtile clean` marks them".to_owned(),
        (Some(marked), drawn) if marked == drawn => format!("; {} moving points", HumanCount(marked)),
        (Some(marked), drawn) => format!("; {} of {} moving points", HumanCount(drawn), HumanCount(marked)),
    };
    format!("{across:.1} x {up:.1} m, {:.3} m per cell{scale}{ceiling}{changes}{moving}", drawn.cell_m)
}

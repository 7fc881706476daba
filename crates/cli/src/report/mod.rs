//! `voxtile report`: writes an HTML report on a map as one file.

mod page;
mod svg;

use crate::args::ReportArgs;
use crate::counted::Counted;
use crate::info::Info;
use crate::json;
use crate::picture::{Ceiling, color_map_of, name_of, path_of};
use crate::progress::Progress;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use voxtile::integrity::{Finding, Verification, verify};
use voxtile::mapper::{MapReader, MapView};
use voxtile::operations::{SnapshotInfo, snapshots};
use voxtile::store::ScanRecord;
use voxtile::{Error, TileIndex};
use voxtile_pipeline::memory;
use voxtile_pipeline::output::{OutputFile, is_standard_output};
use voxtile_pipeline::place::place_of;
use voxtile_pipeline::{AnyMap, MapAt, read_any_map};
use voxtile_render::{ColorBy, ColorMap, Drawn, Layer, Picture, SideAxis, Survey, View};

/// Content of the report.
struct Report {
    name: String,
    /// Reason why the map could not be read.
    unreadable: Option<String>,
    content: Option<Content>,
    snapshots: std::result::Result<Vec<SnapshotInfo>, String>,
    damage: Damage,
}

/// Content for a map that opens.
struct Content {
    info: Info,
    survey: Survey,
    above: Drawn,
    side: Drawn,
    ceiling: Ceiling,
    color_map: &'static ColorMap,
    /// Pictures by the layers that the map has, with their captions.
    layers: Vec<(Drawn, &'static str)>,
    scans: std::result::Result<Vec<ScanRecord>, String>,
    sizes: Sizes,
}

/// Table sizes of the tiles; empty for a map of the original format.
struct Sizes {
    largest: Vec<(TileIndex, u64, Option<u64>)>,
    /// Sizes of all tiles, ascending.
    bytes: Vec<u64>,
}

/// Result of `verify`.
enum Damage {
    NotVerified,
    /// Not checked: snapshots are verified with their map.
    OfSnapshot,
    Checked {
        verification: Verification,
        findings: Vec<Finding>,
    },
    Failed(String),
}

/// Sizes of the pictures in pixels: sharp in print, with a page of one to two megabytes.
const ABOVE_PX: [usize; 2] = [1400, 1400];
const SIDE_PX: [usize; 2] = [1400, 500];
/// Maximum number of findings on the page; the rest are counted.
const MAX_FINDINGS: usize = 200;
/// Maximum number of tiles on the page.
const MAX_TILES: usize = 10;

/// Writes the page and prints its path, to standard error if the page is written to standard output. `is_quiet`
/// suppresses the path.
pub fn run(args: &ReportArgs, is_quiet: bool) -> anyhow::Result<ExitCode> {
    let report = Report::of(args)?;
    let mut file = OutputFile::create(&args.output)?;
    let written = report.write(file.out());
    file.written(written)?;
    file.finish()?;
    let is_stream = is_standard_output(&args.output);
    let out: &mut dyn Write = if is_stream { &mut io::stderr() } else { &mut io::stdout() };
    if args.json {
        json::print(&report.to_json(args), &mut { out })?;
    } else if !is_quiet {
        let damage = report.damage_count().filter(|&count| count > 0);
        let damage = damage
            .map_or(String::new(), |count| format!("; the map is damaged, {}", Counted(count, "finding")));
        writeln!(out, "{}: report on {}{damage}", args.output.display(), args.map.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Report {
    fn of(args: &ReportArgs) -> anyhow::Result<Self> {
        let MapAt { map, snapshot } = MapAt::of(&args.map)?;
        let (content, unreadable) = match read_any_map(&args.map, |map| Content::of(map, args)) {
            Ok(content) => (Some(content), None),
            Err(error) => match error.downcast_ref::<Error>() {
                Some(Error::Damaged { .. } | Error::Malformed { .. }) => (None, Some(format!("{error:#}"))),
                _ => return Err(error),
            },
        };
        let damage = match &snapshot {
            _ if args.no_verify => Damage::NotVerified,
            Some(_) => Damage::OfSnapshot,
            None => Damage::of(&map),
        };
        let snapshots = place_of(&map).and_then(snapshots).map_err(|error| format!("{error:#}"));
        Ok(Self { name: name_of(&args.map), unreadable, content, snapshots, damage })
    }

    fn damage_count(&self) -> Option<u64> {
        match &self.damage {
            Damage::Checked { verification, .. } => Some(verification.damage),
            _ => None,
        }
    }

    fn to_json(&self, args: &ReportArgs) -> serde_json::Value {
        serde_json::json!({
            "map": args.map.display().to_string(),
            "file": args.output.display().to_string(),
            "readable": self.content.is_some(),
            "survey": self.content.as_ref().map(|content| &content.survey),
            "max_height_m": self.content.as_ref().and_then(|content| content.above.max_height_m),
            "damage": self.damage_count(),
            "peak_rss_bytes": memory::peak_bytes(),
        })
    }
}

impl Content {
    fn of(map: &AnyMap, args: &ReportArgs) -> anyhow::Result<Self> {
        let path = &args.map;
        let AnyMap::Map(reader) = map else {
            let reason =
                "is an OctoMap file; convert it with `voxtile import`, or draw it with `voxtile picture`";
            return Err(Error::argument(path.display().to_string(), reason).into());
        };
        let progress = Progress::over_tiles(0);
        let on_progress = |done, all| progress.set(done, all);
        let info = Info::of(reader)?;
        let resolution_m = info.resolution_m;
        let trajectory = path_of(map);
        let ceiling = Ceiling::of(args.max_height, map, &trajectory, true)?;
        let color_map = color_map_of(args.color_map.as_deref());
        let picture = Picture::new().with_path(trajectory).with_color_map(color_map).skipping_unreadable();
        let title = |what: &str| format!("{} {what}: {resolution_m} m voxels", name_of(path));
        let above_title = title("from above") + &ceiling.caption();
        let above = picture.clone().with_size_px(ABOVE_PX).with_title(above_title);
        let above = above.with_max_height_m(ceiling.max_height_m);
        // Look along the shorter side, which shows the longer one.
        let is_long_in_y = info.bounds_m.is_some_and(|b| b.max[1] - b.min[1] > b.max[0] - b.min[0]);
        let axis = if is_long_in_y { SideAxis::Y } else { SideAxis::X };
        let of_layer = |layer: Layer, caption: &'static str| {
            let above = above.clone().with_color(ColorBy::Layer(layer));
            let drawn =
                layer.is_in(&reader.config().layers()).then(|| above.draw(reader.as_ref(), on_progress));
            Ok::<_, Error>(drawn.transpose()?.map(|drawn| (drawn, caption)))
        };
        let layers = [
            of_layer(Layer::Colour, "In color: the mean of the points in the topmost occupied voxel.")?,
            of_layer(
                Layer::Class,
                "By class: that of most points in the topmost occupied voxel, by the names of LAS.",
            )?,
        ];
        let side =
            picture.with_view(View::Side(axis)).with_size_px(SIDE_PX).with_title(title("from the side"));
        Ok(Self {
            above: above.draw(reader.as_ref(), on_progress)?,
            side: side.draw(reader.as_ref(), on_progress)?,
            layers: layers.into_iter().flatten().collect(),
            survey: Survey::of(reader.as_ref(), on_progress)?,
            scans: reader.scans().map_err(|error| format!("{error:#}")),
            sizes: Sizes::of(reader),
            ceiling,
            color_map,
            info,
        })
    }
}

impl Sizes {
    fn of(reader: &MapReader) -> Self {
        let tiles = reader.tile_indices();
        let mut sizes: Vec<_> = tiles
            .into_iter()
            .filter_map(|tile| Some((tile, reader.tile_bytes(tile)?, reader.voxels_of_tile_hint(tile))))
            .collect();
        sizes.sort_by_key(|&(tile, bytes, _)| (std::cmp::Reverse(bytes), tile));
        let bytes = sizes.iter().rev().map(|&(_, bytes, _)| bytes).collect();
        sizes.truncate(MAX_TILES);
        Self { largest: sizes, bytes }
    }
}

impl Damage {
    fn of(map: &Path) -> Self {
        let progress = Progress::over_tiles(0);
        let mut findings = Vec::new();
        let found = |finding: &Finding| {
            if findings.len() < MAX_FINDINGS {
                findings.push(finding.clone());
            }
        };
        let verified = place_of(map).and_then(|map| verify(map, found, |done, all| progress.set(done, all)));
        match verified {
            Ok(verification) => Self::Checked { verification, findings },
            Err(error) => Self::Failed(format!("{error:#}")),
        }
    }
}

use crate::args::{ColorName, PictureArgs, ViewName};
use clap::ValueEnum;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use voxtile::space::Aabb;
use voxtile_pipeline::memory;
use voxtile_render::Drawn;

/// JSON summary of a picture.
#[derive(Serialize)]
pub struct DrawnJson {
    file: String,
    from: String,
    /// Direction to the viewer; of the oblique view.
    azimuth_deg: Option<f64>,
    elevation_deg: Option<f64>,
    slice_m: Option<f64>,
    /// `None` for a picture of changes.
    color: Option<String>,
    color_map: Option<String>,
    since: Option<String>,
    width_px: usize,
    height_px: usize,
    /// Pixels per inch.
    dpi: f64,
    /// Map's rectangle in the image: left, top, width, height.
    map_px: [usize; 4],
    region_m: Option<Aabb>,
    /// Height limit; `None` if there is none.
    max_height_m: Option<f64>,
    cell_m: f64,
    cell_px: usize,
    /// Values of the first and the last color.
    range: Option<[f64; 2]>,
    known_cells: u64,
    solid_cells: u64,
    /// Cells of each class; with `--color class`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    classes: BTreeMap<u8, u64>,
    /// Points marked as moving that are drawn; with `--moving`.
    moving_points: Option<u64>,
    /// Points of all kept scans that are marked as moving; with `--moving`.
    marked_points: Option<u64>,
    tiles: u64,
    peak_rss_bytes: Option<u64>,
}

impl DrawnJson {
    pub fn of(args: &PictureArgs, file: &Path, drawn: &Drawn, marked_points: Option<u64>) -> Self {
        let is_oblique = args.from == ViewName::Oblique;
        Self {
            file: file.display().to_string(),
            from: view_name(args.from),
            azimuth_deg: is_oblique.then(|| args.azimuth_deg()),
            elevation_deg: is_oblique.then(|| args.elevation_deg()),
            slice_m: args.slice.or(args.distance_slice),
            color: match args.distance_slice {
                Some(_) => Some("distance".to_owned()),
                None => args.since.is_none().then(|| color_name(args.color)),
            },
            color_map: args.color_map.clone(),
            since: args.since.as_ref().map(|since| since.display().to_string()),
            width_px: drawn.image.width_px(),
            height_px: drawn.image.height_px(),
            dpi: drawn.image.dpi(),
            map_px: drawn.map_px,
            region_m: drawn.region_m,
            max_height_m: drawn.max_height_m,
            cell_m: drawn.cell_m,
            cell_px: drawn.cell_px,
            range: drawn.range,
            known_cells: drawn.known_cells,
            solid_cells: drawn.solid_cells,
            classes: drawn.classes.iter().copied().collect(),
            moving_points: drawn.moving_points,
            marked_points,
            tiles: drawn.tiles,
            peak_rss_bytes: memory::peak_bytes(),
        }
    }
}

fn view_name(view: ViewName) -> String {
    name(&view)
}

fn color_name(color: ColorName) -> String {
    name(&color)
}

/// Returns the name of the value on the command line.
fn name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

use super::canvas::Canvas;
use super::cells::{Cell, Rank};
use super::collect::{Collected, Content, Known, seen};
use super::compared::{ComparedBox, color_of_rank, legend_entries};
use super::image::Image;
use super::layer_cells::LayerValue;
use super::layout::Layout;
use super::legend::{Entry, Legend, Pen, Scale, moving_entry};
use super::measure::Measure;
use super::moving::Moving;
use super::options::Picture;
use super::palette::{self, Rgb, lit, mixed};
use super::pane::Pane;
use super::theme::Theme;
use super::trajectory::draw_trajectory;
use super::values::Values;
use super::view::{Change, ColorBy};
use std::collections::BTreeMap;
use voxtile::space::{Aabb, Grid, Point, TileIndex};
use voxtile::{Layers, MapConfig};

/// A picture with its scale and extent.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Drawn {
    /// Pixels.
    pub image: Image,
    /// Rectangle of the map without margins: upper left pixel, width and height.
    pub map_px: [usize; 4],
    /// Box covered by the map's part of the image, in metres; along the line of sight, the range that was searched.
    /// `None` if there was nothing to draw.
    pub region_m: Option<Aabb>,
    /// Height limit in metres.
    pub max_height_m: Option<f64>,
    /// Edge length of a cell in metres: one voxel or several.
    pub cell_m: f64,
    /// Edge length of a cell in pixels.
    pub cell_px: usize,
    /// Values of the first and the last color; times in seconds. `None` for a difference, for colors and classes, and
    /// without occupied voxels.
    pub range: Option<[f64; 2]>,
    /// Number of cells with an occupied voxel, in either state for a difference.
    pub solid_cells: u64,
    /// Number of cells with an observed voxel.
    pub known_cells: u64,
    /// Number of cells of each class, in ascending order; empty unless classes are shown.
    pub classes: Vec<(u8, u64)>,
    /// Number of cells with an occupied voxel but without a value of the layer that is shown.
    pub cells_without_value: u64,
    /// Number of points on moving objects in the picture; `None` if [`Drawing::add_moving`] was not called.
    pub moving_points: Option<u64>,
    /// Number of tiles that were read.
    pub tiles: u64,
    /// Tiles that could not be read and are missing.
    pub unread: Vec<TileIndex>,
}

/// A picture whose tiles are read. Points can be added before it is finished.
pub struct Drawing<'a> {
    picture: &'a Picture,
    grid: Grid,
    layers: Layers,
    has_crs: bool,
    pub(super) collected: Collected,
    range: Option<[f64; 2]>,
    moving: Option<Moving>,
    pub(super) boxes: Vec<ComparedBox>,
}

/// Maximum size of a voxel in pixels, for small maps.
const LARGEST_ZOOM: usize = 48;
/// Size of an image without a map.
const EMPTY_SIZE: [usize; 2] = [760, 240];
/// Width of grid lines in points.
const LINE_PT: f64 = 0.25;
/// Names of the axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

impl<'a> Drawing<'a> {
    pub(super) fn new(picture: &'a Picture, config: &MapConfig, collected: Collected) -> Self {
        let (grid, layers) = (config.grid, config.layers());
        let boxes = Vec::new();
        let has_crs = config.crs.is_some();
        let mut drawing =
            Self { picture, grid, layers, has_crs, collected, range: None, moving: None, boxes };
        drawing.range = drawing.range();
        drawing
    }

    /// Adds points on moving objects, in metres, world frame; they cover the map, with a line in the legend. Points
    /// outside of the picture, its region or its slice are not drawn. May be called for each scan: only cells are kept.
    pub fn add_moving(&mut self, points_m: &[Point]) {
        let moving = self.moving.get_or_insert_default();
        if let Some(known) = &self.collected.known {
            moving.add(points_m, &self.grid, &known.frame, with_air(known));
        }
    }

    /// Draws the picture.
    pub fn finish(mut self) -> Drawn {
        let Some(known) = self.take_known() else {
            let moving_points = self.moving.map(|moving| moving.points);
            let Collected { tiles, unread, .. } = self.collected;
            return Drawn { moving_points, ..nothing(self.picture, &self.grid, tiles, unread) };
        };
        let (first, cells) = with_air(&known);
        let most_px = self.picture.most_px;
        let zoom = (0..2).map(|k| most_px[k] / cells[k]).min().unwrap_or(1).clamp(1, LARGEST_ZOOM);
        let size = cells.map(|n| n * zoom);
        let (classes, cells_without_value) = self.counts(&known);
        let entries = self.entries(&classes, cells_without_value);
        let layout = Layout::of(self.picture, size, &entries);
        let pane = Pane { first, cells, zoom, left: layout.left, top: layout.top };
        let (theme, measure) = (self.theme(), layout.measure);
        let mut canvas = Canvas::new(layout.width, layout.height, &theme);
        self.draw_cells(&mut canvas, &known, &pane);
        let cell_m = known.frame.voxels_a_cell as f64 * self.grid.resolution_m();
        let pixels_a_metre = zoom as f64 / cell_m;
        let lines_m = self.picture.has_grid.then(|| self.line_spacing_m(pixels_a_metre));
        if let Some(every_m) = lines_m {
            self.draw_tile_lines(&mut canvas, &known, &pane, every_m, measure.px(LINE_PT));
        }
        if let Some(moving) = &self.moving {
            moving.draw(&mut canvas, &known.frame, &pane, theme.ink);
        }
        let resolution_m = self.grid.resolution_m();
        let color = if self.collected.content == Content::Values { theme.path } else { theme.ink };
        draw_trajectory(
            &mut canvas,
            self.picture,
            &known,
            &pane,
            resolution_m,
            measure,
            [color, theme.ground],
        );
        for of_change in &self.boxes {
            of_change.draw(&mut canvas, &known.frame, &pane, resolution_m, measure);
        }
        if self.picture.has_legend {
            let title = measure.title().fitted(&self.picture.title, layout.width - 2 * layout.margin);
            canvas.text(layout.margin, layout.margin, measure.title(), theme.ink, &title);
            let axes = self.picture.view.axes();
            let legend = Legend {
                metres_a_pixel: 1.0 / pixels_a_metre,
                lines_m,
                axes: vec![(AXES[axes[0]], [1.0, 0.0]), (AXES[axes[1]], [0.0, -1.0])],
                has_north: self.has_crs,
                has_path: !self.picture.path.is_empty(),
                has_space: self.collected.content != Content::Comparison,
                scale: self.scale(),
                entries,
            };
            legend.draw(&mut Pen { canvas: &mut canvas, foot: layout.foot, measure, theme: &theme });
        }
        let voxels = known.frame.voxels_of(first, cells);
        let corner_m = |voxel: [i32; 3]| voxel.map(|index| self.grid.corner_m(index));
        let count = |from: Rank| known.shown().filter(|(_, cell)| cell.rank >= from).count() as u64;
        Drawn {
            image: canvas.into_image(measure.dpi()),
            map_px: [pane.left, pane.top, size[0], size[1]],
            region_m: Some(Aabb { min: corner_m(voxels.min), max: corner_m(voxels.end) }),
            max_height_m: self.picture.max_height_m,
            cell_m,
            cell_px: zoom,
            range: self.range.filter(|_| self.collected.content == Content::Values),
            solid_cells: count(Rank::Occupied),
            known_cells: count(Rank::Free),
            classes,
            cells_without_value,
            moving_points: self.moving.map(|moving| moving.points),
            tiles: self.collected.tiles,
            unread: self.collected.unread,
        }
    }

    /// Returns the cells; none if a comparison has added no voxel.
    fn take_known(&mut self) -> Option<Known> {
        let known = self.collected.known.take()?;
        if self.collected.content != Content::Comparison {
            return Some(known);
        }
        let (first, count) = seen(&known.frame, &known.cells, 0.0)?;
        Some(Known { first, count, ..known })
    }

    fn theme(&self) -> Theme {
        Theme::of(self.picture.background)
    }

    fn scale(&self) -> Scale {
        match self.collected.content {
            Content::Values => Scale::Values {
                color_by: self.picture.color_by,
                color_map: self.picture.color_map,
                range: self.range,
            },
            Content::Difference => Scale::Change,
            Content::Comparison => Scale::Comparison,
        }
    }

    /// Returns the number of cells of each class, and of those without a value of the layer that is shown.
    fn counts(&self, known: &Known) -> (Vec<(u8, u64)>, u64) {
        let Some(layer) = &known.cells.layer else { return (Vec::new(), 0) };
        let (mut classes, mut without) = (BTreeMap::new(), 0);
        for (place, _) in known.shown().filter(|(_, cell)| cell.rank == Rank::Occupied) {
            match layer.at(place) {
                Some(LayerValue::Class(class)) => *classes.entry(class).or_default() += 1,
                Some(_) => {}
                None => without += 1,
            }
        }
        (classes.into_iter().collect(), without)
    }

    /// Returns the entries of the legend.
    fn entries(&self, classes: &[(u8, u64)], cells_without_value: u64) -> Vec<Entry> {
        if self.collected.content == Content::Comparison {
            return legend_entries();
        }
        let mut entries = self.values().entries(classes, cells_without_value);
        entries.extend(self.moving.as_ref().map(|moving| moving_entry(moving.points)));
        entries
    }

    fn values(&self) -> Values<'_> {
        Values { picture: self.picture, layers: self.layers, range: self.range }
    }

    /// Returns the values of the first and the last color. Up to 2 % of the cells at either end may be outside the
    /// range.
    ///
    /// Probabilities always have the same range, so that pictures can be compared.
    fn range(&self) -> Option<[f64; 2]> {
        let known = self.collected.known.as_ref()?;
        let least = match self.picture.color_by {
            ColorBy::Probability => return Some([0.5, 1.0]),
            ColorBy::Distance => return Some([0.0, self.collected.max_distance_m]),
            ColorBy::Height => Rank::Occupied,
            ColorBy::Count | ColorBy::LastScan => Rank::Free,
            ColorBy::Layer(_) => {
                let layer = known.cells.layer.as_ref()?;
                let cells = known.shown().filter(|(_, cell)| cell.rank == Rank::Occupied);
                let values = cells.filter_map(|(place, _)| self.values().number_of(layer.at(place)?));
                return self.values().range_of(values.collect());
            }
        };
        let cells = known.shown().filter(|(_, cell)| cell.rank >= least);
        self.values().range_of(cells.map(|(_, cell)| f64::from(cell.value)).collect())
    }

    fn draw_cells(&self, canvas: &mut Canvas, known: &Known, pane: &Pane) {
        for up in pane.first[1]..pane.first[1] + pane.cells[1] {
            for across in pane.first[0]..pane.first[0] + pane.cells[0] {
                let cell = known.cell([across, up]);
                let Some(color) = self.color(known, [across, up], cell) else { continue };
                let light =
                    if cell.rank.is_shaded() { self.light(known, [across, up], cell.near) } else { 1.0 };
                let [left, top] = pane.pixel([across, up]);
                canvas.fill(left, top, [pane.zoom; 2], lit(color, light), 1.0);
            }
        }
    }

    /// Returns the color of a cell before shading; `None` if it is unknown.
    fn color(&self, known: &Known, at: [usize; 2], cell: Cell) -> Option<Rgb> {
        let values = self.values();
        let theme = self.theme();
        let value_color = || values.color_of(f64::from(cell.value));
        match cell.rank {
            Rank::Unknown => None,
            Rank::Changed(Change::Same) => Some(palette::SAME),
            Rank::Changed(Change::Vanished) => Some(palette::VANISHED),
            Rank::Changed(Change::Appeared) => Some(palette::APPEARED),
            Rank::Compared(class) | Rank::InFront(class) => color_of_rank(class),
            Rank::Occupied if self.picture.color_by == ColorBy::Distance => Some(theme.ink),
            Rank::Occupied => Some(match &known.cells.layer {
                Some(layer) => values.color_of_layer(layer.at(known.place(at))),
                None => value_color(),
            }),
            Rank::Free => match self.picture.color_by {
                _ if self.collected.content != Content::Values => Some(theme.free),
                ColorBy::Height | ColorBy::Probability | ColorBy::Layer(_) => Some(theme.free),
                ColorBy::Distance => Some(value_color()),
                ColorBy::Count | ColorBy::LastScan => Some(mixed(theme.ground, value_color(), 0.4)),
            },
        }
    }

    /// Returns the brightness factor of a cell for light from the upper left: brighter if the cell rises above its left
    /// and upper neighbours, darker if it lies below them.
    fn light(&self, known: &Known, [across, up]: [usize; 2], near: i32) -> f64 {
        let rise_m = |at: [usize; 2]| {
            let other = known.cell(at);
            let rise = f64::from(near) - f64::from(other.near);
            if other.rank.is_solid() { (rise * self.grid.resolution_m()).clamp(-2.0, 2.0) } else { 0.0 }
        };
        let left_m = if across > 0 { rise_m([across - 1, up]) } else { 0.0 };
        let above_m = if up + 1 < known.frame.cells[1] { rise_m([across, up + 1]) } else { 0.0 };
        (1.0 + 0.1 * (left_m + above_m)).clamp(0.72, 1.22)
    }

    fn draw_tile_lines(&self, canvas: &mut Canvas, known: &Known, pane: &Pane, every_m: f64, width: usize) {
        let color = self.theme().line;
        let (size, frame) = (pane.size(), &known.frame);
        let every = ((every_m / self.grid.resolution_m()).round() as i64).max(1);
        for (k, axis) in frame.view.axes().into_iter().enumerate() {
            let low = i64::from(frame.voxels.min[axis]) + pane.first[k] as i64 * frame.voxels_a_cell;
            let end = low + pane.cells[k] as i64 * frame.voxels_a_cell;
            let first = low.div_euclid(every) * every;
            let lines = std::iter::successors(Some(first), |line| Some(line + every));
            for line in lines.skip_while(|&line| line < low).take_while(|&line| line <= end) {
                let at =
                    ((line - low) as f64 / frame.voxels_a_cell as f64 * pane.zoom as f64).round() as usize;
                if k == 0 {
                    let left = pane.left + at.min(size[0] - 1);
                    canvas.fill(
                        left,
                        pane.top,
                        [width.min(size[0] - at.min(size[0] - 1)), size[1]],
                        color,
                        0.2,
                    );
                } else {
                    let row = size[1].saturating_sub(at.max(1));
                    canvas.fill(pane.left, pane.top + row, [size[0], width.min(size[1] - row)], color, 0.2);
                }
            }
        }
    }

    /// Returns the distance between grid lines in metres: one tile, or ten or a hundred of them if lines would be too
    /// dense.
    fn line_spacing_m(&self, pixels_a_metre: f64) -> f64 {
        let mut every_m = self.grid.tile_size_m();
        while every_m * pixels_a_metre < 16.0 {
            every_m *= 10.0;
        }
        every_m
    }
}

impl Known {
    fn place(&self, [across, up]: [usize; 2]) -> usize {
        across + up * self.frame.cells[0]
    }

    /// Returns the places and contents of the cells in the picture.
    fn shown(&self) -> impl Iterator<Item = (usize, Cell)> {
        let (first, count) = with_air(self);
        let rows = first[1]..first[1] + count[1];
        let places = rows.flat_map(move |up| (0..count[0]).map(move |k| self.place([first[0] + k, up])));
        places.map(|place| (place, self.cells.at(place)))
    }

    fn cell(&self, at: [usize; 2]) -> Cell {
        self.cells.at(self.place(at))
    }
}

/// Returns the cells to show: all known ones with a margin.
fn with_air(known: &Known) -> ([usize; 2], [usize; 2]) {
    let air = known.count[0].max(known.count[1]) / 60;
    let first: [usize; 2] = std::array::from_fn(|k| known.first[k].saturating_sub(air));
    let end = |k: usize| (known.first[k] + known.count[k] + air).min(known.frame.cells[k]);
    (first, std::array::from_fn(|k| end(k) - first[k]))
}

/// Returns a picture without voxels.
pub(super) fn nothing(picture: &Picture, grid: &Grid, tiles: u64, unread: Vec<TileIndex>) -> Drawn {
    // Type of another size would not fit.
    let measure = Measure::of(EMPTY_SIZE, None);
    let size = if picture.has_legend { EMPTY_SIZE } else { [1; 2] };
    let theme = Theme::of(picture.background);
    let mut canvas = Canvas::new(size[0], size[1], &theme);
    if picture.has_legend {
        let title = measure.title().fitted(&picture.title, size[0] - 40);
        canvas.text(20, 20, measure.title(), theme.ink, &title);
        let (text, label) = ("no observed voxels here", measure.label());
        let left = size[0].saturating_sub(label.width_of(text)) / 2;
        canvas.text(left, size[1] / 2, label, theme.faint_ink, text);
    }
    Drawn {
        image: canvas.into_image(measure.dpi()),
        map_px: [0; 4],
        region_m: None,
        max_height_m: picture.max_height_m,
        cell_m: grid.resolution_m(),
        cell_px: 1,
        range: None,
        solid_cells: 0,
        known_cells: 0,
        classes: Vec::new(),
        cells_without_value: 0,
        moving_points: None,
        tiles,
        unread,
    }
}

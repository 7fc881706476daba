use super::canvas::Canvas;
use super::cells::{Cell, Rank};
use super::collect::{Collected, Content, Known, seen};
use super::compared::{ComparedBox, color_of_rank, legend_entries};
use super::font;
use super::image::Image;
use super::layer_cells::LayerValue;
use super::legend::{Entry, Legend, Scale, legend_height, moving_entry};
use super::moving::Moving;
use super::options::Picture;
use super::palette::{self, Rgb, color_of, lit, mixed};
use super::time_labels::short_time_labels;
use super::view::{Change, ColorBy};
use crate::Layer;
use crate::classes::{class_color, class_label};
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

/// Visible cells and their position in the image.
pub(super) struct Pane {
    first: [usize; 2],
    cells: [usize; 2],
    /// Edge length of a cell in pixels.
    pub zoom: usize,
    left: usize,
    top: usize,
}

/// A picture whose tiles are read. Points can be added before it is finished.
pub struct Drawing<'a> {
    picture: &'a Picture,
    grid: Grid,
    layers: Layers,
    pub(super) collected: Collected,
    range: Option<[f64; 2]>,
    moving: Option<Moving>,
    pub(super) boxes: Vec<ComparedBox>,
}

/// Minimum width of the legend.
const MIN_WIDTH: usize = 760;
/// Maximum size of a voxel in pixels, for small maps.
const LARGEST_ZOOM: usize = 48;
const SECONDS_A_NS: f64 = 1e-9;
/// Size of an image without a map.
const EMPTY_SIZE: [usize; 2] = [MIN_WIDTH, 240];

impl Pane {
    fn size(&self) -> [usize; 2] {
        self.cells.map(|n| n * self.zoom)
    }

    /// Returns the upper left pixel of a cell; rows are numbered downwards.
    pub fn pixel(&self, [across, up]: [usize; 2]) -> [usize; 2] {
        let row = self.cells[1] - 1 - (up - self.first[1]);
        [self.left + (across - self.first[0]) * self.zoom, self.top + row * self.zoom]
    }

    /// Returns the distance of a position in cells from the lower left corner, in pixels.
    fn offset_px(&self, position: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|k| (position[k] - self.first[k] as f64) * self.zoom as f64)
    }

    /// Returns the pixel at a corner of cells, moved to the border if it is outside.
    pub fn corner_px(&self, position: [f64; 2]) -> [usize; 2] {
        let (at, size) = (self.offset_px(position), self.size());
        let [across, up] = [0, 1].map(|k| at[k].round().clamp(0.0, size[k] as f64) as usize);
        [self.left + across, self.top + size[1] - up]
    }

    /// Returns the pixel of a position in cells, if it is inside.
    fn pixel_of(&self, position: [f64; 2]) -> Option<[usize; 2]> {
        let at = self.offset_px(position);
        let size = self.size();
        let is_inside = (0..2).all(|k| at[k] >= 0.0 && at[k] < size[k] as f64);
        is_inside.then(|| [self.left + at[0] as usize, self.top + size[1] - 1 - at[1] as usize])
    }
}

impl<'a> Drawing<'a> {
    pub(super) fn new(picture: &'a Picture, config: &MapConfig, collected: Collected) -> Self {
        let (grid, layers) = (config.grid, config.layers());
        let boxes = Vec::new();
        let mut drawing = Self { picture, grid, layers, collected, range: None, moving: None, boxes };
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
        let Some(known) = self.take_known() else { return self.draw_nothing() };
        let (first, cells) = with_air(&known);
        let most_px = self.picture.most_px;
        let zoom = (0..2).map(|k| most_px[k] / cells[k]).min().unwrap_or(1).clamp(1, LARGEST_ZOOM);
        let size = cells.map(|n| n * zoom);
        let (classes, cells_without_value) = self.counts(&known);
        let entries = self.entries(&classes, cells_without_value);
        let layout = Layout::of(self.picture, size, &entries);
        let pane = Pane { first, cells, zoom, left: layout.left, top: layout.top };
        let mut canvas = Canvas::new(layout.width, layout.height, palette::UNKNOWN);
        self.draw_cells(&mut canvas, &known, &pane);
        let cell_m = known.frame.voxels_a_cell as f64 * self.grid.resolution_m();
        let pixels_a_metre = zoom as f64 / cell_m;
        let lines_m = self.picture.has_grid.then(|| self.line_spacing_m(pixels_a_metre));
        if let Some(every_m) = lines_m {
            self.draw_tile_lines(&mut canvas, &known, &pane, every_m);
        }
        if let Some(moving) = &self.moving {
            moving.draw(&mut canvas, &known.frame, &pane);
        }
        self.draw_path(&mut canvas, &known, &pane, layout.dot);
        for of_change in &self.boxes {
            of_change.draw(&mut canvas, &known.frame, &pane, self.grid.resolution_m(), layout.dot);
        }
        if self.picture.has_legend {
            canvas.text(layout.margin, layout.margin, layout.dot, palette::INK, &self.title(&layout));
            let legend = Legend {
                metres_a_pixel: 1.0 / pixels_a_metre,
                lines_m,
                axes: self.picture.view.axes(),
                has_path: !self.picture.path.is_empty(),
                scale: self.scale(),
                entries,
            };
            legend.draw(&mut canvas, layout.foot, layout.dot);
        }
        let voxels = known.frame.voxels_of(first, cells);
        let corner_m = |voxel: [i32; 3]| voxel.map(|index| self.grid.corner_m(index));
        let count = |from: Rank| known.cells.iter().filter(|cell| cell.rank >= from).count() as u64;
        Drawn {
            image: canvas.into_image(),
            map_px: [pane.left, pane.top, size[0], size[1]],
            region_m: Some(Aabb { min: corner_m(voxels.min), max: corner_m(voxels.end) }),
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
        let (first, count) = seen(&known.frame, &known.cells)?;
        Some(Known { first, count, ..known })
    }

    /// Draws a picture without cells.
    fn draw_nothing(self) -> Drawn {
        let size = if self.picture.has_legend { EMPTY_SIZE } else { [1; 2] };
        let mut canvas = Canvas::new(size[0], size[1], palette::UNKNOWN);
        if self.picture.has_legend {
            canvas.text(20, 20, 2, palette::INK, &self.picture.title);
            let text = "no observed voxels here";
            let left = (size[0] - 2 * font::width_of(text)) / 2;
            canvas.text(left, size[1] / 2, 2, palette::FAINT_INK, text);
        }
        Drawn {
            image: canvas.into_image(),
            map_px: [0; 4],
            region_m: None,
            cell_m: self.grid.resolution_m(),
            cell_px: 1,
            range: None,
            solid_cells: 0,
            known_cells: 0,
            classes: Vec::new(),
            cells_without_value: 0,
            moving_points: self.moving.map(|moving| moving.points),
            tiles: self.collected.tiles,
            unread: self.collected.unread,
        }
    }

    fn title(&self, layout: &Layout) -> String {
        let letters = (layout.width - 2 * layout.margin) / (font::ADVANCE * layout.dot);
        self.picture.title.chars().take(letters).collect()
    }

    fn scale(&self) -> Scale {
        match self.collected.content {
            Content::Values => Scale::Values { color_by: self.picture.color_by, range: self.range },
            Content::Difference => Scale::Change,
            Content::Comparison => Scale::Comparison,
        }
    }

    /// Returns the number of cells of each class, and of those without a value of the layer that is shown.
    fn counts(&self, known: &Known) -> (Vec<(u8, u64)>, u64) {
        let Some(layer) = &known.cells.layer else { return (Vec::new(), 0) };
        let (mut classes, mut without) = (BTreeMap::new(), 0);
        for (place, _) in known.cells.iter().enumerate().filter(|(_, cell)| cell.rank == Rank::Occupied) {
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
        let class =
            |&(class, _): &(u8, u64)| Entry { color: Some(class_color(class)), label: class_label(class) };
        let mut entries: Vec<Entry> = classes.iter().map(class).collect();
        if let (ColorBy::Layer(layer), 1..) = (self.picture.color_by, cells_without_value) {
            let name = match layer {
                Layer::Colour => "color",
                layer => layer.name(),
            };
            entries.push(Entry { color: Some(palette::NO_VALUE), label: format!("no {name}") });
        }
        if let (ColorBy::Layer(Layer::Time), Some(range)) = (self.picture.color_by, self.range)
            && let (_, Some(date)) = short_time_labels(range)
        {
            entries.push(Entry { color: None, label: format!("last hit: {date} utc") });
        }
        entries.extend(self.moving.as_ref().map(|moving| moving_entry(moving.points)));
        entries
    }

    /// Returns a value of a layer as a number: an intensity in the unit of the points, a time in seconds.
    fn number_of(&self, value: LayerValue) -> Option<f64> {
        match value {
            LayerValue::Intensity(share) => Some(share * f64::from(self.layers.intensity_max.unwrap_or(1.0))),
            LayerValue::Time(ns) => Some(ns as f64 * SECONDS_A_NS),
            LayerValue::Colour(_) | LayerValue::Class(_) => None,
        }
    }

    /// Returns the range of a layer: from the 2nd to the 98th percentile of intensities, and of all times.
    fn layer_range(&self, known: &Known) -> Option<[f64; 2]> {
        let layer = known.cells.layer.as_ref()?;
        let cells = known.cells.iter().enumerate().filter(|(_, cell)| cell.rank == Rank::Occupied);
        let mut values: Vec<f64> =
            cells.filter_map(|(place, _)| layer.at(place).and_then(|value| self.number_of(value))).collect();
        values.sort_unstable_by(f64::total_cmp);
        let (least, apart) = match self.picture.color_by {
            ColorBy::Layer(Layer::Time) => (0, 1.0),
            _ => (values.len() / 50, 1e-6 * f64::from(self.layers.intensity_max.unwrap_or(1.0))),
        };
        let most = values.len().checked_sub(1 + least)?;
        Some([values[least], values[most].max(values[least] + apart)])
    }

    /// Returns the values of the first and the last color. Up to 1 % of the cells at either end may be outside the
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
            ColorBy::Layer(_) => return self.layer_range(known),
        };
        let cells = known.cells.iter().filter(|cell| cell.rank >= least);
        let mut values: Vec<f32> = cells.map(|cell| cell.value).collect();
        values.sort_unstable_by(f32::total_cmp);
        let (least, most) = (values.get(values.len() / 100)?, values.get(values.len() * 99 / 100)?);
        let apart = if self.picture.color_by == ColorBy::Height { 0.01 } else { 1.0 };
        Some([f64::from(*least), f64::from(*most).max(f64::from(*least) + apart)])
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
        let color_by_value = |value: f64| {
            let [least, most] = self.range.unwrap_or([0.0, 1.0]);
            color_of(match self.picture.color_by {
                // Logarithmic: most voxels have few observations, some have very many.
                ColorBy::Count => ((value + 1.0) / (least + 1.0)).ln() / ((most + 1.0) / (least + 1.0)).ln(),
                _ => (value - least) / (most - least),
            })
        };
        let value_color = || color_by_value(f64::from(cell.value));
        match cell.rank {
            Rank::Unknown => None,
            Rank::Changed(Change::Same) => Some(palette::SAME),
            Rank::Changed(Change::Vanished) => Some(palette::VANISHED),
            Rank::Changed(Change::Appeared) => Some(palette::APPEARED),
            Rank::Compared(class) | Rank::InFront(class) => color_of_rank(class),
            Rank::Occupied if self.picture.color_by == ColorBy::Distance => Some(palette::INK),
            Rank::Occupied => Some(match &known.cells.layer {
                Some(layer) => match layer.at(known.place(at)) {
                    Some(LayerValue::Colour(color)) => color,
                    Some(LayerValue::Class(class)) => class_color(class),
                    Some(value) => self.number_of(value).map_or(palette::NO_VALUE, color_by_value),
                    None => palette::NO_VALUE,
                },
                None => value_color(),
            }),
            Rank::Free => match self.picture.color_by {
                _ if self.collected.content != Content::Values => Some(palette::FREE),
                ColorBy::Height | ColorBy::Probability | ColorBy::Layer(_) => Some(palette::FREE),
                ColorBy::Distance => Some(value_color()),
                ColorBy::Count | ColorBy::LastScan => Some(mixed(palette::UNKNOWN, value_color(), 0.4)),
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

    fn draw_tile_lines(&self, canvas: &mut Canvas, known: &Known, pane: &Pane, every_m: f64) {
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
                    canvas.fill(left, pane.top, [1, size[1]], palette::TILE_LINE, 0.2);
                } else {
                    let row = size[1].saturating_sub(at.max(1));
                    canvas.fill(pane.left, pane.top + row, [size[0], 1], palette::TILE_LINE, 0.2);
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

    /// Draws the trajectory as a line, with gaps at jumps such as the start of another recording.
    fn draw_path(&self, canvas: &mut Canvas, known: &Known, pane: &Pane, dot: usize) {
        let resolution_m = self.grid.resolution_m();
        let positions: Vec<[f64; 2]> =
            self.picture.path.iter().map(|&place| known.frame.position_of(place, resolution_m)).collect();
        let length = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        let mut steps: Vec<f64> = positions.windows(2).map(length).collect();
        steps.sort_unstable_by(f64::total_cmp);
        let usual = steps.get(steps.len() / 2).copied().unwrap_or_default();
        let longest = 8.0 * usual.max(2.0 / pane.zoom as f64);
        let mut middles: Vec<[usize; 2]> =
            positions.first().and_then(|&at| pane.pixel_of(at)).into_iter().collect();
        for pair in positions.windows(2) {
            let length = length(pair);
            // One step per pixel. The bound is longer than any line inside the picture.
            let parts =
                (length * pane.zoom as f64).ceil().clamp(1.0, 4.0 * super::options::MAX_PX as f64) as usize;
            let parts = if length <= longest { parts } else { 1 };
            for part in 1..=parts {
                let share = part as f64 / parts as f64;
                let at = std::array::from_fn(|k| pair[0][k] * (1.0 - share) + pair[1][k] * share);
                if let Some(pixel) = pane.pixel_of(at)
                    && middles.last() != Some(&pixel)
                {
                    middles.push(pixel);
                }
            }
        }
        // Draw each pixel once, even if the sensor was at rest there for hours.
        middles.sort_unstable();
        middles.dedup();
        let pixels_a_metre = pane.zoom as f64 / (known.frame.voxels_a_cell as f64 * resolution_m);
        // A radius of 0.2 m, limited to a few pixels: a wider line would hide the streets of a large map.
        let most = if self.picture.has_legend { dot + 1 } else { 1 };
        let radius = ((0.2 * pixels_a_metre) as usize).clamp(usize::from(self.picture.has_legend), most);
        let color = if self.collected.content == Content::Values { palette::PATH } else { palette::INK };
        canvas.path(middles.into_iter(), radius, color);
    }
}

impl Known {
    fn place(&self, [across, up]: [usize; 2]) -> usize {
        across + up * self.frame.cells[0]
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

/// Layout of the image in pixels.
struct Layout {
    width: usize,
    height: usize,
    margin: usize,
    left: usize,
    top: usize,
    /// First row of the legend.
    foot: usize,
    /// Edge of the squares that letters consist of, in pixels.
    dot: usize,
}

impl Layout {
    fn of(picture: &Picture, size: [usize; 2], entries: &[Entry]) -> Self {
        if !picture.has_legend {
            let [width, height] = size;
            return Self { width, height, margin: 0, left: 0, top: 0, foot: height, dot: 1 };
        }
        let inner = size[0].max(MIN_WIDTH);
        let dot = (inner / 480).clamp(2, 5);
        let margin = 10 * dot;
        let width = inner + 2 * margin;
        let top = 2 * margin + font::HEIGHT * dot;
        let foot = top + size[1] + margin;
        let legend = legend_height(entries, width, dot) * dot;
        Self { width, height: foot + legend + margin, margin, left: (width - size[0]) / 2, top, foot, dot }
    }
}

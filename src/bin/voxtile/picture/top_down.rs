use super::canvas::Canvas;
use super::font;
use super::frame::Frame;
use super::legend::Legend;
use super::palette::{self, color_of, lit};
use std::path::Path;
use voxtile::Result;
use voxtile::space::{Aabb, Point};

/// What the color of an occupied cell stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorBy {
    /// Height of the topmost occupied voxel.
    #[default]
    Height,
    /// Highest probability of the column.
    Probability,
}

/// What to draw, and how.
#[derive(Clone, Debug)]
pub struct View {
    /// Extent of the map in metres; what lies outside is left out, what is empty is cropped.
    pub bounds: Aabb,
    /// Edge of a voxel in metres.
    pub resolution_m: f64,
    /// Edge of a tile in metres.
    pub tile_size_m: f64,
    pub color_by: ColorBy,
    /// A line above the map.
    pub title: String,
}

/// The columns of a map seen from above: at most 2048 x 2048 cells of 8 bytes, whatever the size of the map.
pub struct TopDown {
    view: View,
    frame: Frame,
    cells: Vec<Cell>,
}

/// Most cells along an edge.
const MAX_CELLS: usize = 2048;
/// A small map is drawn larger, until its longer edge has about so many pixels.
const GOOD_EDGE: usize = 2100;
/// The legend needs this width.
const LEAST_WIDTH: usize = 760;

#[derive(Clone, Copy, Default)]
struct Cell {
    /// Height of the topmost occupied voxel's center.
    top_m: f32,
    /// Probability of the most probable occupied voxel; 0 is 0 and 255 is 1.
    probability: u8,
    is_occupied: bool,
    is_free: bool,
    is_on_path: bool,
}

impl Cell {
    fn is_unknown(&self) -> bool {
        !(self.is_occupied || self.is_free || self.is_on_path)
    }
}

/// The part of the picture that shows the map: which cells, and where.
struct Pane {
    first: [usize; 2],
    cells: [usize; 2],
    /// Pixels along a cell's edge.
    zoom: usize,
    left: usize,
    top: usize,
}

impl Pane {
    fn size(&self) -> [usize; 2] {
        self.cells.map(|n| n * self.zoom)
    }

    /// Upper left pixel of a cell: y points up, rows count down.
    fn pixel(&self, cell: [usize; 2]) -> [usize; 2] {
        let row = self.cells[1] - 1 - (cell[1] - self.first[1]);
        [self.left + (cell[0] - self.first[0]) * self.zoom, self.top + row * self.zoom]
    }
}

impl TopDown {
    /// An empty picture; an error if the bounds have no extent.
    pub fn new(view: View) -> Result<Self> {
        let frame = Frame::new(&view.bounds, view.resolution_m, MAX_CELLS)?;
        let cells = vec![Cell::default(); frame.cells[0] * frame.cells[1]];
        Ok(Self { view, frame, cells })
    }

    /// Adds an occupied voxel by its center in metres.
    pub fn add_occupied(&mut self, center: Point, probability: f64) {
        let Some(cell) = self.cell_at(center) else { return };
        let top_m = center[2] as f32;
        cell.top_m = if cell.is_occupied { cell.top_m.max(top_m) } else { top_m };
        cell.probability = cell.probability.max((probability * 255.0).round() as u8);
        cell.is_occupied = true;
    }

    /// Adds a free voxel by its center in metres.
    pub fn add_free(&mut self, center: Point) {
        if let Some(cell) = self.cell_at(center) {
            cell.is_free = true;
        }
    }

    /// Marks a place where the sensor was, in metres.
    pub fn add_to_path(&mut self, position: Point) {
        if let Some(cell) = self.cell_at(position) {
            cell.is_on_path = true;
        }
    }

    /// Draws everything and saves it.
    pub fn write_png(&self, path: &Path) -> anyhow::Result<()> {
        self.draw().write_png(path)
    }

    fn cell_at(&mut self, point: Point) -> Option<&mut Cell> {
        let [x, y] = self.frame.cell_of(point[0], point[1])?;
        self.cells.get_mut(x + y * self.frame.cells[0])
    }

    fn cell(&self, x: usize, y: usize) -> Cell {
        self.cells[x + y * self.frame.cells[0]]
    }

    fn draw(&self) -> Canvas {
        let (first, cells) = self.seen();
        let zoom = (GOOD_EDGE / cells[0].max(cells[1])).clamp(1, 12);
        let map_width = cells[0] * zoom;
        let dot = (map_width.max(LEAST_WIDTH) / 480).clamp(2, 5);
        let margin = 10 * dot;
        let width = map_width.max(LEAST_WIDTH) + 2 * margin;
        let pane =
            Pane { first, cells, zoom, left: (width - map_width) / 2, top: 2 * margin + font::HEIGHT * dot };
        let foot = pane.top + pane.size()[1] + margin;
        let mut canvas = Canvas::new(width, foot + 24 * dot + margin, palette::UNKNOWN);
        let range = self.range();
        self.draw_cells(&mut canvas, &pane, range);
        self.draw_tile_lines(&mut canvas, &pane);
        self.draw_path(&mut canvas, &pane, dot);
        canvas.text(margin, margin, dot, palette::INK, &self.view.title);
        let metres_a_pixel = self.frame.cell_m / zoom as f64;
        let lines_m = self.line_spacing_m(1.0 / metres_a_pixel);
        Legend { metres_a_pixel, lines_m, color_by: self.view.color_by, range }.draw(&mut canvas, foot, dot);
        canvas
    }

    /// First cell and number of cells of the box around all that is known, with a little air.
    fn seen(&self) -> ([usize; 2], [usize; 2]) {
        let (mut low, mut high) = (self.frame.cells, [0; 2]);
        for y in 0..self.frame.cells[1] {
            for x in (0..self.frame.cells[0]).filter(|&x| !self.cell(x, y).is_unknown()) {
                low = [low[0].min(x), low[1].min(y)];
                high = [high[0].max(x), high[1].max(y)];
            }
        }
        if low[0] > high[0] {
            return ([0; 2], self.frame.cells);
        }
        let air = (high[0] - low[0]).max(high[1] - low[1]) / 60 + 1;
        let first: [usize; 2] = std::array::from_fn(|k| low[k].saturating_sub(air));
        let cells = std::array::from_fn(|k| (high[k] + air).min(self.frame.cells[k] - 1) + 1 - first[k]);
        (first, cells)
    }

    fn value(&self, cell: Cell) -> f64 {
        match self.view.color_by {
            ColorBy::Height => f64::from(cell.top_m),
            ColorBy::Probability => f64::from(cell.probability) / 255.0,
        }
    }

    /// What the first and the last color stand for: one cell in a hundred may lie outside either.
    ///
    /// Probabilities always span the same range, so that two pictures can be compared.
    fn range(&self) -> [f64; 2] {
        if self.view.color_by == ColorBy::Probability {
            return [0.5, 1.0];
        }
        let mut values: Vec<f32> =
            self.cells.iter().filter(|cell| cell.is_occupied).map(|cell| self.value(*cell) as f32).collect();
        values.sort_unstable_by(f32::total_cmp);
        let (Some(&least), Some(&most)) =
            (values.get(values.len() / 100), values.get(values.len() * 99 / 100))
        else {
            return [0.0, 1.0];
        };
        [f64::from(least), f64::from(most).max(f64::from(least) + 0.01)]
    }

    fn draw_cells(&self, canvas: &mut Canvas, pane: &Pane, [least, most]: [f64; 2]) {
        for y in pane.first[1]..pane.first[1] + pane.cells[1] {
            for x in pane.first[0]..pane.first[0] + pane.cells[0] {
                let cell = self.cell(x, y);
                let color = if cell.is_occupied {
                    let share = (self.value(cell) - least) / (most - least);
                    lit(color_of(share), self.light(x, y))
                } else if cell.is_free {
                    palette::FREE
                } else {
                    continue;
                };
                let [left, top] = pane.pixel([x, y]);
                canvas.fill(left, top, [pane.zoom; 2], color, 1.0);
            }
        }
    }

    /// Light from the upper left: an edge that faces it is brighter, one that looks away is darker.
    fn light(&self, x: usize, y: usize) -> f64 {
        let here = self.cell(x, y);
        let rise_m = |x: usize, y: usize| {
            let other = self.cell(x, y);
            if other.is_occupied { f64::from(here.top_m - other.top_m).clamp(-2.0, 2.0) } else { 0.0 }
        };
        let left_m = if x > 0 { rise_m(x - 1, y) } else { 0.0 };
        let above_m = if y + 1 < self.frame.cells[1] { rise_m(x, y + 1) } else { 0.0 };
        (1.0 + 0.1 * (left_m + above_m)).clamp(0.72, 1.22)
    }

    fn draw_tile_lines(&self, canvas: &mut Canvas, pane: &Pane) {
        let size = pane.size();
        let pixels_a_metre = pane.zoom as f64 / self.frame.cell_m;
        let Some(every_m) = self.line_spacing_m(pixels_a_metre) else { return };
        for axis in 0..2 {
            let low_m = self.frame.min_m[axis] + pane.first[axis] as f64 * self.frame.cell_m;
            let high_m = low_m + size[axis] as f64 / pixels_a_metre;
            let first = (low_m / every_m).ceil();
            // Counted in whole steps: far from the origin adding 1 to a line's number may leave it as it is.
            for step in 0..=size[axis] / 8 {
                let line_m = (first + step as f64) * every_m;
                if line_m.is_nan() || line_m > high_m {
                    break;
                }
                let at = ((line_m - low_m) * pixels_a_metre).round() as usize;
                if axis == 0 {
                    canvas.fill(
                        pane.left + at.min(size[0] - 1),
                        pane.top,
                        [1, size[1]],
                        palette::TILE_LINE,
                        0.2,
                    );
                } else {
                    let row = size[1].saturating_sub(at.max(1));
                    canvas.fill(pane.left, pane.top + row, [size[0], 1], palette::TILE_LINE, 0.2);
                }
            }
        }
    }

    /// Metres from one line to the next: a tile, or ten, a hundred of them where lines would be a haze over the map.
    fn line_spacing_m(&self, pixels_a_metre: f64) -> Option<f64> {
        let mut every_m = self.view.tile_size_m;
        if every_m.is_nan() || every_m <= 0.0 {
            return None;
        }
        while every_m * pixels_a_metre < 16.0 {
            every_m *= 10.0;
        }
        Some(every_m)
    }

    fn draw_path(&self, canvas: &mut Canvas, pane: &Pane, dot: usize) {
        // As wide as a street lane needs, and no wider: on a large map it would hide the streets.
        let radius = ((0.35 * pane.zoom as f64 / self.frame.cell_m) as usize).clamp(1, dot + 1);
        let rows = pane.first[1]..pane.first[1] + pane.cells[1];
        let cells = rows.flat_map(|y| (pane.first[0]..pane.first[0] + pane.cells[0]).map(move |x| [x, y]));
        let on_path = cells.filter(|&[x, y]| self.cell(x, y).is_on_path);
        canvas.path(on_path.map(|cell| pane.pixel(cell).map(|pixel| pixel + pane.zoom / 2)), radius);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> TopDown {
        TopDown::new(View {
            bounds: Aabb { min: [-20.0, -20.0, 0.0], max: [20.0, 20.0, 10.0] },
            resolution_m: 0.2,
            tile_size_m: 10.0,
            color_by: ColorBy::Height,
            title: "a map".into(),
        })
        .unwrap()
    }

    #[test]
    fn the_topmost_voxel_of_a_column_counts() {
        let mut picture = picture();
        for z in [0.1, 3.1, 1.1] {
            picture.add_occupied([0.1, 0.1, z], 0.7);
        }
        let cell = picture.cell(100, 100);
        assert!(cell.is_occupied && cell.top_m == 3.1);
        picture.add_occupied([500.0, 0.1, 1.0], 0.7);
        picture.add_occupied([f64::NAN, 0.1, f64::NAN], f64::NAN);
        assert_eq!(picture.cells.iter().filter(|cell| cell.is_occupied).count(), 1);
    }

    #[test]
    fn north_is_up_and_east_is_right() {
        let pane = Pane { first: [10, 20], cells: [30, 40], zoom: 3, left: 5, top: 7 };
        assert_eq!(pane.pixel([10, 59]), [5, 7]);
        assert_eq!(pane.pixel([11, 58]), [8, 10]);
        assert_eq!(pane.pixel([39, 20]), [5 + 29 * 3, 7 + 39 * 3]);
    }

    #[test]
    fn any_map_can_be_drawn() {
        let mut canvas = picture().draw();
        assert!(canvas.width() >= LEAST_WIDTH && canvas.height() > 0);
        let mut one = picture();
        one.add_occupied([0.1, 0.1, 0.1], 1.0);
        canvas = one.draw();
        assert!(canvas.width() < 2_000 && canvas.height() < 2_000);
        let far = Aabb { min: [1e18; 3], max: [1e18 + 1e6; 3] };
        let view = View { bounds: far, resolution_m: 1e-3, tile_size_m: 1e-3, ..one.view.clone() };
        TopDown::new(view).unwrap().draw();
    }
}

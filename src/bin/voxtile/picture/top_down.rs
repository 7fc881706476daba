use super::canvas::Canvas;
use super::{font, palette};
use std::path::Path;
use voxtile::space::{Aabb, Point};

/// A map from above: the highest occupied voxel of each column by its height, free space dark, unknown darker.
pub struct TopDown {
    bounds: Aabb,
    tile_size_m: f64,
    pixels_per_m: f64,
    width: usize,
    height: usize,
    columns: Vec<Column>,
}

#[derive(Clone, Copy)]
enum Column {
    Unknown,
    Free,
    Occupied(f32),
}

/// The longer side of the map in pixels is at most this.
const MAX_SIDE: f64 = 1800.0;
/// The legend's band below the map, in pixels.
const BAND: usize = 64;

impl TopDown {
    /// An empty picture of the space in `bounds`, in metres; at most one pixel a voxel of `resolution_m`, or a few for
    /// a small map.
    pub fn new(bounds: Aabb, resolution_m: f64, tile_size_m: f64) -> Self {
        let extent = |axis: usize| (bounds.max[axis] - bounds.min[axis]).max(resolution_m);
        let longest_m = extent(0).max(extent(1));
        let voxels = longest_m / resolution_m;
        // A whole number of pixels a voxel, or, where there are too many voxels, as many as fit.
        let pixels_per_voxel = (MAX_SIDE / voxels).clamp(0.0, 8.0);
        let pixels_per_voxel =
            if pixels_per_voxel >= 1.0 { pixels_per_voxel.floor() } else { pixels_per_voxel };
        let pixels_per_m = pixels_per_voxel / resolution_m;
        let pixels =
            |axis: usize| ((extent(axis) * pixels_per_m).ceil() as usize).clamp(1, MAX_SIDE as usize + 8);
        let (width, height) = (pixels(0), pixels(1));
        let columns = vec![Column::Unknown; width * height];
        Self { bounds, tile_size_m, pixels_per_m, width, height, columns }
    }

    /// Adds an observed voxel of edge `edge_m`.
    pub fn add(&mut self, center: Point, edge_m: f64, is_occupied: bool) {
        let half = edge_m / 2.0;
        let (left, bottom) = self.pixel_of([center[0] - half, center[1] - half]);
        let (right, top) = self.pixel_of([center[0] + half, center[1] + half]);
        for x in left..right.max(left + 1) {
            for y in top..bottom.max(top + 1) {
                if !((0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y)) {
                    continue;
                }
                let column = &mut self.columns[y as usize * self.width + x as usize];
                let z = center[2] as f32;
                *column = match *column {
                    Column::Occupied(height) if is_occupied => Column::Occupied(height.max(z)),
                    Column::Occupied(height) => Column::Occupied(height),
                    _ if is_occupied => Column::Occupied(z),
                    _ => Column::Free,
                };
            }
        }
    }

    /// Draws map, tile grid, scale bar and height legend.
    pub fn write_png(&self, path: &Path) -> anyhow::Result<()> {
        let (low, high) = self.heights();
        let width = self.width.max(560);
        let mut canvas = Canvas::new(width, self.height + BAND, palette::UNKNOWN);
        for (number, column) in self.columns.iter().enumerate() {
            let color = match *column {
                Column::Unknown => continue,
                Column::Free => palette::FREE,
                Column::Occupied(height) => {
                    palette::color((f64::from(height) - low) / (high - low).max(1e-6))
                }
            };
            canvas.set((number % self.width) as i64, (number / self.width) as i64, color);
        }
        self.draw_grid(&mut canvas);
        self.draw_band(&mut canvas, width as i64, low, high);
        canvas.write_png(path)
    }

    fn draw_grid(&self, canvas: &mut Canvas) {
        // Lines closer than this would hide the map.
        if self.tile_size_m * self.pixels_per_m < 6.0 {
            return;
        }
        let lines = |axis: usize| {
            let first = (self.bounds.min[axis] / self.tile_size_m).ceil() as i64;
            let last = (self.bounds.max[axis] / self.tile_size_m).floor() as i64;
            (first..=last).map(|line| line as f64 * self.tile_size_m)
        };
        for x in lines(0) {
            let x = self.pixel_of([x, 0.0]).0;
            (0..self.height as i64).for_each(|y| canvas.blend(x, y, palette::GRID, 0.3));
        }
        for y in lines(1) {
            let y = self.pixel_of([0.0, y]).1;
            (0..self.width as i64).for_each(|x| canvas.blend(x, y, palette::GRID, 0.3));
        }
    }

    fn draw_band(&self, canvas: &mut Canvas, width: i64, low: f64, high: f64) {
        let (top, left) = (self.height as i64 + 12, 16);
        let (length_m, label) = scale_bar(width as f64 * 0.25 / self.pixels_per_m);
        let length = (length_m * self.pixels_per_m).round() as i64;
        canvas.text(left, top, &label, 2, palette::INK);
        canvas.rectangle(left, top + 26, length, 4, palette::INK);
        for x in [left, left + length - 2] {
            canvas.rectangle(x, top + 20, 2, 16, palette::INK);
        }
        let legend = 200;
        let right = width - 16;
        for x in 0..legend {
            let color = palette::color(x as f64 / legend as f64);
            canvas.rectangle(right - legend + x, top + 24, 1, 12, color);
        }
        let (low, high) = (format!("z {low:.1} m"), format!("{high:.1} m"));
        canvas.text(right - legend, top, &low, 2, palette::INK);
        canvas.text(right - 2 * font::width(&high), top, &high, 2, palette::INK);
    }

    /// Pixel of a place: x to the right, y upward.
    fn pixel_of(&self, [x, y]: [f64; 2]) -> (i64, i64) {
        let column = ((x - self.bounds.min[0]) * self.pixels_per_m).round() as i64;
        let row = self.height as i64 - ((y - self.bounds.min[1]) * self.pixels_per_m).round() as i64;
        (column, row)
    }

    /// The heights between which colors run: all but the lowest and highest hundredth.
    fn heights(&self) -> (f64, f64) {
        let heights = self.columns.iter().filter_map(|column| match column {
            Column::Occupied(height) => Some(*height),
            _ => None,
        });
        let mut heights: Vec<f32> = heights.collect();
        heights.sort_unstable_by(f32::total_cmp);
        let at =
            |share: f64| heights.get((heights.len() as f64 * share) as usize).copied().unwrap_or_default();
        (f64::from(at(0.01)), f64::from(at(0.99)))
    }
}

/// The longest bar of 1, 2 or 5 times a power of ten metres that is at most so long, and its label.
fn scale_bar(at_most_m: f64) -> (f64, String) {
    let mut length_m = 0.01;
    for exponent in -2..6 {
        for digit in [1.0, 2.0, 5.0] {
            let candidate = digit * 10_f64.powi(exponent);
            if candidate <= at_most_m {
                length_m = candidate;
            }
        }
    }
    let label =
        if length_m >= 1000.0 { format!("{} km", length_m / 1000.0) } else { format!("{length_m} m") };
    (length_m, label)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_are_round_lengths_that_fit() {
        assert_eq!(scale_bar(12.0), (10.0, "10 m".into()));
        assert_eq!(scale_bar(4900.0), (2000.0, "2 km".into()));
        assert_eq!(scale_bar(0.6).1, "0.5 m");
    }

    #[test]
    fn voxels_land_on_their_own_pixels_with_y_upward() {
        let bounds = Aabb { min: [-1.0, -1.0, 0.0], max: [1.0, 1.0, 1.0] };
        let mut picture = TopDown::new(bounds, 0.1, 1.0);
        assert_eq!((picture.width, picture.height), (160, 160));
        assert_eq!(picture.pixel_of([-1.0, -1.0]), (0, 160));
        assert_eq!(picture.pixel_of([1.0, 1.0]), (160, 0));
        picture.add([-0.95, -0.95, 0.5], 0.1, true);
        let occupied = picture.columns.iter().filter(|column| matches!(column, Column::Occupied(_))).count();
        assert_eq!(occupied, 64);
        assert!(matches!(picture.columns[159 * 160], Column::Occupied(_)));
    }
}

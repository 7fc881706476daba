use super::canvas::Canvas;
use super::image::Image;
use super::measure::Measure;
use super::palette::{self, color_of, lit};
use super::scale::{PlaneFrame, length_label, round_length_m};
use super::theme::{Background, Theme};
use std::collections::HashMap;
use voxtile::Result;
use voxtile::space::{Aabb, Point};
use voxtile_local::{LocalState, LocalView};

/// A local map at several times, from above, in panels.
#[derive(Debug)]
pub struct OverTime {
    /// Edge length of a voxel in metres.
    pub resolution_m: f64,
    /// Title above the panels.
    pub title: String,
    /// Panels in order of time.
    pub panels: Vec<Panel>,
}

/// Columns of a local map at one time.
#[derive(Debug)]
pub struct Panel {
    scan: usize,
    occupied: usize,
    path: Vec<Point>,
    /// By voxel index along x and y: z index of the topmost occupied voxel, or `None` if there are only inflated
    /// voxels.
    columns: HashMap<[i32; 2], Option<i32>>,
}

/// Number of panels per row.
const ACROSS: usize = 3;
/// Maximum number of cells along the edge of a panel.
const MAX_CELLS: usize = 640;
/// Resolution of the type in pixels per inch.
const DPI: f64 = 150.0;
const MARGIN: usize = 16;

impl Panel {
    /// Returns the panel of a map after `scan` scans, with the trajectory so far.
    pub fn of(view: &LocalView, scan: usize, path: Vec<Point>) -> Self {
        let mut columns: HashMap<[i32; 2], Option<i32>> = HashMap::new();
        view.for_each(|[x, y, z], state| {
            let top = columns.entry([x, y]).or_default();
            if state == LocalState::Occupied {
                *top = Some(top.map_or(z, |top| top.max(z)));
            }
        });
        Self { scan, occupied: view.occupied_voxels(), path, columns }
    }
}

impl OverTime {
    /// Draws all panels.
    pub fn draw(&self) -> Image {
        self.canvas().into_image(DPI)
    }

    fn canvas(&self) -> Canvas {
        let (theme, measure) = (Theme::of(Background::Dark), measure());
        let frame = self.frame();
        let Ok(frame) = frame else { return Canvas::new(8, 8, &theme) };
        let zoom = (MAX_CELLS / frame.cells[0].max(frame.cells[1])).clamp(1, 8);
        // Minimum width of the label.
        let size = [(frame.cells[0] * zoom).max(260), frame.cells[1] * zoom];
        let across = self.panels.len().clamp(1, ACROSS);
        let down = self.panels.len().div_ceil(across);
        let line = measure.title().height() + MARGIN / 2;
        let pitch = [size[0] + MARGIN, size[1] + line + MARGIN];
        let foot = MARGIN + line + down * pitch[1];
        let width = (across * pitch[0] + MARGIN).max(640);
        let mut canvas = Canvas::new(width, foot + 2 * line + MARGIN, &theme);
        canvas.text(MARGIN, MARGIN, measure.title(), palette::INK, &self.title);
        let heights = self.heights();
        for (number, panel) in self.panels.iter().enumerate() {
            let left = MARGIN + number % across * pitch[0];
            let top = MARGIN + line + number / across * pitch[1];
            let label = format!("scan {}: {} occupied", panel.scan, panel.occupied);
            canvas.text(left, top, measure.label(), palette::FAINT_INK, &label);
            self.draw_panel(&mut canvas, panel, &frame, zoom, [left, top + line], heights);
        }
        draw_foot(&mut canvas, foot, frame.cell_m / zoom as f64, heights.map(|z| self.height_m(z)));
        canvas
    }

    fn draw_panel(
        &self,
        canvas: &mut Canvas,
        panel: &Panel,
        frame: &PlaneFrame,
        zoom: usize,
        [left, top]: [usize; 2],
        [low, high]: [i32; 2],
    ) {
        let paper = lit(palette::UNKNOWN, 1.06);
        canvas.fill(left, top, frame.cells.map(|cells| cells * zoom), paper, 1.0);
        let pixel = |x_m: f64, y_m: f64| {
            let [x, y] = frame.cell_of(x_m, y_m)?;
            Some([left + x * zoom, top + (frame.cells[1] - 1 - y) * zoom])
        };
        // Inflated columns first: if a cell has several columns, occupied ones hide them.
        for wants_occupied in [false, true] {
            for ([x, y], column) in panel.columns.iter().filter(|(_, top)| top.is_some() == wants_occupied) {
                let [x_m, y_m] = [x, y].map(|k| (f64::from(*k) + 0.5) * self.resolution_m);
                let Some([x, y]) = pixel(x_m, y_m) else { continue };
                let share =
                    |z: i32| (f64::from(z) - f64::from(low)) / (f64::from(high) - f64::from(low)).max(1.0);
                let color = column.map_or(palette::INFLATED, |z| color_of(share(z)));
                canvas.fill(x, y, [zoom; 2], color, 1.0);
            }
        }
        let path = panel.path.iter().filter_map(|at| pixel(at[0], at[1]));
        canvas.path(path.map(|corner| corner.map(|k| k + zoom / 2)), 1, palette::PATH, palette::UNKNOWN);
    }

    fn height_m(&self, z: i32) -> f64 {
        (f64::from(z) + 0.5) * self.resolution_m
    }

    /// Returns the frame of all panels: around all columns and the trajectory, except one column in two hundred on each
    /// side.
    fn frame(&self) -> Result<PlaneFrame> {
        let path = self.panels.iter().flat_map(|panel| &panel.path);
        let mut bounds = path.fold(Aabb { min: [f64::MAX; 3], max: [f64::MIN; 3] }, |bounds, at| Aabb {
            min: std::array::from_fn(|k| bounds.min[k].min(at[k] - 2.0)),
            max: std::array::from_fn(|k| bounds.max[k].max(at[k] + 2.0)),
        });
        for axis in 0..2 {
            let columns = self.panels.iter().flat_map(|panel| panel.columns.keys());
            let mut along: Vec<i32> = columns.map(|column| column[axis]).collect();
            along.sort_unstable();
            let few = along.len() / 200;
            if let (Some(low), Some(high)) = (along.get(few), along.iter().rev().nth(few)) {
                bounds.min[axis] = bounds.min[axis].min(f64::from(*low) * self.resolution_m);
                bounds.max[axis] = bounds.max[axis].max(f64::from(high + 1) * self.resolution_m);
            }
        }
        PlaneFrame::new(&bounds, self.resolution_m, MAX_CELLS)
    }

    /// Returns the z indices of the first and the last color.
    fn heights(&self) -> [i32; 2] {
        let columns = self.panels.iter().flat_map(|panel| panel.columns.values());
        let mut tops: Vec<i32> = columns.copied().flatten().collect();
        tops.sort_unstable();
        let at = |share: usize| tops.get(tops.len() * share / 100).copied().unwrap_or_default();
        [at(2), at(98)]
    }
}

/// Draws the scale bar, the colors, and the swatches of cells that are not occupied.
fn draw_foot(canvas: &mut Canvas, foot: usize, metres_a_pixel: f64, [low_m, high_m]: [f64; 2]) {
    let (label, edge) = (measure().label(), measure().label().height());
    let length_m = round_length_m(120.0 * metres_a_pixel);
    let length = ((length_m / metres_a_pixel).round() as usize).max(1);
    let bar = foot + edge + MARGIN / 2;
    canvas.text(MARGIN, foot, label, palette::INK, &length_label(length_m));
    canvas.fill(MARGIN, bar, [length, 4], palette::INK, 1.0);
    let left = MARGIN + 160;
    canvas.fill(left, foot, [edge; 2], palette::INFLATED, 1.0);
    canvas.text(left + edge + 8, foot, label, palette::FAINT_INK, "inflated");
    canvas.fill(left + 130, foot + edge / 3, [edge / 2; 2], palette::PATH, 1.0);
    canvas.text(left + 130 + edge, foot, label, palette::FAINT_INK, "sensor");
    let (width, right) = (160, canvas.width() - MARGIN);
    for x in 0..width {
        let color = color_of(x as f64 / width as f64);
        canvas.fill(right - width + x, bar, [1, 10], color, 1.0);
    }
    canvas.text(right - width, foot, label, palette::INK, &format!("{low_m:.1} m"));
    canvas.text_before(right, foot, label, palette::INK, &format!("{high_m:.1} m"));
}

fn measure() -> Measure {
    Measure::of([0; 2], Some(DPI))
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::Scan;
    use voxtile_local::{LocalMap, LocalParameters};

    #[test]
    fn any_map_can_be_drawn() {
        let mut map = LocalMap::new(0.1, LocalParameters::local_mapping()).unwrap();
        let mut picture = OverTime { resolution_m: 0.1, title: "a map".into(), panels: Vec::new() };
        assert!(picture.canvas().width() > 0);
        for (scan, point) in [[3.0, 1.0, 0.4], [-2.0, 7.0, 3.0], [0.5, 0.5, 0.5]].into_iter().enumerate() {
            map.insert_scan(&Scan { origin: [0.0; 3], points: vec![point], intensities: None }).unwrap();
            picture.panels.push(Panel::of(map.view(), scan, vec![[0.0; 3]]));
            let canvas = picture.canvas();
            assert!((600..4000).contains(&canvas.width()) && canvas.height() < 4000);
        }
        assert_eq!(picture.panels[2].columns.values().flatten().count(), 3);
    }
}

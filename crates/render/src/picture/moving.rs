use super::canvas::Canvas;
use super::frame::Frame;
use super::palette::{self, Rgb};
use super::pane::Pane;
use voxtile::space::{Grid, Point};

/// Cells that contain points on moving objects.
#[derive(Debug, Default)]
pub(super) struct Moving {
    /// For each cell of the frame; empty before the first point.
    is_hit: Vec<bool>,
    /// Number of points in the picture.
    pub points: u64,
}

impl Moving {
    /// Adds the points whose voxel is drawn and whose cell is one of the shown ones: the first, and their number.
    pub fn add(&mut self, points_m: &[Point], grid: &Grid, frame: &Frame, shown: ([usize; 2], [usize; 2])) {
        let ([left, low], [across, up]) = shown;
        self.is_hit.resize(frame.cells[0] * frame.cells[1], false);
        for voxel in points_m.iter().filter_map(|&point| grid.voxel_of(point)) {
            if !frame.voxels.contains(voxel) {
                continue;
            }
            let place = frame.place_of(voxel);
            let at = [place % frame.cells[0], place / frame.cells[0]];
            if (left..left + across).contains(&at[0]) && (low..low + up).contains(&at[1]) {
                self.is_hit[place] = true;
                self.points += 1;
            }
        }
    }

    /// Fills the cells, with a rim that is visible on any color.
    pub fn draw(&self, canvas: &mut Canvas, frame: &Frame, pane: &Pane, rim_color: Rgb) {
        let cells = self.is_hit.iter().enumerate().filter(|(_, is_hit)| **is_hit);
        let pixels: Vec<[usize; 2]> =
            cells.map(|(place, _)| pane.pixel([place % frame.cells[0], place / frame.cells[0]])).collect();
        // Draw all rims first, so that neighboring cells form one area.
        let rim = 1 + pane.zoom / 8;
        for &[left, top] in &pixels {
            let size = [pane.zoom + 2 * rim; 2];
            canvas.fill(left.saturating_sub(rim), top.saturating_sub(rim), size, rim_color, 1.0);
        }
        pixels.iter().for_each(|&[left, top]| canvas.fill(left, top, [pane.zoom; 2], palette::MOVING, 1.0));
    }
}

/// Visible cells and their position in the image.
pub(super) struct Pane {
    pub first: [usize; 2],
    pub cells: [usize; 2],
    /// Edge length of a cell in pixels.
    pub zoom: usize,
    pub left: usize,
    pub top: usize,
}

impl Pane {
    pub fn size(&self) -> [usize; 2] {
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
    pub fn pixel_of(&self, position: [f64; 2]) -> Option<[usize; 2]> {
        let at = self.offset_px(position);
        let size = self.size();
        let is_inside = (0..2).all(|k| at[k] >= 0.0 && at[k] < size[k] as f64);
        is_inside.then(|| [self.left + at[0] as usize, self.top + size[1] - 1 - at[1] as usize])
    }
}

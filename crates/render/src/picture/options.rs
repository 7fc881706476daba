use super::collect::{Collected, Source};
use super::drawing::{Drawing, Drawn};
use super::view::{ColorBy, View};
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, Point};
use voxtile::{Error, Result};

/// What to draw of a map, and how.
///
/// Memory: 12 bytes a cell, 4 a pixel, and one tile a thread, whatever the size of the map.
#[derive(Clone, Debug)]
pub struct Picture {
    pub(super) view: View,
    pub(super) color_by: ColorBy,
    pub(super) region: Option<Aabb>,
    pub(super) most_px: [usize; 2],
    pub(super) has_grid: bool,
    pub(super) has_legend: bool,
    pub(super) path: Vec<Point>,
    pub(super) title: String,
    pub(super) skips_unreadable: bool,
}

/// Most pixels along an edge of a map, which need 1.2 GB; more are cut to it.
pub(super) const MAX_PX: usize = 8192;

impl Default for Picture {
    fn default() -> Self {
        Self {
            view: View::Above,
            color_by: ColorBy::Height,
            region: None,
            most_px: [2048; 2],
            has_grid: true,
            has_legend: true,
            path: Vec::new(),
            title: String::new(),
            skips_unreadable: false,
        }
    }
}

impl Picture {
    /// A picture from above, colored by height, 2048 pixels wide or high, with a grid of tiles and a legend.
    pub fn new() -> Self {
        Self::default()
    }

    /// From where the map is looked at.
    pub fn with_view(self, view: View) -> Self {
        Self { view, ..self }
    }

    /// What the colors stand for. A difference has colors of its own.
    pub fn with_color(self, color_by: ColorBy) -> Self {
        Self { color_by, ..self }
    }

    /// Draws only voxels whose center is in a box.
    pub fn with_region(self, region: Aabb) -> Self {
        Self { region: Some(region), ..self }
    }

    /// Most pixels of the map to the right and up, 8192 at most; title and legend come on top. A small map is enlarged
    /// as far as whole pixels a voxel allow, of a large one a pixel covers many voxels.
    pub fn with_size_px(self, most_px: [usize; 2]) -> Self {
        Self { most_px: most_px.map(|px| px.clamp(1, MAX_PX)), ..self }
    }

    /// Whether the borders of tiles are drawn: of ten, a hundred where they would lie too close.
    pub fn with_grid(self, has_grid: bool) -> Self {
        Self { has_grid, ..self }
    }

    /// Whether there is a margin, with title, axes, scale bar and colors.
    pub fn with_legend(self, has_legend: bool) -> Self {
        Self { has_legend, ..self }
    }

    /// The way of the sensor: places in metres in the order of time, such as
    /// [`MapReader::scans`](voxtile::MapReader::scans) gives.
    pub fn with_path(self, path: Vec<Point>) -> Self {
        Self { path, ..self }
    }

    /// A line above the map. What no letter is known for is left blank.
    pub fn with_title(self, title: impl Into<String>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// Draws what can be read, and lists the tiles that cannot in [`Drawn::unread`], in place of an error.
    pub fn skipping_unreadable(self) -> Self {
        Self { skips_unreadable: true, ..self }
    }

    /// Draws a map. `progress` is told the tiles done and all, from any thread.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read; a color that the map knows nothing of; a height or region that is no number.
    pub fn draw(&self, map: &dyn MapView, progress: impl Fn(u64, u64) + Sync) -> Result<Drawn> {
        self.check()?;
        let knows_scans =
            || map.tile_indices().first().is_none_or(|&tile| map.last_scan_of_tile_hint(tile).is_some());
        if self.color_by == ColorBy::LastScan && !knows_scans() {
            let reason = "the map does not know the last scan of its tiles; choose another color";
            return Err(Error::argument("color", reason));
        }
        let collected = Collected::of(self, Source::One(map), &progress)?;
        Ok(Drawing::new(self, map.config().grid, collected).draw())
    }

    /// Draws what became of one map, or state of a map, on the way to another: voxels that are occupied in both, in
    /// one, or in the other, in three colors. Where a cell has several, what appeared hides what vanished, and that
    /// what stayed. `progress` is told the tiles done and all, from any thread.
    ///
    /// # Errors
    ///
    /// Maps of different resolution or tile size; and as for [`Picture::draw`].
    pub fn draw_difference(
        &self,
        before: &dyn MapView,
        after: &dyn MapView,
        progress: impl Fn(u64, u64) + Sync,
    ) -> Result<Drawn> {
        self.check()?;
        let [grid_before, grid] = [before, after].map(|map| map.config().grid);
        if grid_before != grid {
            let reason =
                format!("has {grid_before}, the other {grid}; only maps of one grid can be compared");
            return Err(Error::argument("the map before", reason));
        }
        let collected = Collected::of(self, Source::Two { before, after }, &progress)?;
        Ok(Drawing::new(self, grid, collected).draw())
    }

    fn check(&self) -> Result<()> {
        if let View::Slice { z_m, thickness_m } = self.view
            && !(z_m.is_finite() && thickness_m.is_finite() && thickness_m >= 0.0)
        {
            return Err(Error::argument("slice", "needs a height and a thickness of at least 0, in metres"));
        }
        match self.region {
            Some(region) if (0..3).any(|k| region.min[k].is_nan() || region.max[k].is_nan()) => {
                Err(Error::argument("region", "needs six numbers, in metres"))
            }
            _ => Ok(()),
        }
    }
}

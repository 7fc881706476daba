use super::collect::{Collected, Source};
use super::drawing::{Drawing, Drawn};
use super::oblique;
use super::theme::Background;
use super::view::{ColorBy, View};
use crate::ColorMap;
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, Point};
use voxtile::{Error, Result};
use voxtile_distance::DistanceOptions;

/// Options of a picture of a map.
///
/// Memory: 12 bytes per cell (44 with the colors of a layer, one more with moving points), 4 per pixel, and one tile
/// per thread, whatever the size of the map. An oblique view needs 68 bytes per pixel, or 20 beyond 8 million pixels.
#[derive(Clone, Debug)]
pub struct Picture {
    pub(super) view: View,
    pub(super) color_by: ColorBy,
    pub(super) color_map: &'static ColorMap,
    pub(super) region: Option<Aabb>,
    pub(super) max_height_m: Option<f64>,
    pub(super) most_px: [usize; 2],
    pub(super) has_grid: bool,
    pub(super) has_legend: bool,
    pub(super) dpi: Option<f64>,
    pub(super) background: Background,
    pub(super) path: Vec<Point>,
    pub(super) title: String,
    pub(super) skips_unreadable: bool,
}

/// Maximum number of pixels along an edge. A square of this size needs 4.3 GB.
pub(super) const MAX_PX: usize = 16384;

impl Default for Picture {
    fn default() -> Self {
        Self {
            view: View::Above,
            color_by: ColorBy::Height,
            color_map: ColorMap::voxtile(),
            region: None,
            max_height_m: None,
            most_px: [2048; 2],
            has_grid: true,
            has_legend: true,
            dpi: None,
            background: Background::Dark,
            path: Vec::new(),
            title: String::new(),
            skips_unreadable: false,
        }
    }
}

impl Picture {
    /// Returns the default: from above, colored by height, 2048 pixels wide or high, with a tile grid and a legend.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the view.
    pub fn with_view(self, view: View) -> Self {
        Self { view, ..self }
    }

    /// Sets the meaning of the colors. A difference has its own colors.
    pub fn with_color(self, color_by: ColorBy) -> Self {
        Self { color_by, ..self }
    }

    /// Sets the colors of values. Colors and classes of points, and differences, have their own.
    pub fn with_color_map(self, color_map: &'static ColorMap) -> Self {
        Self { color_map, ..self }
    }

    /// Draws only voxels whose center is in a box.
    pub fn with_region(self, region: Aabb) -> Self {
        Self { region: Some(region), ..self }
    }

    /// Draws only voxels whose center is below a height in metres, for example without the ceiling of a room
    /// ([`Roof`](crate::Roof)).
    pub fn with_max_height_m(self, max_height_m: Option<f64>) -> Self {
        Self { max_height_m, ..self }
    }

    /// Sets the maximum size of the map in pixels to the right and up, at most 16384; title and legend are added. A
    /// small map is enlarged to whole pixels per voxel; in a large map a pixel covers several voxels.
    pub fn with_size_px(self, most_px: [usize; 2]) -> Self {
        Self { most_px: most_px.map(|px| px.clamp(1, MAX_PX)), ..self }
    }

    /// Sets the resolution in pixels per inch, 10 to 2,400: the PNG has its physical size, and type and lines have
    /// those of print. `None`, the default, makes the picture 17 cm wide, the text of an A4 page.
    pub fn with_dpi(self, dpi: Option<f64>) -> Self {
        let dpi = dpi.filter(|dpi| dpi.is_finite()).map(|dpi| dpi.clamp(10.0, 2_400.0));
        Self { dpi, ..self }
    }

    /// Sets the background.
    pub fn with_background(self, background: Background) -> Self {
        Self { background, ..self }
    }

    /// Sets whether tile borders are drawn; only every tenth or hundredth if they would be too dense.
    pub fn with_grid(self, has_grid: bool) -> Self {
        Self { has_grid, ..self }
    }

    /// Sets whether there is a margin with title, axes, scale bar and colors.
    pub fn with_legend(self, has_legend: bool) -> Self {
        Self { has_legend, ..self }
    }

    /// Sets the trajectory: positions in metres in order of time, for example from
    /// [`MapReader::scans`](voxtile::MapReader::scans).
    pub fn with_path(self, path: Vec<Point>) -> Self {
        Self { path, ..self }
    }

    /// Sets the title above the map. Characters that the font lacks are boxes.
    pub fn with_title(self, title: impl Into<String>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// Skips unreadable tiles and lists them in [`Drawn::unread`], instead of failing.
    pub fn skipping_unreadable(self) -> Self {
        Self { skips_unreadable: true, ..self }
    }

    /// Draws a map. `progress` receives the numbers of finished and of all tiles, from any thread.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read, if the map has no values for the color, or if a height or region is invalid.
    pub fn draw(&self, map: &dyn MapView, progress: impl Fn(u64, u64) + Sync) -> Result<Drawn> {
        if let View::Oblique { azimuth_deg, elevation_deg } = self.view {
            self.check_map(map)?;
            return oblique::draw(self, oblique::Camera::new(azimuth_deg, elevation_deg), map, &progress);
        }
        Ok(self.start(map, progress)?.finish())
    }

    /// Reads the tiles of a map, like [`Picture::draw`], and returns a drawing that takes points before it is finished.
    ///
    /// # Errors
    ///
    /// As [`Picture::draw`], and with [`View::Oblique`].
    pub fn start(&self, map: &dyn MapView, progress: impl Fn(u64, u64) + Sync) -> Result<Drawing<'_>> {
        self.check_flat()?;
        self.check_map(map)?;
        let collected = Collected::of(self, Source::One(map), &progress)?;
        Ok(Drawing::new(self, map.config(), collected))
    }

    /// Checks the options and that the map has values for the color.
    fn check_map(&self, map: &dyn MapView) -> Result<()> {
        self.check()?;
        if self.color_by == ColorBy::Distance {
            return Err(Error::argument("color", "distances are drawn by `start_distances`"));
        }
        let knows_scans =
            || map.tile_indices().first().is_none_or(|&tile| map.last_scan_of_tile_hint(tile).is_some());
        if self.color_by == ColorBy::LastScan && !knows_scans() {
            let reason = "the map does not record the last scan of its tiles; color by something else";
            return Err(Error::argument("color", reason));
        }
        if let ColorBy::Layer(layer) = self.color_by {
            layer.check(&map.config().layers())?;
        }
        Ok(())
    }

    /// Checks that the picture has cells.
    pub(super) fn check_flat(&self) -> Result<()> {
        match self.view {
            View::Oblique { .. } => {
                Err(Error::argument("view", "an oblique view shows a single map, without points"))
            }
            _ => Ok(()),
        }
    }

    /// Draws the difference of two maps or states of a map: voxels occupied in both, only before, or only after, in
    /// three colors. If a cell has several, appeared voxels hide vanished ones, and these hide unchanged ones.
    /// `progress` receives the numbers of finished and of all tiles, from any thread.
    ///
    /// # Errors
    ///
    /// Fails if resolution or tile size differ, and as [`Picture::draw`].
    pub fn draw_difference(
        &self,
        before: &dyn MapView,
        after: &dyn MapView,
        progress: impl Fn(u64, u64) + Sync,
    ) -> Result<Drawn> {
        Ok(self.start_difference(before, after, progress)?.finish())
    }

    /// Reads the tiles of two maps, like [`Picture::draw_difference`], and returns a drawing that takes points before it
    /// is finished.
    ///
    /// # Errors
    ///
    /// As [`Picture::draw_difference`].
    pub fn start_difference(
        &self,
        before: &dyn MapView,
        after: &dyn MapView,
        progress: impl Fn(u64, u64) + Sync,
    ) -> Result<Drawing<'_>> {
        self.check_flat()?;
        self.check()?;
        let [grid_before, grid] = [before, after].map(|map| map.config().grid);
        if grid_before != grid {
            let reason =
                format!("has {grid_before}, the other {grid}; only maps of one grid can be compared");
            return Err(Error::argument("the map before", reason));
        }
        let collected = Collected::of(self, Source::Two { before, after }, &progress)?;
        Ok(Drawing::new(self, after.config(), collected))
    }

    /// Computes the distances of a layer of voxels to the nearest obstacle, and returns their drawing. The view must be
    /// [`View::Slice`]; the color is [`ColorBy::Distance`]. `progress` receives the numbers of finished and of all
    /// parts.
    ///
    /// # Errors
    ///
    /// Fails if the view is another one, the cap is invalid, or a tile cannot be read.
    pub fn start_distances<V: MapView>(
        &mut self,
        map: &V,
        options: DistanceOptions,
        progress: impl Fn(u64, u64) + Sync,
    ) -> Result<Drawing<'_>> {
        self.color_by = ColorBy::Distance;
        self.check()?;
        if !matches!(self.view, View::Slice { .. }) {
            return Err(Error::argument("view", "distances are drawn of a slice"));
        }
        let collected = Collected::of_distances(self, map, options, &progress)?;
        Ok(Drawing::new(self, map.config(), collected))
    }

    pub(super) fn check(&self) -> Result<()> {
        if let View::Slice { z_m, thickness_m } = self.view
            && !(z_m.is_finite() && thickness_m.is_finite() && thickness_m >= 0.0)
        {
            return Err(Error::argument("slice", "needs a height and a thickness of at least 0, in metres"));
        }
        if let View::Oblique { azimuth_deg, elevation_deg } = self.view
            && !(azimuth_deg.is_finite() && (0.0..=90.0).contains(&elevation_deg))
        {
            let reason = "needs an azimuth in degrees, and an elevation of 0 to 90 degrees";
            return Err(Error::argument("view", reason));
        }
        if self.max_height_m.is_some_and(f64::is_nan) {
            return Err(Error::argument("max_height", "needs a height in metres"));
        }
        match self.region {
            Some(region) if (0..3).any(|k| region.min[k].is_nan() || region.max[k].is_nan()) => {
                Err(Error::argument("region", "needs six numbers, in metres"))
            }
            _ => Ok(()),
        }
    }
}

use super::super::canvas::Canvas;
use super::super::collect::{Collector, OUTSIDE, Progress, Source};
use super::super::drawing::{AXES, Drawn, nothing};
use super::super::layer_cells::LayerValue;
use super::super::layout::Layout;
use super::super::legend::{Legend, Pen, Scale};
use super::super::options::Picture;
use super::super::palette::{Rgb, lit};
use super::super::theme::Theme;
use super::super::values::Values;
use super::super::view::ColorBy;
use super::camera::Camera;
use super::code::{Coding, Times, Value};
use super::extent::{Bounds, Extent};
use super::ground::Ground;
use super::plan::Plan;
use super::samples::{Sample, Samples};
use super::shade::Shade;
use super::trajectory::Trajectory;
use crate::Layer;
use rayon::prelude::*;
use std::collections::BTreeMap;
use voxtile::mapper::{MapView, TileRef};
use voxtile::space::{Aabb, TileIndex};
use voxtile::{Result, Voxel};

/// Distance of the samples that are compared for shades, in points.
const SHADE_PT: f64 = 0.4;
/// Width of grid lines in points.
const LINE_PT: f64 = 0.4;
/// Rows of pixels that are shaded at a time.
const BAND: usize = 64;

/// Draws the occupied voxels of a map from a direction between above and the side.
pub fn draw(
    picture: &Picture,
    camera: Camera,
    map: &dyn MapView,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Drawn> {
    let collector = Collector::new(picture, Source::One(map));
    let tiles = collector.tiles();
    let progress = Progress::new(2 * tiles.len() as u64, progress);
    let Some(voxels) = collector.bounds(&tiles) else {
        return Ok(nothing(picture, &map.config().grid, tiles.len() as u64, collector.into_unread()));
    };
    let occupied = |tile: &TileRef, visit: &mut dyn FnMut(Voxel)| {
        let found = tile.voxels_from(map.config().occupied_log_odds());
        found.filter(|voxel| voxels.contains(voxel.index)).for_each(visit);
    };
    let coding = match picture.color_by {
        ColorBy::Layer(layer) => Coding::Layer(layer, Times::none()),
        _ => Coding::Number,
    };
    let extent = Extent::new(camera, &voxels);
    collector.for_each_tile(&tiles, &progress, |index| {
        let Some(tile) = map.tile_uncached(index)? else { return Ok(()) };
        occupied(&tile, &mut |voxel| {
            extent.add(voxel.index);
            if let Coding::Layer(Layer::Time, times) = &coding
                && let Some(time) = tile.layers_of(voxel.index).and_then(|layers| layers.time)
            {
                times.add(time.last_ns);
            }
        });
        Ok(())
    })?;
    let outside = if picture.region.is_some() { 0.0 } else { OUTSIDE };
    let Some(bounds) = extent.bounds(outside) else {
        return Ok(nothing(picture, &map.config().grid, tiles.len() as u64, collector.into_unread()));
    };
    // The trajectory is inside, too, but not where it leaves the map or the region.
    let grid = map.config().grid;
    let places = picture.path.iter().filter_map(|place| grid.voxel_of(*place));
    let bounds = places.filter(|&voxel| voxels.contains(voxel)).fold(bounds, |bounds, voxel| {
        let [right, up, _] = camera.project(Camera::middle(voxels.min, voxel));
        bounds.with([right, up])
    });
    let plan = Plan::of(picture, camera, voxels.min, &bounds, extent.depth());
    let samples = Samples::new(plan.frame);
    collector.for_each_tile(&tiles, &progress, |index| {
        let Some(tile) = map.tile_uncached(index)? else { return Ok(()) };
        let last_scan = map.last_scan_of_tile_hint(index).unwrap_or_default() as f32;
        occupied(&tile, &mut |voxel| {
            samples.add(voxel.index, || {
                coding.code(match picture.color_by {
                    ColorBy::Count => Value::Number(voxel.evidence.observation_count as f32),
                    ColorBy::LastScan => Value::Number(last_scan),
                    ColorBy::Height | ColorBy::Distance => {
                        Value::Number(map.config().grid.center_m(voxel.index)[2] as f32)
                    }
                    ColorBy::Probability => Value::Number(voxel.evidence.probability() as f32),
                    ColorBy::Layer(layer) => {
                        let layers = tile.layers_of(voxel.index);
                        Value::Layer(layers.and_then(|layers| LayerValue::of(layer, &layers)))
                    }
                })
            });
        });
        Ok(())
    })?;
    let image = Oblique { picture, map, coding, samples, plan, bounds };
    Ok(image.draw(tiles.len() as u64, collector.into_unread()))
}

/// An image whose samples are complete.
struct Oblique<'a> {
    picture: &'a Picture,
    map: &'a dyn MapView,
    coding: Coding,
    samples: Samples,
    plan: Plan,
    bounds: Bounds,
}

impl Oblique<'_> {
    fn draw(&self, tiles: u64, unread: Vec<TileIndex>) -> Drawn {
        let Self { picture, map, plan, .. } = self;
        let (config, theme) = (map.config(), Theme::of(picture.background));
        let mut values = Values { picture, layers: config.layers(), range: None };
        values.range = match picture.color_by {
            ColorBy::Probability => Some([0.5, 1.0]),
            _ => values.range_of(self.numbers(&values)),
        };
        let (classes, without_value) = self.counts();
        let entries = values.entries(&classes, without_value);
        let layout = Layout::of(picture, plan.size_px, &entries);
        let (measure, corner) = (layout.measure, [layout.left, layout.top]);
        let mut canvas = Canvas::new(layout.width, layout.height, &theme);
        let resolution_m = config.grid.resolution_m();
        let ground = Ground::of(plan, &self.bounds, resolution_m);
        if picture.has_grid {
            ground.draw(&mut canvas, plan, corner, measure.exact_px(LINE_PT).max(1.0), &theme);
        }
        let shade = Shade::new(&plan.frame, measure.px(SHADE_PT) * plan.samples_per_px);
        self.draw_samples(&mut canvas, corner, &values, &shade);
        let path = Trajectory { path_m: &picture.path, samples: &self.samples, plan, resolution_m };
        path.draw(&mut canvas, corner, measure, &theme);
        if picture.has_legend {
            let title = measure.title().fitted(&picture.title, layout.width - 2 * layout.margin);
            canvas.text(layout.margin, layout.margin, measure.title(), theme.ink, &title);
            let camera = plan.frame.camera;
            let legend = Legend {
                metres_a_pixel: resolution_m / plan.zoom(),
                lines_m: picture.has_grid.then_some(ground.every_m),
                axes: (0..3).map(|k| (AXES[k], [camera.right[k], -camera.up[k]])).collect(),
                has_north: config.crs.is_some(),
                has_path: !picture.path.is_empty(),
                has_space: false,
                scale: Scale::Values {
                    color_by: picture.color_by,
                    color_map: picture.color_map,
                    range: values.range,
                },
                entries,
            };
            legend.draw(&mut Pen { canvas: &mut canvas, foot: layout.foot, measure, theme: &theme });
        }
        let solid_cells = self.samples.iter().count() as u64;
        let corner_m = |end: usize| {
            std::array::from_fn(|k| (self.bounds.map[k][end] + f64::from(plan.frame.base[k])) * resolution_m)
        };
        Drawn {
            image: canvas.into_image(measure.dpi()),
            map_px: [corner[0], corner[1], plan.size_px[0], plan.size_px[1]],
            region_m: Some(Aabb { min: corner_m(0), max: corner_m(1) }),
            max_height_m: picture.max_height_m,
            cell_m: resolution_m,
            cell_px: (plan.zoom().round() as usize).max(1),
            range: values.range,
            solid_cells,
            known_cells: solid_cells,
            classes,
            cells_without_value: without_value,
            moving_points: None,
            tiles,
            unread,
        }
    }

    /// Returns the values of all samples as numbers.
    fn numbers(&self, values: &Values) -> Vec<f64> {
        let number = |sample: Sample| match self.coding.value(sample.code) {
            Value::Number(number) => Some(f64::from(number)),
            Value::Layer(value) => value.and_then(|value| values.number_of(value)),
        };
        self.samples.iter().filter_map(number).collect()
    }

    /// Returns the number of samples of each class, and of those without a value of the layer that is shown.
    fn counts(&self) -> (Vec<(u8, u64)>, u64) {
        let (mut classes, mut without) = (BTreeMap::new(), 0);
        if matches!(self.coding, Coding::Layer(..)) {
            for sample in self.samples.iter() {
                match self.coding.value(sample.code) {
                    Value::Layer(Some(LayerValue::Class(class))) => *classes.entry(class).or_default() += 1,
                    Value::Layer(None) => without += 1,
                    _ => {}
                }
            }
        }
        (classes.into_iter().collect(), without)
    }

    fn draw_samples(&self, canvas: &mut Canvas, corner: [usize; 2], values: &Values, shade: &Shade) {
        let [width, height] = self.plan.size_px;
        for top in (0..height).step_by(BAND) {
            let rows = top..(top + BAND).min(height);
            let row = |y: usize| -> Vec<(Rgb, f64)> {
                (0..width).map(|x| self.pixel([x, y], values, shade)).collect()
            };
            let band: Vec<Vec<(Rgb, f64)>> = rows.clone().into_par_iter().map(row).collect();
            for (y, row) in rows.zip(band) {
                for (x, (color, cover)) in row.into_iter().enumerate().filter(|(_, (_, cover))| *cover > 0.0)
                {
                    canvas.fill(corner[0] + x, corner[1] + y, [1; 2], color, cover);
                }
            }
        }
    }

    /// Returns the mean color of the samples of a pixel, and the share of them that have one.
    fn pixel(&self, [x, y]: [usize; 2], values: &Values, shade: &Shade) -> (Rgb, f64) {
        let edge = self.plan.samples_per_px;
        let (mut sums, mut count) = ([0_u32; 3], 0_u32);
        for place in 0..edge * edge {
            let at = [x * edge + place % edge, y * edge + place / edge];
            let Some(sample) = self.samples.at(at[0], at[1]) else { continue };
            let color = match self.coding.value(sample.code) {
                Value::Number(number) => values.color_of(f64::from(number)),
                Value::Layer(value) => values.color_of_layer(value),
            };
            let color = lit(color, shade.light(&self.samples, at, &sample));
            sums = std::array::from_fn(|k| sums[k] + u32::from(color[k]));
            count += 1;
        }
        let mean = |sum: u32| ((sum + count / 2) / count.max(1)) as u8;
        (sums.map(mean), f64::from(count) / (edge * edge) as f64)
    }
}

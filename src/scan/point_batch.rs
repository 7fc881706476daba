use super::per_ray::OrderedCollector;
use super::spill::{Overflow, ScanParts};
use super::trace::{HitsByTile, check_intensities};
use super::updates::MappedTiles;
use super::{ChunkMarks, LayerHit, PointFrame, ScanPoints, ScanReport, ScanUpdates, Stop};
use crate::config::{Layers, MapConfig};
use crate::error::{Error, Result};
use crate::sensor::{Observation, SensorModel};
use crate::space::{Grid, Point, TileBox};

/// Observations of single points without rays, in order.
#[derive(Clone, Copy, Debug)]
pub struct PointBatch<'a> {
    /// Points in metres, world frame.
    pub points: &'a [Point],
    /// Intensity of each point, if the sensor model needs it.
    pub intensities: Option<&'a [f32]>,
    /// Whether each point was observed occupied (a hit) or free (a miss).
    pub is_occupied: &'a [bool],
}

impl PointBatch<'_> {
    /// Returns the updates, one per entry, grouped by tile.
    ///
    /// # Errors
    ///
    /// Fails if the lists differ in length, or if intensities are missing that the sensor model needs.
    pub fn updates(&self, grid: &Grid, model: &SensorModel) -> Result<ScanUpdates> {
        self.updates_with_layers(grid, model, Layers::NONE)
    }

    /// Like [`PointBatch::updates`], with the hits for the layers.
    pub(crate) fn updates_with_layers(
        &self,
        grid: &Grid,
        model: &SensorModel,
        layers: Layers,
    ) -> Result<ScanUpdates> {
        check_intensities(model, self.points.len(), self.intensities)?;
        if self.is_occupied.len() != self.points.len() {
            let reason = format!(
                "{} for {} points; one per point is needed",
                self.is_occupied.len(),
                self.points.len()
            );
            return Err(Error::argument("is_occupied", reason));
        }
        let mut collector = BatchCollector::new(grid, model, layers, self.points.len(), None);
        for (number, (&point, &is_occupied)) in self.points.iter().zip(self.is_occupied).enumerate() {
            let intensity = self.intensities.map_or(0.0, |intensities| intensities[number]);
            let observation = if is_occupied { Observation::Hit(intensity) } else { Observation::Miss };
            let of_layers = Attributes {
                intensity: self.intensities.map_or(f32::NAN, |intensities| intensities[number]),
                ..Attributes::NONE
            };
            collector.take(point, intensity, observation, &of_layers);
        }
        Ok(collector.into_updates())
    }
}

/// Returns the updates of a batch with the points of a scan as hits; points outside of the mapped region are omitted.
/// The result is that of [`PointBatch::updates`], but it is computed in chunks. With `overflow`, updates that exceed
/// the memory limit are spilled and the rest is returned.
///
/// # Errors
///
/// Fails if intensities are missing that the sensor model needs, if points cannot be read or updates cannot be spilled,
/// or if the stop flag is raised.
pub(crate) fn updates_of_hits(
    config: &MapConfig,
    scan: &dyn ScanPoints,
    stop: &Stop,
    overflow: Option<Overflow<'_>>,
) -> Result<ScanUpdates> {
    let MapConfig { grid, sensor_model: model, rays, .. } = config;
    if !scan.has_intensities() {
        check_intensities(model, scan.len(), None)?;
    }
    let mut collector = BatchCollector::new(grid, model, config.layers(), scan.len(), scan.stamp_ns());
    let Some(mut overflow) = overflow else {
        for_each_hit(scan, stop, |point, intensity, attributes| {
            collector.take_within(rays.region, point, intensity, attributes);
            true
        })?;
        return Ok(collector.into_updates());
    };
    let Overflow { max_bytes, max_tiles, make_scratch, .. } = overflow;
    let mapped = MappedTiles { grid, selection: None };
    let parts = ScanParts::new(mapped, None, stop, max_bytes / 4, max_tiles, make_scratch);
    let mut failure = None;
    for_each_hit(scan, stop, |point, intensity, attributes| {
        collector.take_within(rays.region, point, intensity, attributes);
        if collector.updates.bytes() > max_bytes / 2 {
            collector.updates.drain_to(&parts);
        }
        if collector.hit_bytes() > max_bytes / 4 {
            failure = (overflow.spill)(collector.take_hits().into_packed()).err();
        }
        !parts.has_failed() && failure.is_none()
    })?;
    if let Some(error) = failure {
        return Err(error);
    }
    if parts.is_empty() {
        return Ok(collector.into_updates());
    }
    collector.updates.drain_to(&parts);
    let mut updates = parts.into_updates(collector.report, false, stop, &mut overflow)?;
    collector.hits.add_to(&mut updates);
    Ok(updates)
}

/// Attributes of a point for the layers.
struct Attributes {
    /// NaN if the point has none.
    intensity: f32,
    colour: Option<[u8; 3]>,
    class: Option<u8>,
}

impl Attributes {
    const NONE: Self = Self { intensity: f32::NAN, colour: None, class: None };
}

/// Passes points that are not marked as moving with their intensities (0 if they have none) and attributes, until `take`
/// returns false.
fn for_each_hit(
    scan: &dyn ScanPoints,
    stop: &Stop,
    mut take: impl FnMut(Point, f32, &Attributes) -> bool,
) -> Result<()> {
    let mut marks = ChunkMarks::from(scan.moving(), 0);
    scan.for_each_attributed_chunk(
        0..scan.len(),
        PointFrame::World,
        &mut |points, intensities, attributes| {
            let is_moving = marks.next(points.len());
            let mut numbered = points.iter().enumerate();
            let goes_on = numbered.all(|(number, &point)| {
                let intensity = intensities.map(|intensities| intensities[number]);
                let of_point = Attributes {
                    intensity: intensity.unwrap_or(f32::NAN),
                    colour: attributes.colour(number),
                    class: attributes.class(number),
                };
                is_moving.get(number).is_some_and(|is_moving| *is_moving)
                    || take(point, intensity.unwrap_or(0.0), &of_point)
            });
            goes_on && !stop.is_set()
        },
    )?;
    stop.check()
}

/// Collector of the points of a batch, in order.
struct BatchCollector<'a> {
    grid: &'a Grid,
    model: &'a SensorModel,
    updates: OrderedCollector<'a>,
    layers: Layers,
    stamp_ns: Option<i64>,
    hits: HitsByTile<'a>,
    report: ScanReport,
}

impl<'a> BatchCollector<'a> {
    fn new(
        grid: &'a Grid,
        model: &'a SensorModel,
        layers: Layers,
        points: usize,
        stamp_ns: Option<i64>,
    ) -> Self {
        let mapped = MappedTiles { grid, selection: None };
        let updates = OrderedCollector::new(mapped, model.needs_intensity());
        let hits = HitsByTile::new(mapped, layers, stamp_ns);
        let report = ScanReport { points: points as u64, ..ScanReport::default() };
        Self { grid, model, updates, layers, stamp_ns, hits, report }
    }

    fn take(&mut self, point: Point, intensity: f32, observation: Observation, of_layers: &Attributes) {
        if self.model.needs_intensity() && intensity.is_nan() {
            self.report.skipped.no_intensity += 1;
        } else if !point.iter().all(|coordinate| coordinate.is_finite()) {
            self.report.skipped.not_finite += 1;
        } else if let Some(voxel) = self.grid.voxel_of(point) {
            if self.model.is_evidence(observation) {
                self.updates.push(voxel, observation);
                if !self.layers.is_none() && matches!(observation, Observation::Hit(_)) {
                    self.hits.push(self.grid.to_voxel_units(point), voxel, |layers| LayerHit {
                        intensity: layers.stored_intensity(of_layers.intensity),
                        colour: of_layers.colour.filter(|_| layers.colour),
                        class: of_layers.class.filter(|_| layers.class),
                        ..LayerHit::default()
                    });
                }
            }
        } else {
            self.report.skipped.out_of_range += 1;
        }
    }

    /// Adds a hit unless it is outside of `region`. A point outside of the map's space is skipped and counted.
    fn take_within(&mut self, region: Option<TileBox>, point: Point, intensity: f32, of_layers: &Attributes) {
        let is_outside =
            region.zip(self.grid.tile_of(point)).is_some_and(|(region, tile)| !region.contains(tile));
        if !is_outside {
            self.take(point, intensity, Observation::Hit(intensity), of_layers);
        }
    }

    /// Bytes of memory of the hits for the layers.
    fn hit_bytes(&self) -> usize {
        self.hits.bytes()
    }

    /// Takes the hits for the layers.
    fn take_hits(&mut self) -> HitsByTile<'a> {
        let mapped = MappedTiles { grid: self.grid, selection: None };
        std::mem::replace(&mut self.hits, HitsByTile::new(mapped, self.layers, self.stamp_ns))
    }

    fn into_updates(self) -> ScanUpdates {
        let mut updates = self.updates.into_updates(self.report);
        self.hits.add_to(&mut updates);
        updates
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{PackedUpdates, Scan};
    use crate::scratch::Scratch;
    use crate::space::TileIndex;
    use std::collections::BTreeMap;
    use std::path::Path;

    /// Packed updates of each tile, in order.
    type ByTile = BTreeMap<TileIndex, PackedUpdates>;

    fn add(tiles: Vec<(TileIndex, PackedUpdates)>, all: &mut ByTile) {
        tiles.into_iter().for_each(|(tile, updates)| all.entry(tile).or_default().append(&updates));
    }

    /// Voxels of each tile's updates, one by one.
    fn voxels(all: &ByTile) -> Vec<(TileIndex, Vec<u32>)> {
        let of = |updates: &PackedUpdates| {
            let lists = updates.iter().map(|list| match list {
                crate::scan::TileUpdates::Ordered(list) => list.parts().0.to_vec(),
                other => panic!("{other:?} is no list"),
            });
            lists.flatten().collect()
        };
        all.iter().map(|(tile, updates)| (*tile, of(updates))).collect()
    }

    #[test]
    fn hits_beyond_the_limit_are_spilled_in_order() {
        const MAX_BYTES: usize = 8 << 10;
        let config = MapConfig::new(0.1, 1.6).unwrap();
        let mut points: Vec<Point> =
            (0..5000_i32).map(|k| [7, 11, 13].map(|step| f64::from(k * step % 97) * 0.05 - 2.0)).collect();
        points[77] = [f64::NAN; 3];
        points[4000] = [1e12; 3];
        let scan = Scan { origin: [0.0; 3], points: points.clone(), intensities: None };
        let is_occupied = vec![true; points.len()];
        let batch = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
        let whole = batch.updates(&config.grid, &config.sensor_model).unwrap();
        let mut expected = ByTile::new();
        let packed = |updates: ScanUpdates| -> Vec<_> {
            updates.tiles.iter().map(|(tile, updates)| (*tile, PackedUpdates::of(updates))).collect()
        };
        let report = whole.report;
        add(packed(whole), &mut expected);

        let (mut found, mut parts) = (ByTile::new(), 0);
        let mut spill = |part: Vec<(TileIndex, PackedUpdates)>| {
            parts += 1;
            assert!(part.iter().map(|(_, updates)| updates.as_bytes().len()).sum::<usize>() < 2 * MAX_BYTES);
            add(part, &mut found);
            Ok(())
        };
        let make_scratch = || Ok(Box::new(Vec::new()) as Box<dyn Scratch>);
        let overflow = Overflow {
            max_bytes: MAX_BYTES,
            max_tiles: usize::MAX,
            folder: Path::new("map"),
            make_scratch: &make_scratch,
            spill: &mut spill,
        };
        let rest = updates_of_hits(&config, &scan, &Stop::default(), Some(overflow)).unwrap();
        assert_eq!((rest.report, parts > 1), (report, true));
        add(packed(rest), &mut found);
        assert_eq!(voxels(&found), voxels(&expected));
    }
}

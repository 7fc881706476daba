use super::per_ray::OrderedCollector;
use super::trace::check_intensities;
use super::updates::MappedTiles;
use super::{ScanReport, ScanUpdates};
use crate::error::{Error, Result};
use crate::sensor::{Observation, SensorModel};
use crate::space::{Grid, Point};

/// Observations of single points without rays, in the order in which they count.
#[derive(Clone, Copy, Debug)]
pub struct PointBatch<'a> {
    /// Points in metres, world frame.
    pub points: &'a [Point],
    /// Intensity of each point, where the sensor model needs one.
    pub intensities: Option<&'a [f32]>,
    /// Whether each point was seen occupied (a hit) or free (a miss).
    pub is_occupied: &'a [bool],
}

impl PointBatch<'_> {
    /// The updates, one per entry, grouped by tile.
    ///
    /// # Errors
    ///
    /// Lists of different lengths, or no intensities where the sensor model needs them.
    pub fn updates(&self, grid: &Grid, model: &SensorModel) -> Result<ScanUpdates> {
        check_intensities(model, self.points.len(), self.intensities)?;
        if self.is_occupied.len() != self.points.len() {
            let reason =
                format!("{} for {} points; give one a point", self.is_occupied.len(), self.points.len());
            return Err(Error::argument("is_occupied", reason));
        }
        let mut collector =
            OrderedCollector::new(MappedTiles { grid, selection: None }, model.needs_intensity());
        let mut report = ScanReport { points: self.points.len() as u64, ..ScanReport::default() };
        for (number, (&point, &is_occupied)) in self.points.iter().zip(self.is_occupied).enumerate() {
            let intensity = self.intensities.map_or(0.0, |intensities| intensities[number]);
            let observation = if is_occupied { Observation::Hit(intensity) } else { Observation::Miss };
            if model.needs_intensity() && intensity.is_nan() {
                report.skipped.no_intensity += 1;
            } else if !point.iter().all(|coordinate| coordinate.is_finite()) {
                report.skipped.not_finite += 1;
            } else if let Some(voxel) = grid.voxel_of(point) {
                if model.is_evidence(observation) {
                    collector.push(voxel, observation);
                }
            } else {
                report.skipped.out_of_range += 1;
            }
        }
        Ok(collector.into_updates(report))
    }
}

use super::point_store::PointStore;
use std::ops::Range;
use voxtile::Result;
use voxtile::scan::{AttributeSet, MovingMarks, PointFrame, Pose, ScanPoints, TakeAttributed, TakePoints};
use voxtile::space::Point;

/// Scan of any size in the sensor frame, with the sensor's pose.
///
/// The [`ScanPoints`] implementation returns its points in the world frame.
#[derive(Debug)]
pub struct StoredScan {
    /// Name in its source: a file name or a number.
    pub name: String,
    /// Time stamp, in nanoseconds since the epoch of the source, if known.
    pub stamp_ns: Option<i64>,
    /// End points in the sensor frame, in metres.
    pub points_in_sensor: PointStore,
    /// Pose of the sensor: `world = R * p + t`.
    pub world_from_sensor: Pose,
}

impl ScanPoints for StoredScan {
    fn origin(&self) -> Point {
        self.world_from_sensor.position_m()
    }

    fn stamp_ns(&self) -> Option<i64> {
        self.stamp_ns
    }

    fn len(&self) -> usize {
        self.points_in_sensor.len()
    }

    fn has_intensities(&self) -> bool {
        self.points_in_sensor.has_intensities()
    }

    fn moving(&self) -> Option<&MovingMarks> {
        self.points_in_sensor.moving()
    }

    fn attributes(&self) -> AttributeSet {
        self.points_in_sensor.attributes()
    }

    fn for_each_attributed_chunk(
        &self,
        range: Range<usize>,
        frame: PointFrame,
        take: &mut TakeAttributed<'_>,
    ) -> Result<()> {
        if frame == PointFrame::Own {
            return self.points_in_sensor.for_each_attributed_chunk(range, take);
        }
        let (to_world, mut in_world) = (self.world_from_sensor.to_world(), Vec::new());
        self.points_in_sensor.for_each_attributed_chunk(range, &mut |points, intensities, attributes| {
            in_world.clear();
            in_world.extend(points.iter().copied().map(to_world));
            take(&in_world, intensities, attributes)
        })
    }

    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.for_each_attributed_chunk(range, PointFrame::World, &mut |points, intensities, _| {
            take(points, intensities)
        })
    }

    fn world_from_sensor(&self) -> Option<Pose> {
        Some(self.world_from_sensor)
    }

    fn for_each_own_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.points_in_sensor.for_each_chunk(range, take)
    }
}

use super::point_store::PointStore;
use std::ops::Range;
use voxtile::Result;
use voxtile::scan::{
    AttributeSet, MovingMarks, PointFrame, Pose, ScanPoints, Sweep, TakeAttributed, TakePoints,
};
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
    /// End points in the sensor frame, in metres; in that at their own times, if they have times.
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
        let to_world = (frame == PointFrame::World).then(|| self.world_from_sensor.to_world());
        let mut to_stamp = self.sweep().filter(|_| frame != PointFrame::Raw).map(Sweep::to_stamp);
        if to_world.is_none() && to_stamp.is_none() {
            return self.points_in_sensor.for_each_attributed_chunk(range, take);
        }
        let mut moved = Vec::new();
        self.points_in_sensor.for_each_attributed_chunk(range, &mut |points, intensities, attributes| {
            moved.clear();
            moved.extend_from_slice(points);
            if let Some(to_stamp) = &mut to_stamp {
                for (point, time_ns) in moved.iter_mut().zip(attributes.times_ns) {
                    *point = to_stamp.apply(*point, *time_ns);
                }
            }
            if let Some(to_world) = &to_world {
                moved.iter_mut().for_each(|point| *point = to_world(*point));
            }
            take(&moved, intensities, attributes)
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
        self.for_each_attributed_chunk(range, PointFrame::Own, &mut |points, intensities, _| {
            take(points, intensities)
        })
    }

    fn sweep(&self) -> Option<&Sweep> {
        self.points_in_sensor.sweep().map(|sweep| &**sweep)
    }

    fn body_from_sensor(&self) -> Option<[f64; 7]> {
        self.points_in_sensor.body_from_sensor()
    }
}

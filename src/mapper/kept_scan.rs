use crate::config::RayConfig;
use crate::error::Result;
use crate::persistence::{PointReader, read_marks};
use crate::scan::{
    AttributeSet, MovingMarks, PointAttributes, PointFrame, Pose, ScanPoints, Sweep, TakeAttributed,
    TakePoints,
};
use crate::space::Point;
use crate::store::{Disk, KeptFrame, KeptRecord, Layout};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::ops::Range;
use std::sync::Arc;

/// Scan that a map keeps, bit-identical to the inserted one.
///
/// Its implementation of [`ScanPoints`] yields points in the world frame, transformed by its current pose.
#[derive(Clone, Debug)]
pub struct KeptScan {
    record: KeptRecord,
    world_from_sensor: Option<Pose>,
    points: Points,
    moving: Option<Arc<MovingMarks>>,
}

/// New pose of a scan.
#[derive(Clone, Debug)]
pub struct NewPose {
    /// Pose of the sensor at the stamp of the scan.
    pub world_from_sensor: Pose,
    /// Motion of the sensor during the scan; `None` to keep the motion that it has.
    pub sweep: Option<Arc<Sweep>>,
}

impl NewPose {
    /// Changes the record of a scan.
    pub(crate) fn put_in(&self, record: &mut KeptRecord) {
        record.frame = KeptFrame::Sensor(pose_numbers(&self.world_from_sensor));
        // Without times of points, a motion has no meaning.
        if record.sweep.is_some() && self.sweep.is_some() {
            record.sweep.clone_from(&self.sweep);
        }
    }
}

impl From<Pose> for NewPose {
    fn from(world_from_sensor: Pose) -> Self {
        Self { world_from_sensor, sweep: None }
    }
}

#[derive(Clone, Debug)]
enum Points {
    InMemory(Vec<Point>, Vec<f32>, PointAttributes),
    /// Read from disk at each use.
    OnDisk(Arc<dyn Disk>, Layout),
}

impl KeptScan {
    /// Opens a scan. If it has at most `max_points` points, they are read into memory.
    ///
    /// # Errors
    ///
    /// Fails if the scan is damaged or a read fails.
    pub(crate) fn open(
        disk: &Arc<dyn Disk>,
        layout: &Layout,
        record: KeptRecord,
        max_points: u64,
    ) -> Result<Self> {
        let world_from_sensor = match record.frame {
            KeptFrame::Sensor(pose) => Some(pose_of_numbers(&pose)),
            KeptFrame::World(_) => None,
        };
        let points = Points::OnDisk(disk.clone(), layout.clone());
        let moving = read_marks(&**disk, layout, &record)?.map(Arc::new);
        let mut scan = Self { record, world_from_sensor, points, moving };
        if scan.record.points <= max_points {
            let (mut points, mut intensities, mut all) = (Vec::new(), Vec::new(), PointAttributes::default());
            let range = 0..scan.len();
            scan.for_each_block(range, &mut |some, of_some, attributes| {
                points.extend_from_slice(some);
                intensities.extend_from_slice(of_some.unwrap_or_default());
                all.extend(attributes);
                true
            })?;
            scan.points = Points::InMemory(points, intensities, all);
        }
        Ok(scan)
    }

    /// Scan number in the map, from 1.
    pub fn number(&self) -> u64 {
        self.record.number
    }

    /// Ray settings that the scan was inserted with.
    pub fn rays(&self) -> &RayConfig {
        &self.record.rays
    }

    /// Record of the scan in the catalog, without its points.
    pub fn record(&self) -> &KeptRecord {
        &self.record
    }

    /// Returns the same scan with another pose, and another motion if that has one.
    #[must_use]
    pub fn with_pose(mut self, new: impl Into<NewPose>) -> Self {
        let new = new.into();
        self.world_from_sensor = Some(new.world_from_sensor);
        new.put_in(&mut self.record);
        self
    }

    /// Returns the same scan with other marks of moving points.
    #[must_use]
    pub(crate) fn with_moving(mut self, moving: MovingMarks) -> Self {
        self.moving = (moving.marked() > 0).then(|| Arc::new(moving));
        self
    }
}

impl ScanPoints for KeptScan {
    fn origin(&self) -> Point {
        self.record.origin_m()
    }

    fn stamp_ns(&self) -> Option<i64> {
        self.record.stamp_ns
    }

    fn len(&self) -> usize {
        usize::try_from(self.record.points).unwrap_or(usize::MAX)
    }

    fn has_intensities(&self) -> bool {
        self.record.has_intensities
    }

    fn moving(&self) -> Option<&MovingMarks> {
        self.moving.as_deref()
    }

    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.for_each_attributed_chunk(range, PointFrame::World, &mut |points, intensities, _| {
            take(points, intensities)
        })
    }

    fn world_from_sensor(&self) -> Option<Pose> {
        self.world_from_sensor
    }

    fn for_each_own_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.for_each_attributed_chunk(range, PointFrame::Own, &mut |points, intensities, _| {
            take(points, intensities)
        })
    }

    fn attributes(&self) -> AttributeSet {
        let KeptRecord { has_colours: colours, has_classes: classes, .. } = self.record;
        AttributeSet { colours, classes, times: self.record.sweep.is_some() }
    }

    fn for_each_attributed_chunk(
        &self,
        range: Range<usize>,
        frame: PointFrame,
        take: &mut TakeAttributed<'_>,
    ) -> Result<()> {
        let to_world =
            self.world_from_sensor.filter(|_| frame == PointFrame::World).map(|pose| pose.to_world());
        let sweep = self.sweep().filter(|_| frame != PointFrame::Raw);
        if to_world.is_none() && sweep.is_none() {
            return self.for_each_block(range, take);
        }
        let mut moved = Vec::new();
        self.for_each_block(range, &mut |points, intensities, attributes| {
            match sweep {
                Some(sweep) => sweep.move_all(points, attributes.times_ns, &mut moved),
                None => {
                    moved.clear();
                    moved.extend_from_slice(points);
                }
            }
            if let Some(to_world) = &to_world {
                moved.iter_mut().for_each(|point| *point = to_world(*point));
            }
            take(&moved, intensities, attributes)
        })
    }

    fn sweep(&self) -> Option<&Sweep> {
        self.record.sweep.as_deref()
    }

    fn body_from_sensor(&self) -> Option<[f64; 7]> {
        self.record.body_from_sensor
    }
}

impl KeptScan {
    fn for_each_block(&self, range: Range<usize>, take: &mut TakeAttributed<'_>) -> Result<()> {
        let has_intensities = self.record.has_intensities;
        let (disk, layout) = match &self.points {
            Points::OnDisk(disk, layout) => (disk, layout),
            Points::InMemory(points, intensities, attributes) => {
                let of = |range: Range<usize>| {
                    let intensities = intensities.get(range.clone()).filter(|_| has_intensities);
                    points.get(range).map(|points| (points, intensities))
                };
                if let Some((points, intensities)) = of(range.clone()) {
                    take(points, intensities, attributes.part(range));
                }
                return Ok(());
            }
        };
        let mut input = PointReader::open(&**disk, layout, self.record.place)?;
        let (mut points, mut intensities, mut attributes) = Default::default();
        let mut first = 0;
        while first < range.end && input.next(&mut points, &mut intensities, &mut attributes)? {
            input.check_attributes(intensities.len(), attributes.set(), &self.record)?;
            let end = first + points.len();
            let wanted = range.start.max(first)..range.end.min(end);
            if wanted.start < wanted.end {
                let some = wanted.start - first..wanted.end - first;
                let of_some = has_intensities.then(|| &intensities[some.clone()]);
                if !take(&points[some.clone()], of_some, attributes.part(some)) {
                    return Ok(());
                }
            }
            first = end;
        }
        if range.end == self.len() { input.check_count(first as u64, &self.record) } else { Ok(()) }
    }
}

/// Returns a pose as the catalog stores it: position in metres, then quaternion x, y, z, w.
pub(crate) fn pose_numbers(pose: &Pose) -> [f64; 7] {
    let ([x, y, z], [qx, qy, qz, qw]) = (pose.position_m(), pose.quaternion());
    [x, y, z, qx, qy, qz, qw]
}

/// Returns the pose of a [`KeptFrame::Sensor`], bit for bit, without normalising the quaternion again.
pub(super) fn pose_of_numbers(&[x, y, z, qx, qy, qz, qw]: &[f64; 7]) -> Pose {
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
    Pose::from(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

use super::coordinate::Coordinate;
use super::coordinate::sealed::PointSlice;
use super::trace::check_count;
use super::{
    AttributeSet, MovingMarks, PointAttributes, PointFrame, Pose, ScanPoints, Sweep, TakeAttributed,
    TakePoints,
};
use crate::error::{Error, Result};
use crate::space::Point;
use std::ops::Range;

/// Scan with borrowed points: slices of `[f32; 3]` or `[f64; 3]` in metres, in the sensor frame or the world frame.
///
/// Creating one copies nothing. `f64` points in the world frame are used in place; others are converted in chunks while
/// they are traced. The map is bit-identical to that of a [`Scan`](super::Scan).
///
/// ```
/// use voxtile::{InMemoryMapper, MapConfig, Mapper, Pose, Queries, ScanRef};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut mapper = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
///
/// // As returned by a driver; (0, 0, 0) is a ray without return.
/// let points: Vec<[f32; 3]> = vec![[4.25, 1.05, -1.45], [0.0; 3]];
/// let intensities = [17.0, 0.0];
/// let pose = Pose::from_quaternion([0.0, 0.0, 1.8], [0.0, 0.0, 0.0, 1.0])?;
/// let report = mapper.insert_points(&ScanRef::in_sensor(pose, &points).with_intensities(&intensities)?)?;
/// assert_eq!((report.points, report.skipped.no_return), (2, 1));
/// assert!(mapper.occupancy_at([4.25, 1.05, 0.35])?.is_occupied());
///
/// // In the world frame.
/// let points = [[6.05, 2.05, 0.35], [6.05, 2.15, 0.35]];
/// mapper.insert_points(&ScanRef::in_world([0.0, 0.0, 1.8], &points))?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ScanRef<'a> {
    frame: Frame,
    points: PointSlice<'a>,
    /// One per point.
    intensities: Option<&'a [f32]>,
    attributes: Option<&'a PointAttributes>,
    moving: Option<&'a MovingMarks>,
    sweep: Option<&'a Sweep>,
    stamp_ns: Option<i64>,
}

#[derive(Clone, Copy, Debug)]
enum Frame {
    /// World frame, with the position of the sensor.
    World(Point),
    Sensor(Pose),
}

/// Number of points that are converted at a time (6 MiB). Beam coherence works within one chunk, which should be a
/// whole scan of most sensors.
const POINTS_AT_A_TIME: usize = 1 << 18;

impl<'a> ScanRef<'a> {
    /// Creates a scan from points in the world frame, seen from `origin`. A point equal to the origin means "no return"
    /// and is skipped.
    pub fn in_world<C: Coordinate>(origin: Point, points: &'a [[C; 3]]) -> Self {
        Self::new(Frame::World(origin), C::slice(points))
    }

    /// Creates a scan from points in the sensor frame and the pose of the sensor. The exact point (0, 0, 0) means "no
    /// return" and is skipped.
    pub fn in_sensor<C: Coordinate>(world_from_sensor: impl Into<Pose>, points: &'a [[C; 3]]) -> Self {
        Self::new(Frame::Sensor(world_from_sensor.into()), C::slice(points))
    }

    fn new(frame: Frame, points: PointSlice<'a>) -> Self {
        Self { frame, points, intensities: None, attributes: None, moving: None, sweep: None, stamp_ns: None }
    }

    /// Adds an intensity per point.
    ///
    /// # Errors
    ///
    /// Fails if the number of intensities differs from that of the points.
    pub fn with_intensities(self, intensities: &'a [f32]) -> Result<Self> {
        check_count(self.len(), intensities)?;
        Ok(Self { intensities: Some(intensities), ..self })
    }

    /// Adds colours or classes, for the layers of a map.
    ///
    /// # Errors
    ///
    /// Fails if the number of entries differs from that of the points.
    pub fn with_attributes(self, attributes: &'a PointAttributes) -> Result<Self> {
        attributes.check_count(self.len())?;
        Ok(Self { attributes: Some(attributes), ..self })
    }

    /// Marks the points that hit something that was moving: they are no hits, but their rays pass free voxels.
    ///
    /// # Errors
    ///
    /// Fails if the number of marks differs from that of the points.
    pub fn with_moving(self, moving: &'a MovingMarks) -> Result<Self> {
        if moving.points() != self.len() as u64 {
            let reason = format!("{} for {} points; one per point is needed", moving.points(), self.len());
            return Err(Error::argument("moving", reason));
        }
        Ok(Self { moving: Some(moving), ..self })
    }

    /// Adds the motion of the sensor during the scan: points are in the sensor frame at their own times, which are among
    /// the attributes, and are moved to the sensor frame at the stamp when they are mapped (deskewing).
    ///
    /// # Errors
    ///
    /// Points in the world frame, or without times.
    pub fn with_sweep(self, sweep: &'a Sweep) -> Result<Self> {
        let reason = match (self.frame, self.attributes.is_some_and(|attributes| attributes.set().times)) {
            (Frame::World(_), _) => "points in the world frame are already motion-compensated",
            (Frame::Sensor(_), false) if !self.is_empty() => {
                "the points have no times; add them as attributes"
            }
            _ => return Ok(Self { sweep: Some(sweep), ..self }),
        };
        Err(Error::argument("sweep", reason))
    }

    /// Adds the acquisition time, in nanoseconds since the epoch of its source.
    #[must_use]
    pub fn with_stamp_ns(self, stamp_ns: i64) -> Self {
        Self { stamp_ns: Some(stamp_ns), ..self }
    }
}

impl ScanPoints for ScanRef<'_> {
    fn origin(&self) -> Point {
        match &self.frame {
            Frame::World(origin) => *origin,
            Frame::Sensor(pose) => pose.position_m(),
        }
    }

    fn stamp_ns(&self) -> Option<i64> {
        self.stamp_ns
    }

    fn len(&self) -> usize {
        match self.points {
            PointSlice::F32(points) => points.len(),
            PointSlice::F64(points) => points.len(),
        }
    }

    fn has_intensities(&self) -> bool {
        self.intensities.is_some()
    }

    fn moving(&self) -> Option<&MovingMarks> {
        self.moving
    }

    fn attributes(&self) -> AttributeSet {
        self.attributes.map_or(AttributeSet::NONE, PointAttributes::set)
    }

    fn for_each_attributed_chunk(
        &self,
        range: Range<usize>,
        frame: PointFrame,
        take: &mut TakeAttributed<'_>,
    ) -> Result<()> {
        let mut first = range.start;
        let still = Self { sweep: None, ..*self };
        let Some(sweep) = self.sweep.filter(|_| frame != PointFrame::Raw) else {
            return still.for_each_chunk_in(frame, range, &mut |points, intensities| {
                let of_chunk = first..first + points.len();
                first = of_chunk.end;
                let attributes = self.attributes.map(|attributes| attributes.part(of_chunk));
                take(points, intensities, attributes.unwrap_or_default())
            });
        };
        let to_world =
            self.world_from_sensor().filter(|_| frame == PointFrame::World).map(|pose| pose.to_world());
        let mut moved = Vec::new();
        still.for_each_attributed_chunk(range, PointFrame::Raw, &mut |points, intensities, attributes| {
            sweep.move_all(points, attributes.times_ns, &mut moved);
            if let Some(to_world) = &to_world {
                moved.iter_mut().for_each(|point| *point = to_world(*point));
            }
            take(&moved, intensities, attributes)
        })
    }

    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        if self.sweep.is_some() {
            return self.for_each_attributed_chunk(
                range,
                PointFrame::World,
                &mut |points, intensities, _| take(points, intensities),
            );
        }
        let intensities = self.intensities.map(|all| part(all, &range)).transpose()?;
        match (self.points, &self.frame) {
            (PointSlice::F64(points), Frame::World(_)) => {
                take(part(points, &range)?, intensities);
            }
            (PointSlice::F64(points), Frame::Sensor(pose)) => {
                convert(part(points, &range)?, intensities, pose.to_world(), take);
            }
            (PointSlice::F32(points), Frame::World(_)) => {
                convert(part(points, &range)?, intensities, widened, take);
            }
            (PointSlice::F32(points), Frame::Sensor(pose)) => {
                let to_world = pose.to_world();
                convert(part(points, &range)?, intensities, |point| to_world(widened(point)), take);
            }
        }
        Ok(())
    }

    fn world_from_sensor(&self) -> Option<Pose> {
        match self.frame {
            Frame::World(_) => None,
            Frame::Sensor(pose) => Some(pose),
        }
    }

    fn sweep(&self) -> Option<&Sweep> {
        self.sweep
    }

    fn for_each_own_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        if self.sweep.is_some() {
            return self.for_each_attributed_chunk(range, PointFrame::Own, &mut |points, intensities, _| {
                take(points, intensities)
            });
        }
        let intensities = self.intensities.map(|all| part(all, &range)).transpose()?;
        match self.points {
            PointSlice::F64(points) => {
                take(part(points, &range)?, intensities);
            }
            PointSlice::F32(points) => convert(part(points, &range)?, intensities, widened, take),
        }
        Ok(())
    }

    fn in_memory(&self) -> Option<&[Point]> {
        match (self.points, &self.frame) {
            (PointSlice::F64(points), Frame::World(_)) => Some(points),
            _ => None,
        }
    }
}

fn widened(point: [f32; 3]) -> Point {
    point.map(f64::from)
}

/// Passes points in the world frame, in chunks.
fn convert<P: Copy>(
    points: &[P],
    intensities: Option<&[f32]>,
    to_world: impl Fn(P) -> Point,
    take: &mut TakePoints<'_>,
) {
    let mut in_world = Vec::with_capacity(points.len().min(POINTS_AT_A_TIME));
    for (number, chunk) in points.chunks(POINTS_AT_A_TIME).enumerate() {
        in_world.clear();
        in_world.extend(chunk.iter().map(|&point| to_world(point)));
        let first = number * POINTS_AT_A_TIME;
        if !take(&in_world, intensities.map(|all| &all[first..first + chunk.len()])) {
            return;
        }
    }
}

fn part<'s, T>(all: &'s [T], range: &Range<usize>) -> Result<&'s [T]> {
    let part = all.get(range.clone());
    part.ok_or_else(|| {
        Error::argument("points", format!("the range {range:?} exceeds the {} points", all.len()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_passed_in_chunks_with_their_intensities() {
        let count = POINTS_AT_A_TIME + 77;
        let points: Vec<[f32; 3]> = (0..count).map(|k| [k as f32, 0.5, -1.5]).collect();
        let intensities: Vec<f32> = (0..count).map(|k| k as f32).collect();
        let scan = ScanRef::in_world([0.0; 3], &points).with_intensities(&intensities).unwrap();
        for range in [0..count, 5..6, 7..7, POINTS_AT_A_TIME - 1..count, 0..POINTS_AT_A_TIME] {
            let mut next = range.start;
            let mut take = |points: &[Point], intensities: Option<&[f32]>| {
                assert_eq!(intensities.map(<[f32]>::len), Some(points.len()));
                for (point, &intensity) in points.iter().zip(intensities.unwrap()) {
                    assert!(*point == [next as f64, 0.5, -1.5] && intensity == next as f32);
                    next += 1;
                }
                true
            };
            scan.for_each_chunk(range.clone(), &mut take).unwrap();
            assert_eq!(next, range.end);
        }
        let mut chunks = 0;
        let mut stop_at_once = |_: &[Point], _: Option<&[f32]>| {
            chunks += 1;
            false
        };
        scan.for_each_chunk(0..count, &mut stop_at_once).unwrap();
        assert_eq!(chunks, 1);
        let error = scan.for_each_chunk(0..count + 1, &mut |_, _| true).unwrap_err().to_string();
        assert!(error.starts_with("points: "), "{error}");
    }
}

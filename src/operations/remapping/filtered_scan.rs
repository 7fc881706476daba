use crate::error::Result;
use crate::mapper::KeptScan;
use crate::scan::{
    AttributeSet, ChunkMarks, MovingMarks, MovingMarksBuilder, PointAttributes, PointFrame, Pose, ScanPoints,
    Sweep, TakeAttributed, TakePoints,
};
use crate::space::{Aabb, Point};
use std::ops::Range;

/// View of the points of a kept scan that are inside or outside a box. Points are filtered at each read.
pub(super) struct FilteredScan<'a> {
    scan: &'a KeptScan,
    region: Aabb,
    is_inside: bool,
    points: usize,
    moving: Option<MovingMarks>,
}

impl<'a> FilteredScan<'a> {
    pub(super) fn new(scan: &'a KeptScan, region: Aabb, is_inside: bool) -> Result<Self> {
        let mut filtered = Self { scan, region, is_inside, points: 0, moving: None };
        let (mut points, mut marks) = (0, ChunkMarks::from(scan.moving(), 0));
        let mut moving = MovingMarksBuilder::default();
        scan.for_each_chunk(0..scan.len(), &mut |some, _| {
            let is_moving = marks.next(some.len());
            for (number, point) in some.iter().enumerate() {
                if filtered.takes(point) {
                    points += 1;
                    moving.push(is_moving.get(number).is_some_and(|is_moving| *is_moving));
                }
            }
            true
        })?;
        filtered.points = points;
        filtered.moving = scan.moving().map(|_| moving.finish());
        Ok(filtered)
    }

    fn takes(&self, in_world: &Point) -> bool {
        let Aabb { min, max } = &self.region;
        (0..3).all(|axis| min[axis] <= in_world[axis] && in_world[axis] < max[axis]) == self.is_inside
    }

    fn pick(&self, range: Range<usize>, frame: PointFrame, take: &mut TakeAttributed<'_>) -> Result<()> {
        let to_world = self.to_world();
        let (mut number, mut goes_on) = (0, true);
        let (mut points, mut picked, mut of_picked) = (Vec::new(), Vec::new(), PointAttributes::default());
        let (all, mut at_stamp) = (0..self.scan.len(), Vec::new());
        self.scan.for_each_attributed_chunk(all, PointFrame::Raw, &mut |some, intensities, attributes| {
            points.clear();
            picked.clear();
            of_picked.clear();
            let own = match self.scan.sweep() {
                Some(sweep) => {
                    sweep.move_all(some, attributes.times_ns, &mut at_stamp);
                    &at_stamp
                }
                None => some,
            };
            for (at, (&raw, &own)) in some.iter().zip(own).enumerate() {
                let in_world = to_world(own);
                if self.takes(&in_world) {
                    if range.contains(&number) {
                        points.push(match frame {
                            PointFrame::World => in_world,
                            PointFrame::Own => own,
                            PointFrame::Raw => raw,
                        });
                        of_picked.extend(attributes.part(at..at + 1));
                        picked.extend(intensities.map(|intensities| intensities[at]));
                    }
                    number += 1;
                }
            }
            if !points.is_empty() {
                goes_on = take(&points, intensities.map(|_| &*picked), of_picked.all());
            }
            goes_on && number < range.end
        })
    }

    fn to_world(&self) -> impl Fn(Point) -> Point {
        let to_world = self.scan.world_from_sensor().map(|pose| pose.to_world());
        move |point| to_world.map_or(point, |to_world| to_world(point))
    }
}

impl ScanPoints for FilteredScan<'_> {
    fn origin(&self) -> Point {
        self.scan.origin()
    }

    fn stamp_ns(&self) -> Option<i64> {
        self.scan.stamp_ns()
    }

    fn len(&self) -> usize {
        self.points
    }

    fn has_intensities(&self) -> bool {
        self.scan.has_intensities()
    }

    fn moving(&self) -> Option<&MovingMarks> {
        self.moving.as_ref()
    }

    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.pick(range, PointFrame::World, &mut |points, intensities, _| take(points, intensities))
    }

    fn world_from_sensor(&self) -> Option<Pose> {
        self.scan.world_from_sensor()
    }

    fn for_each_own_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.pick(range, PointFrame::Own, &mut |points, intensities, _| take(points, intensities))
    }

    fn attributes(&self) -> AttributeSet {
        self.scan.attributes()
    }

    fn sweep(&self) -> Option<&Sweep> {
        self.scan.sweep()
    }

    fn body_from_sensor(&self) -> Option<[f64; 7]> {
        self.scan.body_from_sensor()
    }

    fn for_each_attributed_chunk(
        &self,
        range: Range<usize>,
        frame: PointFrame,
        take: &mut TakeAttributed<'_>,
    ) -> Result<()> {
        self.pick(range, frame, take)
    }
}

use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::scan::{AttributeSet, MovingMarks, NO_TIME, PointAttributes, Sweep, TakeAttributed, TakePoints};
use voxtile::space::Point;
use voxtile::{Error, Result};
use voxtile_scratch::{ScratchFile, Window};

/// Points of one scan in the sensor frame, in metres: in memory up to a limit, the others in a temporary file. If they
/// have times, each is in the sensor frame at its own time.
///
/// The file has no name and is freed when the store is dropped.
#[derive(Debug)]
pub struct PointStore {
    /// The last points, or all of them if there is no file.
    points: Vec<Point>,
    intensities: Option<Vec<f32>>,
    attributes: Box<StoredAttributes>,
    /// Number of points in the file, which precede those in memory.
    filed: usize,
    file: Option<ScratchFile>,
    budget: PointBudget,
    /// Marks of moving points, if the source has any.
    moving: Option<Box<MovingMarks>>,
}

/// Attributes of the points in memory. They are in a box, because most scans have none.
#[derive(Debug)]
struct StoredAttributes {
    set: AttributeSet,
    /// Lists that the scan does not have are empty.
    lists: PointAttributes,
    /// Maximum number of points in memory, from the budget and the size of a point with its attributes.
    max_points: usize,
    /// Motion of the sensor, if points have times.
    sweep: Option<Arc<Sweep>>,
    /// Pose of the sensor in the body frame, if it is known and another frame.
    body_from_sensor: Option<[f64; 7]>,
}

/// Memory limit for the points of a scan, and the folder for the others.
#[derive(Clone, Debug)]
pub struct PointBudget {
    max_bytes: usize,
    folder: PathBuf,
}

/// Size of a point in the file without attributes: the point and its intensity (0 if there is none), in native byte
/// order, because no other process reads the file.
const RECORD_BYTES: usize = size_of::<Point>() + size_of::<f32>();
/// Size of a colour in the file: whether there is one, red, green and blue.
const COLOUR_BYTES: usize = 4;
/// Size of the time in the file, in nanoseconds. It follows the intensity.
const TIME_BYTES: usize = size_of::<i64>();
/// Size of a class in the file: whether there is one, and the class. It is last.
const CLASS_BYTES: usize = 2;
/// Number of points to read at once.
const POINTS_AT_A_TIME: usize = 1 << 14;
/// Number of points in memory to pass at once. The receiver copies them into the world frame (6 MiB), and beam
/// coherence works within one chunk, which should be a whole scan for most sensors.
const POINTS_PER_CHUNK: usize = 1 << 18;

impl Default for PointStore {
    /// All points stay in memory.
    fn default() -> Self {
        Self::new(PointBudget::default())
    }
}

impl Default for PointBudget {
    fn default() -> Self {
        Self { max_bytes: usize::MAX, folder: PathBuf::new() }
    }
}

impl PointBudget {
    /// Creates a limit in bytes. Further points go to a file in `folder`.
    pub fn new(max_bytes: usize, folder: &Path) -> Self {
        Self { max_bytes, folder: folder.to_owned() }
    }

    /// Returns the number of points in memory at most.
    fn max_points(&self, record_bytes: usize) -> usize {
        (self.max_bytes / record_bytes).max(POINTS_AT_A_TIME)
    }

    /// Creates an unnamed temporary file.
    fn file(&self) -> Result<ScratchFile> {
        ScratchFile::in_folder(&self.folder).map_err(|error| {
            Error::io(&self.folder, "store the points of a scan in a temporary file in", error)
        })
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }
}

impl PointStore {
    /// Creates an empty store.
    pub fn new(budget: PointBudget) -> Self {
        let (set, lists, sweep, body_from_sensor) = Default::default();
        let max_points = budget.max_points(RECORD_BYTES);
        let attributes = StoredAttributes { set, lists, max_points, sweep, body_from_sensor };
        let (points, intensities, filed, file, moving) = Default::default();
        Self { points, intensities, attributes: Box::new(attributes), filed, file, budget, moving }
    }

    /// Removes all points and sets whether the next ones have intensities. They have no attributes.
    pub fn begin(&mut self, has_intensities: bool) {
        self.begin_with(has_intensities, AttributeSet::NONE);
    }

    /// Removes all points and sets whether the next ones have intensities, and which attributes they have.
    pub fn begin_with(&mut self, has_intensities: bool, attributes: AttributeSet) {
        self.points.clear();
        self.intensities = has_intensities.then(Vec::new);
        self.attributes.lists.clear();
        self.attributes.set = attributes;
        self.attributes.max_points = self.budget.max_points(self.record_bytes());
        (self.attributes.sweep, self.attributes.body_from_sensor) = (None, None);
        (self.filed, self.file, self.moving) = (0, None, None);
    }

    /// Sets the marks of all points, after the last point.
    pub fn set_moving(&mut self, moving: Option<MovingMarks>) {
        self.moving = moving.map(Box::new);
    }

    /// Returns the marks of the points that hit something that was moving, if the source has any.
    pub fn moving(&self) -> Option<&MovingMarks> {
        self.moving.as_deref()
    }

    /// Sets the motion of the sensor, after the last point, for points with times.
    pub fn set_sweep(&mut self, sweep: Option<Arc<Sweep>>) {
        self.attributes.sweep = sweep;
    }

    /// Sets the pose of the sensor in the body frame that the trajectory describes, if it is another frame: position in
    /// metres, then quaternion x, y, z, w.
    pub fn set_body_from_sensor(&mut self, body_from_sensor: Option<[f64; 7]>) {
        self.attributes.body_from_sensor = body_from_sensor;
    }

    /// Returns the pose of the sensor in the body frame, if it is known and another frame.
    pub fn body_from_sensor(&self) -> Option<[f64; 7]> {
        self.attributes.body_from_sensor
    }

    /// Returns the motion of the sensor, if points have times.
    pub fn sweep(&self) -> Option<&Arc<Sweep>> {
        self.attributes.sweep.as_ref()
    }

    pub(crate) fn budget(&self) -> &PointBudget {
        &self.budget
    }

    /// Reserves memory for points, up to the limit.
    pub(crate) fn reserve(&mut self, points: usize) {
        let points = points.min(self.attributes.max_points);
        self.points.reserve_exact(points);
        if let Some(intensities) = &mut self.intensities {
            intensities.reserve_exact(points);
        }
    }

    /// Adds a point without attributes. The intensity is ignored if the scan has none.
    ///
    /// # Errors
    ///
    /// A file cannot be written.
    #[inline]
    pub fn push(&mut self, point: Point, intensity: f32) -> Result<()> {
        if !self.attributes.set.is_none() {
            return self.push_with(point, intensity, None, None, NO_TIME);
        }
        if self.points.len() == self.attributes.max_points {
            self.put_in_file()?;
        }
        self.points.push(point);
        if let Some(intensities) = &mut self.intensities {
            intensities.push(intensity);
        }
        Ok(())
    }

    /// Adds a point with its attributes. Values that the scan does not have are ignored.
    ///
    /// # Errors
    ///
    /// A file cannot be written.
    pub fn push_with(
        &mut self,
        point: Point,
        intensity: f32,
        colour: Option<[u8; 3]>,
        class: Option<u8>,
        time_ns: i64,
    ) -> Result<()> {
        if self.points.len() == self.attributes.max_points {
            self.put_in_file()?;
        }
        self.points.push(point);
        if let Some(intensities) = &mut self.intensities {
            intensities.push(intensity);
        }
        if self.attributes.set.colours {
            self.attributes.lists.colours.push(colour);
        }
        if self.attributes.set.classes {
            self.attributes.lists.classes.push(class);
        }
        if self.attributes.set.times {
            self.attributes.lists.times_ns.push(time_ns);
        }
        Ok(())
    }

    /// Adds points without attributes, with their intensities, which are ignored if the scan has none.
    ///
    /// # Errors
    ///
    /// A file cannot be written.
    pub(crate) fn extend(
        &mut self,
        mut points: impl ExactSizeIterator<Item = (Point, f32)> + Clone,
    ) -> Result<()> {
        let is_beyond = points.len() > self.attributes.max_points.saturating_sub(self.points.len());
        if is_beyond || !self.attributes.set.is_none() {
            return points.try_for_each(|(point, intensity)| self.push(point, intensity));
        }
        self.points.extend(points.clone().map(|(point, _)| point));
        if let Some(intensities) = &mut self.intensities {
            intensities.extend(points.map(|(_, intensity)| intensity));
        }
        Ok(())
    }

    #[cold]
    fn put_in_file(&mut self) -> Result<()> {
        let mut file = match self.file.take() {
            Some(file) => file,
            None => self.budget.file()?,
        };
        let cannot = |error| {
            Error::io(self.budget.folder(), "store the points of a scan in a temporary file in", error)
        };
        let mut bytes = Vec::with_capacity(POINTS_AT_A_TIME * self.record_bytes());
        for (chunk, points) in self.points.chunks(POINTS_AT_A_TIME).enumerate() {
            bytes.clear();
            for (number, point) in (chunk * POINTS_AT_A_TIME..).zip(points) {
                let intensity = self.intensities.as_ref().map_or(0.0, |intensities| intensities[number]);
                bytes.extend_from_slice(bytemuck::bytes_of(point));
                bytes.extend_from_slice(bytemuck::bytes_of(&intensity));
                if let Some(time_ns) = self.attributes.lists.times_ns.get(number) {
                    bytes.extend_from_slice(bytemuck::bytes_of(time_ns));
                }
                if let Some(colour) = self.attributes.lists.colours.get(number) {
                    let [red, green, blue] = colour.unwrap_or_default();
                    bytes.extend([u8::from(colour.is_some()), red, green, blue]);
                }
                if let Some(class) = self.attributes.lists.classes.get(number) {
                    bytes.extend([u8::from(class.is_some()), class.unwrap_or_default()]);
                }
            }
            file.append(&bytes).map_err(cannot)?;
        }
        self.filed += self.points.len();
        self.points.clear();
        if let Some(intensities) = &mut self.intensities {
            intensities.clear();
        }
        self.attributes.lists.clear();
        self.file = Some(file);
        Ok(())
    }

    /// Returns the size of a point in the file.
    fn record_bytes(&self) -> usize {
        let AttributeSet { colours, classes, times } = self.attributes.set;
        let sizes = [(colours, COLOUR_BYTES), (classes, CLASS_BYTES), (times, TIME_BYTES)];
        RECORD_BYTES + sizes.iter().map(|(is_there, bytes)| if *is_there { *bytes } else { 0 }).sum::<usize>()
    }

    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.filed + self.points.len()
    }

    /// Returns whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns whether every point has an intensity.
    pub fn has_intensities(&self) -> bool {
        self.intensities.is_some()
    }

    /// Returns which attributes the points have.
    pub fn attributes(&self) -> AttributeSet {
        self.attributes.set
    }

    /// Passes the points of a range to `take` in order, chunk by chunk, with their intensities if there are any. `take`
    /// returns whether to continue. Points with times are in the sensor frame at their own times.
    ///
    /// # Errors
    ///
    /// A file cannot be read.
    pub fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.for_each_attributed_chunk(range, &mut |points, intensities, _| take(points, intensities))
    }

    /// As [`PointStore::for_each_chunk`], with the points' attributes.
    ///
    /// # Errors
    ///
    /// A file cannot be read.
    pub fn for_each_attributed_chunk(
        &self,
        range: Range<usize>,
        take: &mut TakeAttributed<'_>,
    ) -> Result<()> {
        let in_file = range.start.min(self.filed)..range.end.min(self.filed);
        let in_memory = range.start.max(self.filed) - self.filed..range.end.max(self.filed) - self.filed;
        let mut next = in_file.start;
        let mut chunk = FileChunk::default();
        while next < in_file.end {
            let count = (in_file.end - next).min(POINTS_AT_A_TIME);
            chunk.decode(&self.window(next, count)?, self.record_bytes(), self.attributes.set);
            let intensities = self.has_intensities().then_some(&*chunk.intensities);
            if !take(&chunk.points, intensities, chunk.attributes.part(0..count)) {
                return Ok(());
            }
            next += count;
        }
        for first in in_memory.clone().step_by(POINTS_PER_CHUNK) {
            let some = first..in_memory.end.min(first + POINTS_PER_CHUNK);
            let intensities = self.intensities.as_ref().map(|intensities| &intensities[some.clone()]);
            if !take(&self.points[some.clone()], intensities, self.attributes.lists.part(some)) {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Maps a range of point records of the file.
    fn window(&self, first: usize, count: usize) -> Result<Window> {
        let record_bytes = self.record_bytes();
        let window = match &self.file {
            Some(file) => file.window((first * record_bytes) as u64, count * record_bytes),
            None => Err(io::ErrorKind::UnexpectedEof.into()),
        };
        window.map_err(|error| {
            Error::io(self.budget.folder(), "read the points of a scan from a temporary file in", error)
        })
    }

    /// Returns points in the sensor frame at the stamp, intensities and attributes without times, if all are in memory.
    pub(crate) fn into_parts(self) -> (Vec<Point>, Option<Vec<f32>>, PointAttributes) {
        let Self { mut points, intensities, attributes, .. } = self;
        let StoredAttributes { lists: mut attributes, sweep, .. } = *attributes;
        if let Some(sweep) = sweep {
            let mut to_stamp = sweep.to_stamp();
            for (point, time_ns) in points.iter_mut().zip(&attributes.times_ns) {
                *point = to_stamp.apply(*point, *time_ns);
            }
        }
        attributes.times_ns = Vec::new();
        (points, intensities, attributes)
    }
}

/// Points read from the file.
#[derive(Default)]
struct FileChunk {
    points: Vec<Point>,
    intensities: Vec<f32>,
    attributes: PointAttributes,
}

impl FileChunk {
    /// Replaces the content by the decoded records.
    fn decode(&mut self, bytes: &[u8], record_bytes: usize, set: AttributeSet) {
        self.points.clear();
        self.intensities.clear();
        self.attributes.clear();
        for record in bytes.chunks_exact(record_bytes) {
            let (point, rest) = record.split_at(size_of::<Point>());
            let (intensity, mut rest) = rest.split_at(size_of::<f32>());
            self.points.push(bytemuck::pod_read_unaligned::<Point>(point));
            self.intensities.push(bytemuck::pod_read_unaligned::<f32>(intensity));
            if let (true, Some((time_ns, others))) = (set.times, rest.split_first_chunk()) {
                self.attributes.times_ns.push(i64::from_ne_bytes(*time_ns));
                rest = others;
            }
            if let (true, [is_there, red, green, blue, class @ ..]) = (set.colours, rest) {
                self.attributes.colours.push((*is_there != 0).then_some([*red, *green, *blue]));
                rest = class;
            }
            if let (true, [is_there, class]) = (set.classes, rest) {
                self.attributes.classes.push((*is_there != 0).then_some(*class));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::scan::AttributeSlices;

    #[test]
    fn points_from_file_and_memory_are_in_order() {
        let folder = tempfile::TempDir::new().unwrap();
        // More points than are passed at once, in memory and in the file.
        let count = POINTS_PER_CHUNK + 3 * POINTS_AT_A_TIME + 77;
        for (max_bytes, has_intensities) in [(0, true), (1 << 20, false), (usize::MAX, true)] {
            let mut store = PointStore::new(PointBudget::new(max_bytes, folder.path()));
            store.begin(has_intensities);
            let point = |k: usize| ([k as f64, -0.5 * k as f64, f64::NAN], k as f32);
            for first in (0..count).step_by(1000) {
                match first % 3000 {
                    0 => store.extend((first..count.min(first + 1000)).map(point)).unwrap(),
                    _ => (first..count.min(first + 1000))
                        .map(point)
                        .for_each(|(point, intensity)| store.push(point, intensity).unwrap()),
                }
                assert!(store.points.len() <= store.attributes.max_points);
            }
            assert_eq!((store.len(), store.file.is_some()), (count, max_bytes < usize::MAX));
            for range in
                [0..count, 5..6, 100..count - 3, POINTS_AT_A_TIME - 1..2 * POINTS_AT_A_TIME + 1, 7..7]
            {
                let mut next = range.start;
                let mut take = |points: &[Point], intensities: Option<&[f32]>| {
                    assert!(points.len() <= POINTS_PER_CHUNK);
                    assert_eq!(intensities.is_some(), has_intensities);
                    for (at, point) in points.iter().enumerate() {
                        assert!(
                            point[0] == next as f64 && point[1] == -0.5 * next as f64 && point[2].is_nan()
                        );
                        assert!(intensities.is_none_or(|intensities| intensities[at] == next as f32));
                        next += 1;
                    }
                    true
                };
                store.for_each_chunk(range.clone(), &mut take).unwrap();
                assert_eq!(next, range.end);
            }
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn attributes_are_equal_from_file_and_memory() {
        let folder = tempfile::TempDir::new().unwrap();
        let count = 3 * POINTS_AT_A_TIME + 77;
        let colour = |k: usize| (!k.is_multiple_of(3)).then_some([k as u8, (k / 7) as u8, (k / 256) as u8]);
        let class = |k: usize| (!k.is_multiple_of(5)).then_some((k % 251) as u8);
        let time = |k: usize| if k.is_multiple_of(7) { NO_TIME } else { 55_296 * k as i64 - 1_000_000 };
        for case in 0..8 {
            let [colours, classes, times] = [1, 2, 4].map(|bit| case & bit != 0);
            let set = AttributeSet { colours, classes, times };
            for max_bytes in [0, 1 << 20, usize::MAX] {
                let mut store = PointStore::new(PointBudget::new(max_bytes, folder.path()));
                store.begin(true);
                store.push([1.0; 3], 1.0).unwrap();
                store.begin_with(true, set);
                for k in 0..count {
                    store.push_with([k as f64; 3], k as f32, colour(k), class(k), time(k)).unwrap();
                }
                assert_eq!((store.len(), store.attributes()), (count, set));
                assert_eq!(store.file.is_some(), max_bytes < usize::MAX);
                assert!(store.record_bytes() <= RECORD_BYTES + 14);
                for range in [0..count, POINTS_AT_A_TIME - 1..2 * POINTS_AT_A_TIME + 1, count - 1..count] {
                    let mut next = range.start;
                    let mut take = |points: &[Point], _: Option<&[f32]>, attributes: AttributeSlices<'_>| {
                        for (at, point) in points.iter().enumerate() {
                            assert_eq!(point[0], next as f64);
                            assert_eq!(attributes.colour(at), colour(next).filter(|_| colours));
                            assert_eq!(attributes.class(at), class(next).filter(|_| classes));
                            assert_eq!(attributes.time_ns(at), if times { time(next) } else { NO_TIME });
                            next += 1;
                        }
                        assert!(attributes.colours.len() == points.len() || !colours);
                        assert!(attributes.classes.len() == points.len() || !classes);
                        true
                    };
                    store.for_each_attributed_chunk(range.clone(), &mut take).unwrap();
                    assert_eq!(next, range.end);
                }
            }
        }
    }
}

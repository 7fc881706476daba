use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use voxtile::scan::{MovingMarks, TakePoints};
use voxtile::space::Point;
use voxtile::{Error, Result};
use voxtile_scratch::{ScratchFile, Window};

/// Points of one scan in the sensor frame, in metres: in memory up to a limit, the others in a temporary file.
///
/// The file has no name and is freed when the store is dropped.
#[derive(Debug, Default)]
pub struct PointStore {
    /// The last points, or all of them if there is no file.
    points: Vec<Point>,
    intensities: Option<Vec<f32>>,
    /// Number of points in the file, which precede those in memory.
    filed: usize,
    file: Option<ScratchFile>,
    budget: PointBudget,
    /// Marks of moving points, if the source has any.
    moving: Option<Box<MovingMarks>>,
}

/// Memory limit for the points of a scan, and the folder for the others.
#[derive(Clone, Debug)]
pub struct PointBudget {
    max_points: usize,
    folder: PathBuf,
}

/// Size of a point in the file: the point and its intensity (0 if there is none), in native byte order, because no
/// other process reads the file.
const RECORD_BYTES: usize = size_of::<Point>() + size_of::<f32>();
/// Number of points to read at once.
const POINTS_AT_A_TIME: usize = 1 << 14;
/// Number of points in memory to pass at once. The receiver copies them into the world frame (6 MiB), and beam
/// coherence works within one chunk, which should be a whole scan for most sensors.
const POINTS_PER_CHUNK: usize = 1 << 18;

impl Default for PointBudget {
    fn default() -> Self {
        Self { max_points: usize::MAX, folder: PathBuf::new() }
    }
}

impl PointBudget {
    /// Creates a limit in bytes. Further points go to a file in `folder`.
    pub fn new(max_bytes: usize, folder: &Path) -> Self {
        Self { max_points: (max_bytes / RECORD_BYTES).max(POINTS_AT_A_TIME), folder: folder.to_owned() }
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
        Self { budget, ..Self::default() }
    }

    /// Removes all points and sets whether the next ones have intensities.
    pub fn begin(&mut self, has_intensities: bool) {
        self.points.clear();
        self.intensities = has_intensities.then(Vec::new);
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

    pub(crate) fn budget(&self) -> &PointBudget {
        &self.budget
    }

    /// Reserves memory for points, up to the limit.
    pub(crate) fn reserve(&mut self, points: usize) {
        let points = points.min(self.budget.max_points);
        self.points.reserve_exact(points);
        if let Some(intensities) = &mut self.intensities {
            intensities.reserve_exact(points);
        }
    }

    /// Adds a point. The intensity is ignored if the scan has none.
    ///
    /// # Errors
    ///
    /// A file cannot be written.
    #[inline]
    pub fn push(&mut self, point: Point, intensity: f32) -> Result<()> {
        if self.points.len() == self.budget.max_points {
            self.put_in_file()?;
        }
        self.points.push(point);
        if let Some(intensities) = &mut self.intensities {
            intensities.push(intensity);
        }
        Ok(())
    }

    /// Adds points with their intensities, which are ignored if the scan has none.
    ///
    /// # Errors
    ///
    /// A file cannot be written.
    pub(crate) fn extend(
        &mut self,
        mut points: impl ExactSizeIterator<Item = (Point, f32)> + Clone,
    ) -> Result<()> {
        if points.len() > self.budget.max_points.saturating_sub(self.points.len()) {
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
        let mut bytes = Vec::with_capacity(POINTS_AT_A_TIME * RECORD_BYTES);
        for (chunk, points) in self.points.chunks(POINTS_AT_A_TIME).enumerate() {
            bytes.clear();
            for (number, point) in (chunk * POINTS_AT_A_TIME..).zip(points) {
                let intensity = self.intensities.as_ref().map_or(0.0, |intensities| intensities[number]);
                bytes.extend_from_slice(bytemuck::bytes_of(point));
                bytes.extend_from_slice(bytemuck::bytes_of(&intensity));
            }
            file.append(&bytes).map_err(cannot)?;
        }
        self.filed += self.points.len();
        self.points.clear();
        if let Some(intensities) = &mut self.intensities {
            intensities.clear();
        }
        self.file = Some(file);
        Ok(())
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

    /// Passes the points of a range to `take` in order, chunk by chunk, with their intensities if there are any. `take`
    /// returns whether to continue.
    ///
    /// # Errors
    ///
    /// A file cannot be read.
    pub fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        let in_file = range.start.min(self.filed)..range.end.min(self.filed);
        let in_memory = range.start.max(self.filed) - self.filed..range.end.max(self.filed) - self.filed;
        let mut next = in_file.start;
        let (mut points, mut intensities) = (Vec::new(), Vec::new());
        while next < in_file.end {
            let count = (in_file.end - next).min(POINTS_AT_A_TIME);
            let bytes = self.window(next, count)?;
            points.clear();
            intensities.clear();
            for record in bytes.chunks_exact(RECORD_BYTES) {
                let (point, intensity) = record.split_at(size_of::<Point>());
                points.push(bytemuck::pod_read_unaligned::<Point>(point));
                intensities.push(bytemuck::pod_read_unaligned::<f32>(intensity));
            }
            if !take(&points, self.has_intensities().then_some(&*intensities)) {
                return Ok(());
            }
            next += count;
        }
        for first in in_memory.clone().step_by(POINTS_PER_CHUNK) {
            let some = first..in_memory.end.min(first + POINTS_PER_CHUNK);
            let intensities = self.intensities.as_ref().map(|intensities| &intensities[some.clone()]);
            if !take(&self.points[some], intensities) {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Maps a range of point records of the file.
    fn window(&self, first: usize, count: usize) -> Result<Window> {
        let window = match &self.file {
            Some(file) => file.window((first * RECORD_BYTES) as u64, count * RECORD_BYTES),
            None => Err(io::ErrorKind::UnexpectedEof.into()),
        };
        window.map_err(|error| {
            Error::io(self.budget.folder(), "read the points of a scan from a temporary file in", error)
        })
    }

    /// Returns points and intensities, if all are in memory.
    pub(crate) fn into_parts(self) -> (Vec<Point>, Option<Vec<f32>>) {
        (self.points, self.intensities)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                assert!(store.points.len() <= store.budget.max_points);
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
}

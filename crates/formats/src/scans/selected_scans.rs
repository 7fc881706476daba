use super::point_store::{PointBudget, PointStore};
use super::source::{ScanHead, ScanSource};
use crate::poses::PoseSource;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use voxtile::Result;
use voxtile::scan::{MovingMarks, Pose};
use voxtile::space::Aabb;

/// Selection of scans and points of an input.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Selection {
    /// Number of scans to skip at the beginning.
    pub first: u64,
    /// Maximum number of scans to use. `None`: all.
    pub count: Option<u64>,
    /// Use every n-th of the remaining scans; 1 uses each.
    pub every: u64,
    /// Points in this box, including its boundary, are removed; for instance points on the vehicle itself.
    pub ignored: Option<Aabb>,
    /// Pose of the sensor in the body, if the box is in the body frame. `None`: the box is in the sensor frame.
    pub body_from_sensor: Option<Pose>,
    /// Coordinates are rounded to multiples of this step, in metres, which loses information. Kept scans then take less
    /// space.
    pub step_m: Option<f64>,
    /// Scans of earlier inputs; `None` if each input is selected from alone.
    so_far: Option<Arc<SoFar>>,
}

/// Number of scans of several inputs that were passed, and of those that were taken.
#[derive(Debug, Default)]
struct SoFar {
    passed: AtomicU64,
    taken: AtomicU64,
}

impl Default for Selection {
    fn default() -> Self {
        Self {
            first: 0,
            count: None,
            every: 1,
            ignored: None,
            body_from_sensor: None,
            step_m: None,
            so_far: None,
        }
    }
}

impl Selection {
    /// Returns whether all scans and points are selected, as they are.
    pub fn is_everything(&self) -> bool {
        self.first == 0 && self.count.is_none() && self.every <= 1 && !self.changes_points()
    }

    fn changes_points(&self) -> bool {
        self.ignored.is_some() || self.step_m.is_some()
    }

    /// Selects from the sequence of all sources to which clones of the result are applied, one source after the other.
    #[must_use]
    pub fn across_inputs(self) -> Self {
        Self { so_far: Some(Arc::default()), ..self }
    }

    /// Selects from one source alone.
    #[must_use]
    pub fn of_one_input(self) -> Self {
        Self { so_far: None, ..self }
    }

    /// Returns whether all scans that are wanted were taken from earlier inputs.
    pub fn is_complete(&self) -> bool {
        let taken = self.so_far.as_ref().map(|so_far| so_far.taken.load(Ordering::Relaxed));
        taken.zip(self.count).is_some_and(|(taken, count)| taken >= count)
    }

    /// Applies the selection to a source.
    pub fn of(self, source: Box<dyn ScanSource + Send>) -> Box<dyn ScanSource + Send> {
        if self.is_everything() {
            return source;
        }
        let of_earlier = |number: fn(&SoFar) -> &AtomicU64| {
            self.so_far.as_ref().map_or(0, |so_far| number(so_far).load(Ordering::Relaxed))
        };
        let earlier = [of_earlier(|so_far| &so_far.passed), of_earlier(|so_far| &so_far.taken)];
        Box::new(SelectedScans {
            source,
            passed: earlier[0],
            taken: earlier[1],
            earlier,
            selection: self,
            bad: 0,
            unfiltered: PointStore::default(),
        })
    }
}

/// Source of the selected scans, without the ignored points.
struct SelectedScans {
    source: Box<dyn ScanSource + Send>,
    selection: Selection,
    /// Number of scans of this source and those before it that were skipped or used.
    passed: u64,
    taken: u64,
    /// Values of `passed` and `taken` at the begin of this source.
    earlier: [u64; 2],
    /// Number of skipped scans that could not be read.
    bad: u64,
    unfiltered: PointStore,
}

impl SelectedScans {
    fn is_at_end(&self) -> bool {
        self.selection.count.is_some_and(|count| self.taken >= count)
    }

    fn pass(&mut self) {
        self.passed += 1;
        if let Some(so_far) = &self.selection.so_far {
            so_far.passed.store(self.passed, Ordering::Relaxed);
        }
    }

    fn take(&mut self) {
        self.pass();
        self.taken += 1;
        if let Some(so_far) = &self.selection.so_far {
            so_far.taken.store(self.taken, Ordering::Relaxed);
        }
    }

    /// Advances to the next selected scan. Returns `false` if there is none.
    fn seek(&mut self) -> Result<bool> {
        if self.is_at_end() {
            return Ok(false);
        }
        // Saturates: there are no scans beyond the largest number.
        let passed_between = self.taken.saturating_mul(self.selection.every.max(1));
        let wanted = self.selection.first.saturating_add(passed_between);
        while self.passed < wanted {
            // Skip one at a time: an unreadable scan also has a number, and is no error if it is not selected.
            match self.source.skip(1) {
                Ok(0) => return Ok(false),
                Ok(_) => {}
                Err(error) if !self.source.pass_unread() => return Err(error),
                Err(error) => {
                    log::debug!("skipped scan {} cannot be read: {error}", self.passed);
                    self.bad += 1;
                }
            }
            self.pass();
        }
        Ok(true)
    }

    /// Reads a scan without the ignored points, and rounds the others.
    fn read_changed(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        let Selection { ignored, step_m, .. } = self.selection;
        let budget: PointBudget = points.budget().clone();
        self.unfiltered = PointStore::new(budget);
        let head = self.source.read_scan(&mut self.unfiltered)?;
        points.begin_with(self.unfiltered.has_intensities(), self.unfiltered.attributes());
        let to_body = self.selection.body_from_sensor.as_ref().map(Pose::to_world);
        let is_ignored = |point: [f64; 3]| {
            let Some(ignored) = ignored else { return false };
            let point = to_body.as_ref().map_or(point, |to_body| to_body(point));
            (0..3).all(|k| ignored.min[k] <= point[k] && point[k] <= ignored.max[k])
        };
        let mut marks = self.unfiltered.moving().map(|moving| (moving.iter(), MovingMarks::builder()));
        let mut outcome = Ok(());
        self.unfiltered.for_each_attributed_chunk(
            0..self.unfiltered.len(),
            &mut |chunk, intensities, attributes| {
                for (number, &point) in chunk.iter().enumerate() {
                    let is_taken = !is_ignored(point);
                    if let Some((all, taken)) = &mut marks
                        && let Some(is_moving) = all.next()
                        && is_taken
                    {
                        taken.push(is_moving);
                    }
                    if is_taken {
                        let intensity = intensities.map_or(0.0, |intensities| intensities[number]);
                        let (colour, class) = (attributes.colour(number), attributes.class(number));
                        let time_ns = attributes.time_ns(number);
                        let point = step_m.map_or(point, |step_m| rounded(point, step_m));
                        outcome = points.push_with(point, intensity, colour, class, time_ns);
                        if outcome.is_err() {
                            return false;
                        }
                    }
                }
                true
            },
        )?;
        points.set_moving(marks.map(|(_, taken)| taken.finish()));
        points.set_sweep(self.unfiltered.sweep().cloned());
        points.set_body_from_sensor(self.unfiltered.body_from_sensor());
        self.unfiltered = PointStore::default();
        outcome?;
        Ok(head)
    }
}

/// Rounds the coordinates of a point to multiples of a step. Rays without a return, whose ends are far away, and a point
/// that would become one stay as they are.
fn rounded(point: [f64; 3], step_m: f64) -> [f64; 3] {
    /// Longest distance of a measured point, in metres.
    const MAX_M: f64 = 1e7;
    let rounded = point.map(|m| (m / step_m).round() * step_m);
    let is_point = rounded != [0.0; 3] && point.iter().all(|m| m.abs() <= MAX_M);
    if is_point { rounded } else { point }
}

impl ScanSource for SelectedScans {
    fn len_hint(&self) -> Option<usize> {
        let [passed, taken] = self.earlier;
        let end = passed.saturating_add(self.source.len_hint()? as u64);
        let all = end.saturating_sub(self.selection.first).div_ceil(self.selection.every.max(1));
        let all = self.selection.count.map_or(all, |count| all.min(count));
        Some(all.saturating_sub(taken) as usize)
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        if !self.seek()? {
            return Ok(None);
        }
        let head = match self.selection.changes_points() {
            false => self.source.read_scan(points)?,
            true => self.read_changed(points)?,
        };
        if head.is_some() {
            self.take();
        }
        Ok(head)
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        for skipped in 0..scans {
            if !self.seek()? || self.source.skip(1)? == 0 {
                return Ok(skipped);
            }
            self.take();
        }
        Ok(scans)
    }

    fn pass_unread(&mut self) -> bool {
        let is_passed = self.source.pass_unread();
        if is_passed {
            self.take();
        }
        is_passed
    }

    fn pose_source(&self) -> PoseSource {
        self.source.pose_source()
    }

    fn format(&self) -> String {
        self.source.format()
    }

    fn fields(&self) -> Vec<String> {
        self.source.fields()
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = self.source.remarks();
        if self.bad > 0 {
            remarks.push(format!("{} of the skipped scans cannot be read", self.bad));
        }
        if let Some(step_m) = self.selection.step_m {
            remarks.push(format!("coordinates of points are rounded to multiples of {step_m} m"));
        }
        remarks
    }

    fn crs(&self) -> Option<String> {
        self.source.crs()
    }

    fn fingerprint(&self) -> Result<String> {
        self.source.fingerprint()
    }
}

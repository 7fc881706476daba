use super::cloud::{CloudHead, CloudPoint, CloudSource};
use super::las_layout::Layout;
use super::las_points::{LasPoint, LasPoints};
use super::las_record::LasRecord;
use super::las_units::Units;
use super::one::Visit;
use crate::read_options::ReadOptions;
use crate::spill::{Sorted, Sorter};
use std::path::{Path, PathBuf};
use voxtile::scan::AttributeSet;
use voxtile::{Error, FormatError, Result};

/// Source that splits a LAS file into scans of equal duration by GPS time.
pub(super) struct LasScans<const RECORD_BYTES: usize> {
    format: String,
    path: PathBuf,
    units: Units,
    attributes: AttributeSet,
    /// Unsorted points, until the first scan is requested.
    unsorted: Option<(LasPoints, Sorter<LasRecord<RECORD_BYTES>>)>,
    sorted: Option<Sorted<LasRecord<RECORD_BYTES>>>,
    period_s: f64,
    zero_ns: i64,
    first_s: f64,
    has_one_time: bool,
    /// Current window, and the first point not yet returned.
    window: Option<u64>,
    peeked: Option<LasPoint>,
    scans: u64,
    remarks: Vec<String>,
    /// Error that ended reading. It is returned after the complete points.
    failure: Option<Error>,
}

impl<const RECORD_BYTES: usize> LasScans<RECORD_BYTES> {
    pub(super) fn new(
        format: String,
        path: &Path,
        layout: &Layout,
        units: Units,
        points: LasPoints,
        options: &ReadOptions,
    ) -> Self {
        let sorter = Sorter::new(&options.budget(), options.memory_bytes);
        Self {
            format,
            path: path.to_owned(),
            units,
            attributes: points.attributes(),
            unsorted: Some((points, sorter)),
            sorted: None,
            period_s: options.scan_period_s,
            zero_ns: layout.zero_ns(),
            first_s: 0.0,
            has_one_time: false,
            window: None,
            peeked: None,
            scans: 0,
            remarks: Vec::new(),
            failure: None,
        }
    }

    fn sort(&mut self) -> Result<()> {
        let Some((mut points, mut sorter)) = self.unsorted.take() else { return Ok(()) };
        let (mut number, mut least, mut most) = (0_u64, f64::INFINITY, f64::NEG_INFINITY);
        let (mut timeless, mut first_timeless) = (0_u64, 0);
        let mut is_sorting = false;
        let read = points.visit(&mut |point| {
            number += 1;
            if !point.time_s.is_finite() {
                if timeless == 0 {
                    first_timeless = number - 1;
                }
                timeless += 1;
                return Ok(());
            }
            (least, most) = (least.min(point.time_s), most.max(point.time_s));
            let pushed = sorter.push(LasRecord(point));
            is_sorting = pushed.is_err();
            pushed
        });
        match read {
            Err(error) if is_sorting => return Err(error),
            other => self.failure = other.err(),
        }
        self.remarks.extend(points.remarks());
        if timeless > 0 && timeless == number {
            let reason = "no point has a valid GPS time: read it as one cloud with `scan_period` 0";
            return Err(FormatError::at_record(first_timeless, reason).in_input(&self.path));
        }
        if timeless > 0 {
            self.remarks.push(format!(
                "{timeless} of {number} points have a GPS time of NaN and were skipped, first record {first_timeless}; \
                 `scan_period` 0 reads the file as one cloud with them"
            ));
        }
        (self.first_s, self.has_one_time) = (least, least >= most);
        if self.has_one_time && number - timeless > 1 {
            self.remarks
                .push("all points have the same GPS time: the file is one cloud without a stamp".into());
        }
        let mut sorted = sorter.finish()?;
        self.peeked = sorted.next()?.map(|record| record.0);
        self.sorted = Some(sorted);
        Ok(())
    }

    /// Returns the index of the window of a time, from 0.
    fn window_of(&self, time_s: f64) -> u64 {
        if self.has_one_time { 0 } else { window_after(time_s - self.first_s, self.period_s) }
    }

    /// Returns the middle of a window, in seconds of the file.
    fn middle_s(&self, window: u64) -> f64 {
        self.first_s + (window as f64 + 0.5) * self.period_s
    }

    /// Returns the stamp in nanoseconds of GPS time: since 6 January 1980, or since the start of the week for old
    /// files.
    fn stamp_ns(&self, window: u64) -> Option<i64> {
        let middle_ns = (self.middle_s(window) * 1e9).round();
        let is_possible = middle_ns.abs() < 9e18 && !self.has_one_time;
        is_possible.then(|| (middle_ns as i64).checked_add(self.zero_ns)).flatten()
    }

    fn next_of(&mut self, window: u64) -> Result<Option<LasPoint>> {
        let Some(point) = self.peeked else { return Ok(None) };
        if self.window_of(point.time_s) != window {
            return Ok(None);
        }
        self.peeked = match &mut self.sorted {
            Some(sorted) => sorted.next()?.map(|record| record.0),
            None => None,
        };
        Ok(Some(point))
    }
}

/// Returns the window index for a time after the first point. A time slightly before a window, due to rounding, counts
/// as the window's start.
fn window_after(since_s: f64, period_s: f64) -> u64 {
    /// Tolerance, as a fraction of a window. Seconds since the GPS epoch have steps of 0.1 us.
    const ROUNDING: f64 = 1e-5;
    (since_s / period_s + ROUNDING) as u64
}

impl<const RECORD_BYTES: usize> CloudSource for LasScans<RECORD_BYTES> {
    fn format(&self) -> &str {
        &self.format
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        self.sort()?;
        if let Some(window) = self.window.take() {
            while self.next_of(window)?.is_some() {}
        }
        let Some(first) = self.peeked else {
            // All complete points were returned.
            return self.failure.take().map_or(Ok(None), Err);
        };
        let window = self.window_of(first.time_s);
        self.window = Some(window);
        let head = CloudHead {
            name: self.scans.to_string(),
            stamp_ns: self.stamp_ns(window),
            fields: super::las::fields(true),
            has_intensities: true,
            attributes: self.attributes,
            has_times: !self.has_one_time,
            ..CloudHead::default()
        };
        self.scans += 1;
        Ok(Some(head))
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        let Some(window) = self.window else { return Ok(()) };
        let middle_s = if self.has_one_time { self.first_s } else { self.middle_s(window) };
        while let Some(point) = self.next_of(window)? {
            let time_s = point.time_s - middle_s;
            visit(CloudPoint { time_s, ..point.cloud_point(self.attributes) })?;
        }
        Ok(())
    }

    fn remarks(&self) -> Vec<String> {
        self.units.remarks.iter().chain(&self.remarks).cloned().collect()
    }

    fn crs(&self) -> Option<&str> {
        self.units.crs.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_start_times_are_in_their_window() {
        // In floating point, a window is not exactly a tenth of a second.
        for window in 0..10_000 {
            let first_s = 1_000_000_000.05_f64;
            let time_s = first_s + 0.1 * f64::from(window);
            assert_eq!(window_after(time_s - first_s, 0.1), u64::from(window as u32));
            assert_eq!(window_after(0.1 * (f64::from(window) + 0.999), 0.1), u64::from(window as u32));
        }
    }
}

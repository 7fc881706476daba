use super::las_layout::{Layout, number};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Point counts in a header.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Counts {
    /// The 32-bit count.
    pub(super) legacy: u64,
    /// The 64-bit count, since LAS 1.4.
    pub(super) large: Option<u64>,
}

impl Counts {
    /// Selects the valid count: the 64-bit one if it is nonzero and within `low..=high`, else the 32-bit one. Writers
    /// of LAS 1.4 may leave the old count empty or outdated; other readers also prefer the 64-bit count.
    pub(super) fn choose(&self, low: u64, high: u64) -> u64 {
        let numbers = [self.large.unwrap_or(0), self.legacy].into_iter().filter(|number| *number > 0);
        let mut fitting = numbers.clone().filter(|number| (low..=high).contains(number));
        fitting.next().or_else(|| numbers.clone().next()).unwrap_or(0)
    }

    /// Returns a remark if the two counts differ.
    pub(super) fn remark(&self, taken: u64) -> Option<String> {
        let large = self.large.filter(|large| *large > 0 && self.legacy > 0 && *large != self.legacy)?;
        Some(format!(
            "the header has two point counts, {} and {large}: {taken} points exist and are read",
            self.legacy
        ))
    }

    /// Returns the byte offset of the count in the header.
    pub(super) fn place(&self) -> u64 {
        if self.legacy == 0 && self.large.is_some() { 247 } else { 107 }
    }
}

/// Number of records to sample if the file has more than announced.
const SAMPLES: u64 = 64;

/// Determines the number of points of an uncompressed file: all points present in the file.
pub(super) fn settle(path: &Path, file: &mut File, layout: &mut Layout) -> Result<()> {
    let record_bytes = layout.record_bytes.max(1);
    let room_to = |end: u64| end.saturating_sub(layout.points_at) / record_bytes;
    let (room, all) = (room_to(layout.points_end()), room_to(layout.file_bytes));
    // If the two counts differ, take the one that equals the points present, else one that does not exceed them.
    let exact = layout.counts.choose(room, room);
    let announced = if exact == room { room } else { layout.counts.choose(0, all) };
    layout.points = announced;
    let mut remark = layout.counts.remark(announced.min(all));
    if announced == 0 && room > 0 {
        layout.points = room;
        remark = Some(stopped(room));
    } else if announced > all {
        if all == 0 {
            let reason = format!("the file ends before the first of {announced} points");
            return Err(FormatError::at_record(0, reason).in_input(path));
        }
        layout.points = all;
        remark = Some(cut_off(all, announced));
    } else if announced < room {
        let are_points = are_points(file, layout, announced, room);
        if are_points.map_err(|error| Error::io(path, "read", error))? {
            layout.points = room;
            remark = Some(format!("the header announces {announced} points; {room} exist and are read"));
        } else {
            let extra = room - announced;
            remark = Some(format!(
                "the header announces {announced} points, which are read; the file has space for {extra} more after \
                 them"
            ));
        }
    }
    layout.remarks.extend(remark);
    Ok(())
}

/// Returns a remark on a file whose writer stopped before writing the point count.
pub(super) fn stopped(there: u64) -> String {
    format!(
        "the header announces no points, because its writer was interrupted: the {there} points that exist are read"
    )
}

/// Returns a remark on a truncated file.
pub(super) fn cut_off(read: u64, announced: u64) -> String {
    format!("the file is truncated: {read} of {announced} points exist and are read")
}

/// Returns whether the records after the announced points are points too: not all zero, and close to the header's
/// bounds.
fn are_points(file: &mut File, layout: &Layout, from: u64, to: u64) -> std::io::Result<bool> {
    let step = ((to - from) / SAMPLES).max(1);
    let mut is_zero = true;
    for record in (from..to).step_by(usize::try_from(step).unwrap_or(usize::MAX)) {
        let mut point = [0; 20];
        file.seek(SeekFrom::Start(layout.points_at + record * layout.record_bytes))?;
        file.read_exact(&mut point)?;
        is_zero &= point.iter().all(|byte| *byte == 0);
        for axis in 0..3 {
            let (scale, offset) = layout.transform(axis);
            let place = scale * f64::from(number(&point, 4 * axis, 4) as u32 as i32) + offset;
            let Some((least, most)) = layout.bounds(axis) else { return Ok(false) };
            let margin = most - least + scale.abs();
            if !(least - margin..=most + margin).contains(&place) {
                return Ok(false);
            }
        }
    }
    Ok(!is_zero)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fitting_count_is_chosen() {
        let counts = |legacy, large| Counts { legacy, large };
        for (numbers, [low, high], chosen) in [
            (counts(100, None), [0, 50], 100),
            (counts(0, Some(400)), [0, 500], 400),
            (counts(100, Some(0)), [0, 500], 100),
            (counts(100, Some(400)), [0, 500], 400),
            (counts(100, Some(400)), [100, 100], 100),
            (counts(100, Some(1 << 50)), [0, 500], 100),
            (counts(800, Some(700)), [0, 500], 700),
            (counts(0, Some(0)), [0, 500], 0),
        ] {
            assert_eq!(numbers.choose(low, high), chosen, "{numbers:?} {low} {high}");
        }
    }
}

use super::las_layout::{Layout, number};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// The numbers of points in a header.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Counts {
    /// Of 32 bits.
    pub(super) legacy: u64,
    /// Of 64 bits, since LAS 1.4.
    pub(super) large: Option<u64>,
}

impl Counts {
    /// The number that counts, of two the one from `low` to `high`: writers of LAS 1.4 may leave the old number empty,
    /// or put the points of an earlier version there. Other readers take the large one, too.
    pub(super) fn choose(&self, low: u64, high: u64) -> u64 {
        let numbers = [self.large.unwrap_or(0), self.legacy].into_iter().filter(|number| *number > 0);
        let mut fitting = numbers.clone().filter(|number| (low..=high).contains(number));
        fitting.next().or_else(|| numbers.clone().next()).unwrap_or(0)
    }

    /// A remark on two numbers that differ.
    pub(super) fn remark(&self, taken: u64) -> Option<String> {
        let large = self.large.filter(|large| *large > 0 && self.legacy > 0 && *large != self.legacy)?;
        Some(format!(
            "the header has two numbers of points, {} and {large}: {taken} are there and are read",
            self.legacy
        ))
    }

    /// The byte of the number in the header.
    pub(super) fn place(&self) -> u64 {
        if self.legacy == 0 && self.large.is_some() { 247 } else { 107 }
    }
}

/// Records that are looked at where more are there than announced.
const SAMPLES: u64 = 64;

/// Finds how many points of a file that is not compressed are to be read: all that are there.
pub(super) fn settle(path: &Path, file: &mut File, layout: &mut Layout) -> Result<()> {
    let record_bytes = layout.record_bytes.max(1);
    let room_to = |end: u64| end.saturating_sub(layout.points_at) / record_bytes;
    let (room, all) = (room_to(layout.points_end()), room_to(layout.file_bytes));
    // Two numbers: the one of the points that are there, else one that there is room for.
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
            remark = Some(format!("the header announces {announced} points; {room} are there and are read"));
        } else {
            let behind = room - announced;
            remark = Some(format!(
                "the header announces {announced} points, which are read; the file has room for {behind} more behind \
                 them"
            ));
        }
    }
    layout.remarks.extend(remark);
    Ok(())
}

/// A remark on a file whose writer was stopped before it wrote the number of points.
pub(super) fn stopped(there: u64) -> String {
    format!(
        "the header announces no points, as a writer leaves it that was stopped: the {there} that are there are read"
    )
}

/// A remark on a file that was cut off.
pub(super) fn cut_off(read: u64, announced: u64) -> String {
    format!("the file is cut off: {read} of {announced} points are there and are read")
}

/// Whether records behind the announced points are points, too: not all zero, and near the bounds in the header.
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
    fn of_two_numbers_the_one_that_fits_counts() {
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

use std::ops::Range;
use std::time::{Duration, UNIX_EPOCH};

/// Seconds since 1970 from 2000 to 2100. Other time stamps count from another epoch, such as the start of a sensor.
const UNIX_TIMES_S: Range<f64> = 946_684_800.0..4_102_444_800.0;
const DAY_S: f64 = 86_400.0;

/// Returns whether a time stamp in seconds is probably one since 1970.
pub fn is_unix_time(stamp_s: f64) -> bool {
    UNIX_TIMES_S.contains(&stamp_s)
}

/// Formats the ends of a range of time stamps in seconds: as dates (UTC) if they are times since 1970, else as seconds
/// since the first.
pub fn time_labels([first_s, last_s]: [f64; 2]) -> [String; 2] {
    if ![first_s, last_s].into_iter().all(is_unix_time) {
        return [0.0, last_s - first_s].map(|seconds| format!("{seconds:.1} s"));
    }
    let [first, last] = [first_s, last_s].map(|seconds| {
        let time = UNIX_EPOCH + Duration::from_secs(seconds as u64);
        humantime::format_rfc3339_seconds(time).to_string().trim_end_matches('Z').replace('T', " ")
    });
    let date = |text: &str| text.split(' ').next().unwrap_or_default().to_owned();
    if last_s - first_s > 3.0 * DAY_S {
        return [date(&first), date(&last)];
    }
    let is_one_day = date(&first) == date(&last);
    let last = if is_one_day { last.split(' ').next_back().unwrap_or_default().to_owned() } else { last };
    [first, last]
}

/// Formats the ends as [`time_labels`] does, in at most eleven letters. Returns the part of the dates that both have in
/// common and that the labels omit: the day, or the years.
pub(super) fn short_time_labels(range_s: [f64; 2]) -> ([String; 2], Option<String>) {
    let [first, last] = time_labels(range_s);
    let part = |text: &str, range: Range<usize>| text.get(range).unwrap_or_default().to_owned();
    match (first.len(), last.len()) {
        (FULL, TIME) => ([part(&first, FULL - TIME..FULL), last], Some(part(&first, 0..DATE))),
        (FULL, FULL) => {
            let years = if first[..4] == last[..4] {
                part(&first, 0..4)
            } else {
                format!("{} to {}", &first[..4], &last[..4])
            };
            ([&first, &last].map(|text| part(text, 5..16)), Some(years))
        }
        _ => ([first, last], None),
    }
}

/// Letters of `2011-09-26 13:04:32`, of its time and of its date.
const FULL: usize = 19;
const TIME: usize = 8;
const DATE: usize = 10;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_since_1970_are_dates() {
        let labels = |first_s, last_s| time_labels([first_s, last_s]);
        assert_eq!(labels(1_317_042_272.4, 1_317_042_300.0), ["2011-09-26 13:04:32", "13:05:00"]);
        assert_eq!(labels(1_317_042_272.0, 1_317_128_672.0), ["2011-09-26 13:04:32", "2011-09-27 13:04:32"]);
        assert_eq!(labels(1_317_042_272.0, 1_417_042_272.0), ["2011-09-26", "2014-11-26"]);
        assert_eq!(labels(12.25, 80.0), ["0.0 s", "67.8 s"]);
        assert_eq!(labels(-9e9, 1.4e9)[0], "0.0 s");
        let short = |first_s, last_s| {
            let ([first, last], common) = short_time_labels([first_s, last_s]);
            format!("{first} to {last}; {common:?}")
        };
        assert_eq!(short(1_317_042_272.4, 1_317_042_300.0), "13:04:32 to 13:05:00; Some(\"2011-09-26\")");
        assert_eq!(short(1_317_042_272.0, 1_317_128_672.0), "09-26 13:04 to 09-27 13:04; Some(\"2011\")");
        assert_eq!(
            short(1_325_289_600.0, 1_325_462_400.0),
            "12-31 00:00 to 01-02 00:00; Some(\"2011 to 2012\")"
        );
        assert_eq!(short(1_317_042_272.0, 1_417_042_272.0), "2011-09-26 to 2014-11-26; None");
        assert_eq!(short(12.25, 80.0), "0.0 s to 67.8 s; None");
    }
}

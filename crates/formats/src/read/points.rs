use std::io::{self, BufRead, Read};
use voxtile::FormatError;
use voxtile::space::Point;

/// A longer line is an error.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// Reads points, one per line: x y z in metres, separated by blanks or commas; more columns are ignored. Empty lines,
/// lines that start with `#` and a first line of words are skipped.
///
/// # Errors
///
/// A line without three numbers; the outer error is the stream's.
pub fn read_points(mut input: impl BufRead) -> io::Result<Result<Vec<Point>, FormatError>> {
    let (mut points, mut bytes) = (Vec::new(), Vec::new());
    for number in 1.. {
        bytes.clear();
        let read = (&mut input).take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes)?;
        if read == 0 {
            break;
        }
        if read as u64 == MAX_LINE_BYTES {
            let reason = format!("the line is longer than {} KiB", MAX_LINE_BYTES >> 10);
            return Ok(Err(FormatError::at_line(number, reason)));
        }
        let text =
            str::from_utf8(&bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        let line = text.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words = line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty());
        let numbers: Vec<Option<f64>> = words.take(3).map(|word| word.parse().ok()).collect();
        match numbers[..] {
            [Some(x), Some(y), Some(z)] => points.push([x, y, z]),
            _ if points.is_empty() && number == 1 && numbers.iter().all(Option::is_none) => {}
            _ => {
                let reason = format!("`{line}` is not a point; three numbers x y z are needed");
                return Ok(Err(FormatError::at_line(number, reason)));
            }
        }
    }
    Ok(Ok(points))
}

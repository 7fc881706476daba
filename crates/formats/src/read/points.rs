use super::columns::Meaning;
use super::foreign::{text_encoding, without_bom};
use super::lines::{Extent, MAX_LINE_BYTES, RawLines};
use super::text_header::names_of;
use super::text_line::{Separator, comment_of, digits_behind_comma};
use std::io::{self, BufRead};
use voxtile::FormatError;
use voxtile::space::Point;

/// Reads points, one per line: x y z in metres, separated by blanks, commas, semicolons or tabs, with decimal commas if
/// commas are not separators. Further columns are ignored. Column names before the points determine x, y and z and
/// their units. Empty lines, comments (`#`, `//`, `%`) and a first line of other words are skipped.
///
/// # Errors
///
/// A line has no three numbers, or a unit is unknown. The outer error is an I/O error of the input.
pub fn read_points(input: impl BufRead) -> io::Result<Result<Vec<Point>, FormatError>> {
    let mut lines = RawLines::new(input, MAX_LINE_BYTES);
    let (mut points, mut meaning, mut number) = (Vec::new(), Meaning::of_metres([0, 1, 2]), 0);
    while let Some(extent) = lines.next()? {
        number += 1;
        let wrong = |reason: String| Ok(Err(FormatError::at_line(number, reason)));
        if extent == Extent::Start {
            return wrong(format!("the line is longer than {} KiB", MAX_LINE_BYTES >> 10));
        }
        let mut bytes = lines.line();
        if number == 1 {
            if let Some(encoding) = text_encoding(bytes) {
                return wrong(encoding.to_owned());
            }
            bytes = without_bom(bytes);
        }
        let text =
            str::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        let line = text.trim();
        let comment = comment_of(line);
        if points.is_empty() {
            match Meaning::of(&names_of(comment.unwrap_or(line)), |_| false) {
                Ok(Some(named)) => {
                    meaning = named;
                    continue;
                }
                Ok(None) => {}
                Err(reason) => return wrong(reason),
            }
        }
        if line.is_empty() || comment.is_some() {
            continue;
        }
        match point_of(line, &meaning) {
            Some(point) => points.push(point),
            None if points.is_empty() && number == 1 && !has_numbers(line) => {}
            None => return wrong(format!("`{line:.80}` is not a point; three numbers x y z are needed")),
        }
    }
    Ok(Ok(points))
}

/// Parses the point of a line.
fn point_of(line: &str, meaning: &Meaning) -> Option<Point> {
    let separator = Separator::of(line);
    let mut cells = separator.split(line);
    if digits_behind_comma(separator, &cells).is_some() {
        return None;
    }
    if separator == Separator::Char(',') {
        // Blanks separate cells too: `1, 2 3`.
        cells = cells.into_iter().flat_map(str::split_ascii_whitespace).collect();
    }
    let [x, y, z] = meaning.xyz.map(|at| separator.number(cells.get(at)?));
    let [in_x, in_y, in_z] = meaning.units;
    Some([in_x.metres(x?), in_y.metres(y?), in_z.metres(z?)])
}

/// Returns whether one of the first three words is a number.
fn has_numbers(line: &str) -> bool {
    let separator = Separator::of(line);
    separator.split(line).iter().take(3).any(|cell| separator.number(cell).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Point>, String> {
        match read_points(text.as_bytes()) {
            Ok(read) => read.map_err(|error| error.to_string()),
            Err(error) => Err(error.to_string()),
        }
    }

    #[test]
    fn points_of_many_programs_are_read() {
        let wanted = vec![[1.5, 2.25, -3.0], [4.0, 5.0, 6.0]];
        for text in [
            "1.5 2.25 -3\n4 5 6\n",
            "\u{feff}x,y,z\r\n1.5,2.25,-3\r\n4,5,6\r\n",
            "1.5 2.25 -3\r4 5 6\r",
            "1,5;2,25;-3,0\n4;5;6\n",
            "1,5\t2,25\t-3,0\n4\t5\t6\n",
            "words of no names\n1.5 2.25 -3\n4 5 6",
            "z;y;x\n-3;2.25;1.5\n6;5;4\n",
            "x (cm),y (cm),z (cm)\n150,225,-300\n400,500,600\n",
        ] {
            assert_eq!(read(text), Ok(wanted.clone()), "{text}");
        }
        assert_eq!(read("1.5, 2.25 -3 7\n4;5;6;seven"), Ok(wanted));
    }

    #[test]
    fn a_line_without_a_point_is_an_error() {
        for (text, reason) in [
            ("1 2 3\n4 five 6\n", "line 2: `4 five 6` is not a point"),
            ("# by hand\nlon lat\n", "line 2: `lon lat` is not a point"),
            ("1,2\n", "line 1: `1,2` is not a point"),
            ("6,001,3,178,-1,000\n", "is not a point"),
            ("1 2 3\nx y z\n", "line 2: `x y z` is not a point"),
            ("x (px) y (px) z (px)\n1 2 3\n", "`px` is an unknown unit"),
            ("\u{0}1\u{0} \u{0}2", "is text in UTF-16"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }
}

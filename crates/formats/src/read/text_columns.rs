//! Line-by-line parser of a text of points.

use super::attribute_columns::{AttributeColumns, AttributeValues, ColourColumns};
use super::cloud::CloudPoint;
use super::columns::{Clock, Meaning};
use super::text_header::{are_poses, names_of, requested_separator, unit_of_comment, units_row};
use super::text_line::{Separator, comment_of, digits_behind_comma, without_end};
use voxtile::scan::AttributeSet;

/// Meaning of a line.
#[derive(Debug, PartialEq)]
pub(super) enum Line {
    Point(CloudPoint),
    /// A comment, column names, an empty line, or a number of points.
    Nothing,
    /// An invalid row and the reason.
    Unread(String),
}

/// Line number and reason of an error that makes the whole text unusable.
pub(super) type Wrong = (u64, String);

/// Separator and meaning of the columns. Both are fixed with the first point.
#[derive(Debug, Default)]
pub(super) struct Columns {
    pub(super) clock: Clock,
    pub(super) names: Vec<String>,
    separator: Separator,
    requested: Option<Separator>,
    are_named: bool,
    meaning: Option<Meaning>,
    /// Attributes to read, and their columns. Only named columns have attributes.
    pub(super) wanted: AttributeSet,
    attributes: AttributeColumns,
    values: AttributeValues,
    has_points: bool,
    /// Whether every cell of the first point is a number.
    are_numbers: bool,
    /// Number of columns before the named ones. The language R writes row names there.
    unnamed: usize,
    counts: Counts,
    /// First unrecognised line before the points. It is an error unless column names follow.
    prose: Option<Wrong>,
    /// Number of lines before the points.
    lines_before: u32,
    /// A comment that mentions a unit other than metres.
    comment_unit: Option<Wrong>,
    notes: Vec<String>,
}

/// Point counts that precede the points. PTS has one before each scan.
#[derive(Debug, Default)]
struct Counts {
    scans: u64,
    announced: u64,
    rows: u64,
}

/// Limit for the lines of prose before the column names.
const MAX_LINES_BEFORE: u32 = 100;

impl Counts {
    /// Accepts a line with one number as a point count, if a scan may begin here.
    fn begin(&mut self, count: f64) -> bool {
        let is_number = count.fract() == 0.0 && count >= 0.0;
        let may_begin = is_number && (self.scans == 0 || self.rows >= self.announced);
        if may_begin {
            self.scans += 1;
            self.announced = self.announced.saturating_add(count as u64);
        }
        may_begin
    }

    fn remark(&self) -> Option<String> {
        let Self { scans, announced, rows } = self;
        if *scans > 0 && announced != rows {
            return Some(format!("announces {announced} points but has {rows}: is it truncated?"));
        }
        (*scans > 1).then(|| format!("{scans} scans, each with a point count, are read as one cloud"))
    }
}

impl Columns {
    /// Returns whether column names were found.
    pub(super) fn are_named(&self) -> bool {
        self.are_named
    }

    /// Returns whether every cell of the first point is a number.
    pub(super) fn are_numbers(&self) -> bool {
        self.are_numbers
    }

    pub(super) fn meaning(&self) -> Option<&Meaning> {
        self.meaning.as_ref()
    }

    /// Returns which of the wanted attributes the points have.
    pub(super) fn attributes(&self) -> AttributeSet {
        self.attributes.set()
    }

    /// Returns remarks for the user about the columns.
    pub(super) fn remarks(&self) -> Vec<String> {
        let units = self.meaning.as_ref().and_then(Meaning::remark);
        self.notes.iter().cloned().chain(units).chain(self.values.remarks()).collect()
    }

    /// Returns a remark for the user at the end of the text.
    pub(super) fn last_remark(&self) -> Option<String> {
        self.counts.remark()
    }

    /// Returns the error of a text that ended without a point, if any.
    pub(super) fn why_none(&self) -> Option<Wrong> {
        self.prose.clone().filter(|_| !self.are_named)
    }

    /// Parses the next line.
    pub(super) fn take(&mut self, number: u64, line: &str) -> Result<Line, Wrong> {
        let text = line.trim();
        if text.is_empty() {
            // A row of empty cells may consist of tabs only.
            let is_row = self.has_points && self.separator == Separator::Char('\t') && line.contains('\t');
            return Ok(if is_row { self.row(line) } else { Line::Nothing });
        }
        if let Some(comment) = comment_of(text) {
            if !self.has_points {
                self.take_comment(number, comment).map_err(|reason| (number, reason))?;
            }
            return Ok(Line::Nothing);
        }
        if self.has_points {
            return Ok(self.row(line));
        }
        if let Some(separator) = requested_separator(text).filter(|_| self.lines_before == 0) {
            self.requested = Some(separator);
            return Ok(Line::Nothing);
        }
        let found = self.begin(number, line).map_err(|reason| {
            let first = self.prose.take().filter(|_| !self.are_named);
            first.unwrap_or((number, reason))
        })?;
        self.lines_before += 1;
        if found == Line::Nothing || self.are_named {
            return Ok(found);
        }
        match self.prose.take() {
            Some(prose) => Err(prose),
            None => Ok(found),
        }
    }

    /// Reads column names, which some programs write as a comment, and a unit mentioned in a comment.
    fn take_comment(&mut self, number: u64, comment: &str) -> Result<(), String> {
        if !self.are_named {
            self.take_names(comment)?;
        }
        if unit_of_comment(comment).is_some() {
            self.comment_unit.get_or_insert_with(|| (number, comment.trim().to_owned()));
        }
        Ok(())
    }

    /// Parses a line before the first point.
    fn begin(&mut self, number: u64, line: &str) -> Result<Line, String> {
        let separator = self.requested.unwrap_or_else(|| Separator::of_row(line, self.names.len()));
        let cells = separator.split(line);
        // PTS starts with a point count.
        if let [only] = without_end(&cells)
            && let Some(count) = separator.number(only)
        {
            return if self.counts.begin(count) { Ok(Line::Nothing) } else { Err(too_few(1)) };
        }
        if self.are_named {
            return self.begin_named(separator, &cells, line);
        }
        let is_number = |cell: &&str| cell.is_empty() || separator.number(cell).is_some();
        match cells.get(..3) {
            Some(first) if first.iter().all(is_number) => self.begin_unnamed(separator, &cells),
            _ if self.take_names(line)? => Ok(Line::Nothing),
            _ if cells.iter().all(is_number) => Err(too_few(without_end(&cells).len())),
            _ => {
                let text = line.trim();
                let reason = if text.get(..5).is_some_and(|start| start.eq_ignore_ascii_case("ncols")) {
                    "this is a grid of heights (ESRI ASCII), not points: convert it with gdal_translate -of XYZ".into()
                } else {
                    format!("`{text:.60}` is neither numbers nor column names with x, y and z")
                };
                if self.lines_before >= MAX_LINES_BEFORE {
                    return Err(reason);
                }
                self.prose.get_or_insert((number, reason));
                Ok(Line::Nothing)
            }
        }
    }

    fn begin_unnamed(&mut self, separator: Separator, cells: &[&str]) -> Result<Line, String> {
        let columns = without_end(cells).len();
        if columns == 0 {
            // A row without a return does not reveal the columns.
            let position_m = [f64::NAN; 3];
            return Ok(Line::Point(CloudPoint { is_return: false, ..CloudPoint::hit(position_m) }));
        }
        if let Some(cell) = digits_behind_comma(separator, cells) {
            return Err(ambiguous_commas(columns, &format!("`{cell:.20}` is the fraction of a number")));
        }
        let is_number = |cell: Option<&&str>| cell.is_some_and(|cell| separator.number(cell).is_some());
        let mut meaning = Meaning::of_metres([0, 1, 2]);
        // x y z, then the intensity, unless the next three columns are a colour or a normal.
        meaning.intensity = (columns > 3 && columns != 6 && is_number(cells.get(3))).then_some(3);
        self.names = ["x", "y", "z"].map(str::to_owned).into();
        self.names.extend(meaning.intensity.map(|_| "intensity".to_owned()));
        if columns > 3 {
            let rest = if columns > self.names.len() { ", the others are ignored" } else { "" };
            self.notes.push(format!("{columns} columns without names: {}{rest}", self.names.join(" ")));
        }
        (self.separator, self.meaning) = (separator, Some(meaning));
        self.are_numbers = without_end(cells).iter().all(|cell| cell.is_empty() || is_number(Some(cell)));
        self.first_point(cells)
    }

    fn begin_named(&mut self, separator: Separator, cells: &[&str], line: &str) -> Result<Line, String> {
        let Some(mut meaning) = self.meaning else { return Err("the columns x, y and z are unknown".into()) };
        if let Some(units) = units_row(cells, &meaning) {
            meaning.units = units;
            self.meaning = Some(meaning);
            return Ok(Line::Nothing);
        }
        self.separator = separator;
        let columns = without_end(cells).len();
        if separator == Separator::Char(',') && columns == 2 * self.names.len() {
            return Err(ambiguous_commas(columns, &format!("there are {} column names", self.names.len())));
        }
        let is_one_more = columns == self.names.len() + 1 && line.trim_start().starts_with('"');
        self.unnamed = usize::from(is_one_more);
        // Optional columns may contain words and are then ignored.
        let attributes = self.attributes;
        let optional = meaning.intensity.into_iter().chain(meaning.time.map(|time| time.at));
        for at in optional.chain(attributes.all()) {
            let cell = cells.get(at + self.unnamed).copied().unwrap_or_default();
            if cell.is_empty() || separator.number(cell).is_some() {
                continue;
            }
            meaning.intensity = meaning.intensity.filter(|intensity| *intensity != at);
            meaning.time = meaning.time.filter(|time| time.at != at);
            self.attributes.class = self.attributes.class.filter(|class| *class != at);
            let is_colour =
                |columns: &ColourColumns| matches!(columns, ColourColumns::Each(all) if all.contains(&at));
            self.attributes.colour = self.attributes.colour.filter(|columns| !is_colour(columns));
            let name = self.names.get(at).map(String::as_str).unwrap_or_default();
            self.notes.push(format!("column `{name:.40}` has no numbers (`{cell:.20}`) and is ignored"));
        }
        let before = self.meaning.replace(meaning);
        match self.first_point(cells) {
            Ok(point) => Ok(point),
            Err(reason) => {
                self.meaning = before;
                self.attributes = attributes;
                self.notes.clear();
                Ok(if self.take_names(line)? { Line::Nothing } else { Line::Unread(reason) })
            }
        }
    }

    fn first_point(&mut self, cells: &[&str]) -> Result<Line, String> {
        let point = self.point(cells)?;
        self.has_points = true;
        self.counts.rows += 1;
        if let (Some((line, comment)), Some(None)) = (&self.comment_unit, self.meaning().map(Meaning::remark))
        {
            self.notes
                .push(format!("line {line} contains `{comment:.60}`, but coordinates are read as metres"));
        }
        Ok(Line::Point(point))
    }

    fn row(&mut self, line: &str) -> Line {
        let cells = self.separator.split(line);
        let reason = match self.point(&cells) {
            Ok(point) => {
                self.counts.rows += 1;
                return Line::Point(point);
            }
            Err(reason) => reason,
        };
        if let [only] = without_end(&cells)
            && self.counts.scans > 0
            && let Some(count) = self.separator.number(only)
            && self.counts.begin(count)
        {
            return Line::Nothing;
        }
        self.counts.rows += 1;
        Line::Unread(reason)
    }

    /// Parses a line as column names, if they include x, y and z.
    fn take_names(&mut self, line: &str) -> Result<bool, String> {
        let names = names_of(line.trim());
        // The column `offset_time` of Livox is in nanoseconds. Whether other columns hold integers is unknown until all
        // rows are read.
        let is_integer =
            |at: usize| names.get(at).is_some_and(|name| name.eq_ignore_ascii_case("offset_time"));
        let Some(meaning) = Meaning::of(&names, is_integer)? else { return Ok(false) };
        if are_poses(&names) {
            self.notes.push("has columns qx qy qz qw: if these are poses, use `poses` FILE".into());
        }
        self.attributes = AttributeColumns::of(names.iter().map(String::as_str), self.wanted, |_| false);
        (self.names, self.meaning, self.are_named) = (names, Some(meaning), true);
        Ok(true)
    }

    fn point(&mut self, cells: &[&str]) -> Result<CloudPoint, String> {
        let Some(meaning) = self.meaning else { return Err("the columns x, y and z are unknown".into()) };
        let (separator, unnamed) = (self.separator, self.unnamed);
        let value = |at: usize| -> Result<f64, String> {
            match cells.get(at + unnamed) {
                None => {
                    Err(format!("{} columns, but {} are needed", cells.len(), meaning.last() + unnamed + 1))
                }
                Some(&"") => Ok(f64::NAN),
                Some(cell) => separator.number(cell).ok_or_else(|| format!("`{cell:.40}` is not a number")),
            }
        };
        let [x, y, z] = meaning.xyz;
        let xyz = [value(x)?, value(y)?, value(z)?];
        let intensity = meaning.intensity.map(value).transpose()?;
        let time = meaning.time.map(|time| value(time.at)).transpose()?;
        let mut point = self.clock.point_of(&meaning, xyz, intensity, time);
        // An attribute that is missing or not a number is unknown.
        let known = |at: usize| value(at).unwrap_or(f64::NAN);
        self.attributes.set_in(&mut point, &mut self.values, known, |_| None);
        Ok(point)
    }
}

fn too_few(columns: usize) -> String {
    format!("{columns} columns; a point needs x, y and z")
}

fn ambiguous_commas(cells: usize, why: &str) -> String {
    format!(
        "{cells} comma-separated cells, but {why}: decimal commas and separators are ambiguous; save it with \
         semicolons or tabs, or with decimal points"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_all(text: &str) -> Result<(Vec<CloudPoint>, Columns, Vec<String>), String> {
        let mut columns = Columns::default();
        let (mut points, mut unread) = (Vec::new(), Vec::new());
        for (number, line) in (1..).zip(text.lines()) {
            match columns.take(number, line).map_err(|(line, reason)| format!("line {line}: {reason}"))? {
                Line::Point(point) => points.push(point),
                Line::Nothing => {}
                Line::Unread(reason) => unread.push(format!("line {number}: {reason}")),
            }
        }
        if let (true, Some((line, reason))) = (points.is_empty(), columns.why_none()) {
            return Err(format!("line {line}: {reason}"));
        }
        Ok((points, columns, unread))
    }

    fn read(text: &str) -> Result<Vec<CloudPoint>, String> {
        let (points, _, unread) = read_all(text)?;
        unread.into_iter().next().map_or(Ok(points), Err)
    }

    #[test]
    fn names_and_separators_of_many_programs() {
        let wanted = CloudPoint { intensity: 7.0, ..CloudPoint::hit([1.0, 2.0, 3.0]) };
        for text in [
            "1 2 3 7",
            "1\t2\t3\t7\n",
            "# made by hand\n1, 2, 3, 7,\n",
            "//X Y Z Scalar_Intensity\n1 2 3 7\n",
            "\"z\";\"intensity\";\"y\";\"x\"\n3;7;2;1\n",
            "Points:0,Points:1,Points:2,Intensity\n1,2,3,7\n",
            "1\n1 2 3 7 255 0 0\n",
            "//X;Y;Z;R;Intensity\n1\n1;2;3;255;7\n",
            "\"intensity\",\"Points_m_XYZ:0\",\"Points_m_XYZ:1\",\"Points_m_XYZ:2\"\n7,1,2,3\n",
            "sep=;\nx;y;z;i\n1,0;2,0;3,0;7\n",
            "1,0 2,0 3,0 7,0\n",
            "1,0\t2,0\t3,0\t7,0\n",
            "\"1,0\",\"2,0\",\"3,0\",7\n",
            "x|y|z|i\n1|2|3|7\n",
            "| x | y | z | i |\n| 1 | 2 | 3 | 7 |\n",
            "error,x,y,z,i\n0x0000,1,2,3,7\n",
            "class\tx\ty\tz\ti\n\t1\t2\t3\t7\n",
            "x y z i label\n1 2 3 7 building\n",
            "1 2 3 7 building\n",
            "Exported by hand\nX Y Z Intensity\n1 2 3 7\n",
            "x,y,z,i\nmm,mm,mm,-\n1000,2000,3000,7\n",
            "x (cm) y (cm) z (cm) i\n100 200 300 7\n",
            "\"x\" \"y\" \"z\" \"i\"\n\"1\" 1 2 3 7\n",
            "% x y z i\n1D0 2.0D+00 3 7\n",
            "x,y,z,i\n1,2,3,7,,\n",
        ] {
            assert_eq!(read(text), Ok(vec![wanted]), "{text}");
        }
    }

    #[test]
    fn colours_are_not_intensities_and_empty_cells_are_not_returns() {
        assert_eq!(read("1 2 3 255 0 0"), Ok(vec![CloudPoint::hit([1.0, 2.0, 3.0])]));
        let points = read("x,y,z,time\n,,,5\nnan,nan,nan,5\n,,,").unwrap_or_default();
        assert_eq!(points.iter().map(|point| point.is_return).collect::<Vec<_>>(), [false; 3]);
        assert_eq!(points.first().map(|point| point.time_s), Some(5.0));
        for text in ["x,y,z\n,,\n1,2,3\n", ",,\n1,2,3\n", "1,2,3\n,,\n", "x\ty\tz\n1\t2\t3\n\t\t\n"] {
            assert_eq!(read(text).map(|points| points.len()), Ok(2), "{text}");
        }
    }

    #[test]
    fn absolute_times_count_from_the_first_point() {
        let points = read("timestamp[ns] x y z\n1700000000000000000 1 2 3\n1700000000250000000 1 2 3")
            .unwrap_or_default();
        assert_eq!(points.iter().map(|point| point.time_s).collect::<Vec<_>>(), [0.0, 0.25]);
    }

    #[test]
    fn invalid_rows_are_skipped() {
        for (text, reason) in [
            ("x y z intensity\n1 2 3\n1 2 3 4", "line 2: 3 columns, but 4 are needed"),
            ("1 2 3\n1 2 c\n4 5 6", "line 2: `c` is not a number"),
            ("x,y,z\n1,2,3\nx,y,z\n4,5,6", "line 3: `x` is not a number"),
            ("1 2 3\n7\n4 5 6", "line 2: 1 columns, but 3 are needed"),
        ] {
            let (points, _, unread) = read_all(text).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(unread, [reason], "{text}");
            assert_eq!(points.len(), text.lines().count() - 1 - usize::from(text.starts_with('x')), "{text}");
        }
    }

    #[test]
    fn invalid_texts_are_errors_with_line_and_word() {
        for (text, reason) in [
            ("# a\nhello world", "line 2: `hello world` is neither numbers nor column names"),
            ("Exported\n1 2 3", "line 1: `Exported` is neither"),
            ("1 2", "line 1: 2 columns; a point needs x, y and z"),
            ("1\n2\n3", "line 2: 1 columns"),
            ("x (px),y (px),z (px)\n1,2,3", "line 1: column `x (px)`: `px` is an unknown unit"),
            ("6,001,3,178,-1,000", "line 1: 6 comma-separated cells, but `001` is the fraction of a number"),
            ("x,y,z\n6,5,3,5,1,5", "line 2: 6 comma-separated cells, but there are 3 column names"),
            ("ncols 3\nnrows 2\n1 2 3", "line 1: this is a grid of heights"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }

    #[test]
    fn guesses_are_remarked() {
        for (text, remark) in [
            ("1 2 3 7", "4 columns without names: x y z intensity"),
            ("1 2 3 7 255 0 0", "7 columns without names: x y z intensity, the others are ignored"),
            ("1 2 3 255 0 0", "6 columns without names: x y z, the others are ignored"),
            ("# units: mm\n1 2 3", "line 1 contains `units: mm`, but coordinates are read as metres"),
            ("x,y,z,time\n1,2,3,12:05", "column `time` has no numbers (`12:05`) and is ignored"),
            ("t,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1", "if these are poses"),
            ("x[mm] y[mm] z[mm]\n1 2 3", "x, y and z are in mm"),
        ] {
            let (_, columns, _) = read_all(text).unwrap_or_else(|error| panic!("{error}"));
            let remarks = columns.remarks();
            assert!(remarks.len() == 1 && remarks[0].contains(remark), "{text}: {remarks:?}");
        }
        for text in ["1 2 3", "x y z i\n1 2 3 4", "# units: m\n1 2 3", "#units: mm\nx_mm,y_mm,z_mm\n1,2,3"] {
            let (_, columns, _) = read_all(text).unwrap_or_else(|error| panic!("{error}"));
            assert!(columns.remarks().iter().all(|remark| remark.contains("are in mm")), "{text}");
        }
    }

    #[test]
    fn point_counts_precede_each_scan() {
        for (text, points, remark) in [
            ("2\n1 2 3\n4 5 6\n", 2, None),
            ("2\n1 2 3\n4 5 6\n1\n7 8 9\n", 3, Some("2 scans, each with a point count")),
            ("0\n1\n1 2 3\n", 1, Some("2 scans")),
            ("3\n1 2 3\n4 5 6\n", 2, Some("announces 3 points but has 2")),
        ] {
            let (found, columns, unread) = read_all(text).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((found.len(), unread.len()), (points, 0), "{text}");
            let found = columns.last_remark();
            assert_eq!(found.is_some(), remark.is_some(), "{text}: {found:?}");
            assert!(found.is_none_or(|found| found.contains(remark.unwrap_or_default())), "{text}");
        }
    }
}

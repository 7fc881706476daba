use super::cloud::CloudPoint;
use super::columns::{Clock, Meaning};

/// What a line of a text of points is.
#[derive(Debug, PartialEq)]
pub(super) enum Line {
    Point(CloudPoint),
    /// A comment, names, an empty line, a number of points.
    Nothing,
}

/// How the lines of a text are split, and what their columns mean. Both are known with the first point.
#[derive(Debug, Default)]
pub(super) struct Columns {
    pub(super) clock: Clock,
    separator: Option<Separator>,
    pub(super) names: Vec<String>,
    meaning: Option<Meaning>,
    has_points: bool,
    has_count: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Separator {
    Blank,
    Mark(char),
}

impl Separator {
    fn of(line: &str) -> Self {
        [';', ','].into_iter().find(|mark| line.contains(*mark)).map_or(Self::Blank, Self::Mark)
    }

    /// Empty cells count, but not the one behind a last mark.
    fn split(self, line: &str) -> Vec<&str> {
        match self {
            Self::Blank => line.split_ascii_whitespace().collect(),
            Self::Mark(mark) => {
                let line = line.trim();
                line.strip_suffix(mark).unwrap_or(line).split(mark).map(str::trim).collect()
            }
        }
    }
}

impl Columns {
    /// Whether names were found.
    pub(super) fn are_named(&self) -> bool {
        !self.names.is_empty()
    }

    pub(super) fn meaning(&self) -> Option<&Meaning> {
        self.meaning.as_ref()
    }

    /// Reads the next line.
    pub(super) fn take(&mut self, line: &str) -> Result<Line, String> {
        let line = line.trim();
        if line.is_empty() {
            return Ok(Line::Nothing);
        }
        if let Some(comment) = line.strip_prefix("//").or_else(|| line.strip_prefix('#')) {
            // Some programs write the names as a comment.
            if !self.has_points && !self.are_named() {
                self.take_names(comment);
            }
            return Ok(Line::Nothing);
        }
        let separator = *self.separator.get_or_insert(Separator::of(line));
        let words = separator.split(line);
        if !self.has_points {
            let are_numbers = words.iter().all(|word| word.is_empty() || number(word).is_some());
            if !are_numbers {
                if self.take_names(line) {
                    self.separator = Some(Separator::of(line));
                    return Ok(Line::Nothing);
                }
                return Err(format!("`{line:.60}` is neither numbers nor names of columns with x, y and z"));
            }
            // PTS starts with the number of its points.
            if words.len() == 1 && !self.has_count && !self.are_named() {
                self.has_count = true;
                self.separator = None;
                return Ok(Line::Nothing);
            }
            if words.len() < 3 {
                return Err(format!("{} columns; a point has x, y and z", words.len()));
            }
            let meaning = *self.meaning.get_or_insert_with(|| by_count(words.len()));
            if !self.are_named() {
                self.names = default_names(words.len(), &meaning);
            }
            self.has_points = true;
        }
        self.point(&words).map(Line::Point)
    }

    /// Takes a line as names, if it has x, y and z.
    fn take_names(&mut self, line: &str) -> bool {
        let line = line.trim();
        let words = Separator::of(line).split(line);
        let names: Vec<String> = words.iter().map(|word| word.trim_matches('"').to_owned()).collect();
        // Livox counts nanoseconds; that a column holds integers is not known before all of it is read.
        let is_integer =
            |at: usize| names.get(at).is_some_and(|name| name.eq_ignore_ascii_case("offset_time"));
        let Some(meaning) = Meaning::of(&names, is_integer) else { return false };
        self.names = names;
        self.meaning = Some(meaning);
        true
    }

    fn point(&mut self, words: &[&str]) -> Result<CloudPoint, String> {
        let Some(meaning) = self.meaning else { return Err("x, y and z are not known".into()) };
        let value = |at: usize| -> Result<f64, String> {
            match words.get(at) {
                None => Err(format!("{} columns, {} are needed", words.len(), meaning.last() + 1)),
                Some(&"") => Ok(f64::NAN),
                Some(word) => number(word).ok_or_else(|| format!("`{word:.40}` is not a number")),
            }
        };
        let mut values = vec![0.0; meaning.last() + 1];
        let extra = meaning.intensity.into_iter().chain(meaning.time.map(|time| time.at));
        for at in meaning.xyz.into_iter().chain(extra) {
            if let Some(place) = values.get_mut(at) {
                *place = value(at)?;
            }
        }
        Ok(self.clock.point(&meaning, |at| values.get(at).copied().unwrap_or(f64::NAN)))
    }
}

/// Columns without names: x y z, then the intensity, unless the three after them are a colour or a normal.
fn by_count(columns: usize) -> Meaning {
    Meaning { xyz: [0, 1, 2], intensity: (columns > 3 && columns != 6).then_some(3), time: None }
}

fn default_names(columns: usize, meaning: &Meaning) -> Vec<String> {
    let mut names: Vec<String> = ["x", "y", "z"].map(str::to_owned).into();
    names.extend(meaning.intensity.map(|_| "intensity".to_owned()));
    names.truncate(columns);
    names
}

fn number(word: &str) -> Option<f64> {
    // `infinity` and the like are names as well as numbers to Rust; points know `nan` and `inf`.
    word.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<CloudPoint>, String> {
        let mut columns = Columns::default();
        let mut points = Vec::new();
        for line in text.lines() {
            if let Line::Point(point) = columns.take(line)? {
                points.push(point);
            }
        }
        Ok(points)
    }

    #[test]
    fn names_and_marks_of_many_programs() {
        let wanted = CloudPoint { intensity: 7.0, ..CloudPoint::hit([1.0, 2.0, 3.0]) };
        for text in [
            "1 2 3 7",
            "1\t2\t3\t7\n",
            "# made by hand\n1, 2, 3, 7,\n",
            "//X Y Z Scalar_Intensity\n1 2 3 7\n",
            "\"z\";\"intensity\";\"y\";\"x\"\n3;7;2;1\n",
            "Points:0,Points:1,Points:2,Intensity\n1,2,3,7\n",
            "1\n1 2 3 7 255 0 0\n",
        ] {
            assert_eq!(read(text), Ok(vec![wanted]), "{text}");
        }
    }

    #[test]
    fn a_colour_is_no_intensity_and_an_empty_cell_is_no_return() {
        assert_eq!(read("1 2 3 255 0 0"), Ok(vec![CloudPoint::hit([1.0, 2.0, 3.0])]));
        let points = read("x,y,z,time\n,,,5\nnan,nan,nan,5").unwrap_or_default();
        assert_eq!(points.iter().map(|point| point.is_return).collect::<Vec<_>>(), [false, false]);
        assert_eq!(points.first().map(|point| point.time_s), Some(5.0));
    }

    #[test]
    fn absolute_times_count_from_the_first_point() {
        let points = read("timestamp[ns] x y z\n1700000000000000000 1 2 3\n1700000000250000000 1 2 3")
            .unwrap_or_default();
        assert_eq!(points.iter().map(|point| point.time_s).collect::<Vec<_>>(), [0.0, 0.25]);
    }

    #[test]
    fn what_is_no_point_is_an_error() {
        for (text, reason) in [
            ("hello world", "neither numbers nor names"),
            ("1 2", "2 columns"),
            ("x y z intensity\n1 2 3", "3 columns, 4 are needed"),
            ("1 2 3\n1 2 c", "`c` is not a number"),
            ("1\n2\n3", "1 columns"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }
}

//! Splits lines of text into cells and parses their numbers.

/// Separator of the cells of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Separator {
    /// One or more blanks and tabs.
    #[default]
    Blank,
    /// A character. Cells between two separators may be empty.
    Char(char),
}

impl Separator {
    /// Detects the separator of a line. Commas separate cells unless the blank-separated words are numbers with decimal
    /// commas.
    pub(crate) fn of(line: &str) -> Self {
        let has = |mark: char| is_outside_quotes(line, mark);
        if let Some(mark) = [';', '|'].into_iter().find(|mark| has(*mark)) {
            return Self::Char(mark);
        }
        let is_decimal = |word: &str| Self::Blank.number(word).is_some() && !word.starts_with(',');
        let mut words = line.split_ascii_whitespace();
        let are_decimals = words.clone().count() > 1 && words.all(is_decimal);
        if has(',') && !are_decimals { Self::Char(',') } else { Self::Blank }
    }

    /// Detects the separator of a table row: tabs, if they give the expected number of columns.
    pub(crate) fn of_row(line: &str, columns: usize) -> Self {
        let tab = Self::Char('\t');
        if line.contains('\t') && tab.split(line).len() == columns { tab } else { Self::of(line) }
    }

    /// Splits a line into cells without their quotes. Empty cells count, also after the last separator.
    pub(crate) fn split(self, line: &str) -> Vec<&str> {
        let has_quotes = line.contains('"');
        match self {
            Self::Blank if !has_quotes => line.split_ascii_whitespace().collect(),
            Self::Blank => split_unquoted(line, |letter| letter.is_ascii_whitespace())
                .into_iter()
                .filter(|cell| !cell.is_empty())
                .map(cell_of)
                .collect(),
            Self::Char(mark) => {
                let mut line = line.trim_matches(|letter: char| letter.is_whitespace() && letter != mark);
                // Rows of Markdown and of some databases begin and end with a bar.
                if mark == '|' && line.starts_with(mark) {
                    line = line.strip_prefix(mark).unwrap_or(line);
                    line = line.strip_suffix(mark).unwrap_or(line);
                }
                if has_quotes {
                    split_unquoted(line, |letter| letter == mark).into_iter().map(cell_of).collect()
                } else {
                    line.split(mark).map(cell_of).collect()
                }
            }
        }
    }

    /// Parses the number in a cell. Decimal commas are accepted if commas are not separators.
    pub(crate) fn number(self, cell: &str) -> Option<f64> {
        if let Some(number) = number(cell) {
            return Some(number);
        }
        let (whole, fraction) = cell.split_once(',')?;
        // In a comma-separated line, a cell with a comma was quoted. Three digits after the comma may be thousands.
        let may_be_thousands = self == Self::Char(',') && fraction.len() == 3;
        let is_fraction = fraction.starts_with(|first: char| first.is_ascii_digit());
        if may_be_thousands || !is_fraction || whole.contains('.') || fraction.contains([',', '.']) {
            return None;
        }
        number(&format!("{whole}.{fraction}"))
    }
}

/// Removes empty cells at the end of a line.
pub(crate) fn without_end<'c, 'l>(cells: &'c [&'l str]) -> &'c [&'l str] {
    let end = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    cells.get(..end).unwrap_or(cells)
}

/// Returns a cell that is the fraction of a number with a decimal comma, as `001` in `6,001,3,178`.
pub(super) fn digits_behind_comma<'c>(separator: Separator, cells: &[&'c str]) -> Option<&'c str> {
    let is_integer =
        |cell: &str| !cell.is_empty() && cell.trim_start_matches('-').bytes().all(|b| b.is_ascii_digit());
    let cells = without_end(cells);
    if separator != Separator::Char(',')
        || !cells.len().is_multiple_of(2)
        || !cells.iter().all(|cell| is_integer(cell))
    {
        return None;
    }
    let is_fraction = |cell: &&&str| cell.len() > 1 && cell.starts_with('0');
    cells.iter().skip(1).step_by(2).find(is_fraction).copied()
}

/// Returns the text of a comment line, or `None` for other lines.
pub(crate) fn comment_of(line: &str) -> Option<&str> {
    let line = line.trim_start();
    ["#", "%", "//"].iter().find_map(|mark| line.strip_prefix(mark))
}

/// Parses a word as a number. Common words for a missing number give NaN.
pub(crate) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| unusual_number(word))
}

/// Parses `-nan(ind)`, `1.#QNAN` and `1.#INF` of Windows programs, `NA` of tables, and `1.5D+02` of Fortran.
#[cold]
fn unusual_number(word: &str) -> Option<f64> {
    let lower = word.trim().trim_matches(['"', '\'']).to_ascii_lowercase();
    if let Ok(number) = lower.parse() {
        return Some(number);
    }
    let (sign, plain) = match lower.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, lower.strip_prefix('+').unwrap_or(&lower)),
    };
    let is_nan = ["nan(", "1.#qnan", "1.#ind", "1.#snan", "1.#nan", "nanq", "nans", "qnan", "snan"]
        .iter()
        .any(|start| plain.starts_with(start));
    if is_nan || matches!(plain, "na" | "n/a" | "#n/a" | "<na>" | "null" | "none" | "nil") {
        return Some(f64::NAN);
    }
    if plain.starts_with("1.#inf") {
        return Some(sign * f64::INFINITY);
    }
    let (mantissa, exponent) = plain.split_once('d')?;
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let is_exponent = exponent.trim_start_matches(['+', '-']).bytes().all(|byte| byte.is_ascii_digit());
    if !is_number(mantissa) || !is_exponent {
        return None;
    }
    format!("{mantissa}e{exponent}").parse::<f64>().ok().map(|number| sign * number)
}

/// Trims blanks and quotes from a cell.
fn cell_of(cell: &str) -> &str {
    let cell = cell.trim();
    let quoted = ['"', '\''].into_iter().find_map(|quote| cell.strip_prefix(quote)?.strip_suffix(quote));
    quoted.map_or(cell, str::trim)
}

fn is_outside_quotes(line: &str, mark: char) -> bool {
    if !line.contains(mark) {
        return false;
    }
    split_unquoted(line, |letter| letter == mark).len() > 1
}

/// Splits a line at separators that are not within double quotes.
fn split_unquoted(line: &str, is_separator: impl Fn(char) -> bool) -> Vec<&str> {
    let mut is_quoted = false;
    line.split(|letter: char| {
        is_quoted ^= letter == '"';
        !is_quoted && is_separator(letter)
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_many_programs_are_split() {
        let mark = Separator::Char;
        for (line, separator, cells) in [
            ("1 2\t 3", Separator::Blank, vec!["1", "2", "3"]),
            ("1, 2 ,3,", mark(','), vec!["1", "2", "3", ""]),
            (",,", mark(','), vec!["", "", ""]),
            ("1,5;2,25;3", mark(';'), vec!["1,5", "2,25", "3"]),
            ("1,5 2,25\t3", Separator::Blank, vec!["1,5", "2,25", "3"]),
            ("\"1,5\",\"2;5\",3", mark(','), vec!["1,5", "2;5", "3"]),
            ("| 1 | 2 | 3 |", mark('|'), vec!["1", "2", "3"]),
            ("1|2|", mark('|'), vec!["1", "2", ""]),
            ("'x','y'", mark(','), vec!["x", "y"]),
            ("\"a b\" 1", Separator::Blank, vec!["a b", "1"]),
            ("1,2 3,4,5", mark(','), vec!["1", "2 3", "4", "5"]),
        ] {
            assert_eq!(Separator::of(line), separator, "{line}");
            assert_eq!(separator.split(line), cells, "{line}");
        }
        assert_eq!(Separator::of_row("1\t\t3", 3).split("1\t\t3"), ["1", "", "3"]);
        assert_eq!(Separator::of_row("\t\t", 3).split("\t\t"), ["", "", ""]);
        assert_eq!(Separator::of_row("1\t\t3", 2), Separator::Blank);
        assert_eq!(without_end(&["1", "", "2", "", ""]), ["1", "", "2"]);
        assert!(without_end(&["", ""]).is_empty());
    }

    #[test]
    fn numbers_of_many_programs_are_parsed() {
        for (word, wanted) in [
            ("1.5", Some(1.5)),
            ("-.5e1", Some(-5.0)),
            ("+2", Some(2.0)),
            ("\"3\"", Some(3.0)),
            ("-1.5D+02", Some(-150.0)),
            ("-inf", Some(f64::NEG_INFINITY)),
            ("-1.#INF", Some(f64::NEG_INFINITY)),
            ("1.#INF00", Some(f64::INFINITY)),
            ("abc", None),
            ("", None),
            ("0x10", None),
            ("1,5", None),
            ("d", None),
            ("id", None),
        ] {
            assert_eq!(number(word), wanted, "{word}");
        }
        for word in [
            "nan",
            "-NaN",
            "-nan(ind)",
            "nan(snan)",
            "1.#QNAN",
            "-1.#IND",
            "1.#IND00",
            "NA",
            "N/A",
            "null",
            "None",
            "<NA>",
        ] {
            assert!(number(word).is_some_and(f64::is_nan), "{word}");
        }
    }

    #[test]
    fn decimal_commas_are_accepted_if_commas_are_not_separators() {
        let semicolon = Separator::Char(';');
        for (separator, cell, wanted) in [
            (semicolon, "1,5", Some(1.5)),
            (semicolon, "-1,250", Some(-1.25)),
            (semicolon, "1,5e-3", Some(1.5e-3)),
            (Separator::Blank, "0,25", Some(0.25)),
            (semicolon, "1.234,5", None),
            (semicolon, "1,234,567", None),
            (Separator::Char(','), "1,25", Some(1.25)),
            // This may be one thousand two hundred and fifty.
            (Separator::Char(','), "1,250", None),
        ] {
            assert_eq!(separator.number(cell), wanted, "{cell}");
        }
    }

    #[test]
    fn comments_start_with_one_of_three_marks() {
        assert_eq!(comment_of("  # x y"), Some(" x y"));
        assert_eq!(comment_of("//X Y"), Some("X Y"));
        assert_eq!(comment_of("% t"), Some(" t"));
        assert_eq!(comment_of("1 # 2"), None);
    }
}

use super::pose_rows::{BadKind, Stamp};
use super::time_unit::stamp_of;
use crate::read::text_line::{Separator, without_end};

/// Cells of a line of text.
pub(super) struct Cells<'l> {
    pub(super) words: Vec<&'l str>,
    pub(super) separator: Separator,
}

impl Cells<'_> {
    /// Parses the numbers of these columns. All must be finite.
    pub(super) fn all(&self, columns: &[usize]) -> Result<Vec<f64>, (BadKind, String)> {
        let number = |&at: &usize| {
            let lost = |reason| (BadKind::Lost, reason);
            let found = self.words.len();
            let word = self
                .words
                .get(at)
                .ok_or_else(|| lost(format!("{found} numbers; number {} is missing", at + 1)))?;
            if word.is_empty() {
                return Err(lost(format!("column {} is empty", at + 1)));
            }
            let number = self
                .separator
                .number(word)
                .ok_or_else(|| (BadKind::Odd, format!("`{word:.40}` is not a number")))?;
            if number.is_finite() { Ok(number) } else { Err(lost(format!("`{word:.40}` is not finite"))) }
        };
        columns.iter().map(number).collect()
    }
}

/// Returns whether a line starts as a pose does: with a number, an empty cell or a common word for a missing number.
pub(super) fn starts_with_number(line: &str) -> bool {
    let separator = Separator::of(line);
    let words = separator.split(line);
    let first = words.into_iter().find(|cell| !cell.is_empty());
    let first = first.and_then(|cell| cell.split(char::is_whitespace).next());
    first.is_none_or(|word| separator.number(word).is_some())
}

/// Combines a column of whole seconds and a column of nanoseconds to a stamp.
pub(super) fn stamp_of_two(cells: &Cells<'_>, seconds: usize, nanoseconds: usize) -> Stamp {
    let whole = |at: usize| cells.words.get(at).and_then(|word| stamp_of(word, 0));
    let (Some(seconds), Some(nanoseconds @ 0..1_000_000_000)) = (whole(seconds), whole(nanoseconds)) else {
        return Stamp::Unreadable;
    };
    let stamp_ns = seconds.checked_mul(1_000_000_000).and_then(|stamp_ns| stamp_ns.checked_add(nanoseconds));
    stamp_ns.map_or(Stamp::Unreadable, Stamp::At)
}

/// Splits a line of a table into cells.
pub(super) fn cells(line: &str) -> Vec<&str> {
    let cells = Separator::of(line).split(line);
    without_end(&cells).to_vec()
}

/// Splits a line of numbers separated by commas, blanks or both.
pub(super) fn numbers(line: &str) -> Vec<&str> {
    let cells = cells(line);
    if !cells.iter().any(|cell| cell.contains(char::is_whitespace)) {
        return cells;
    }
    let parts = cells.into_iter().map(|cell| (cell, cell.split(char::is_whitespace)));
    parts.flat_map(|(cell, words)| words.filter(move |word| cell.is_empty() || !word.is_empty())).collect()
}

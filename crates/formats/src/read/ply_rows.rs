//! Elements of a PLY file in text.

use super::lines::Lines;
use super::ply_header::{Element, Property};
use super::scalar::Scalar;
use super::text_line::number;
use std::collections::VecDeque;
use voxtile::{Error, Result};

/// Reads elements, one per line. If the first line has another number of values than a vertex, the file has wrapped
/// lines; the values are then read without regard to lines.
pub(super) struct PlyRows {
    lines: Lines,
    /// One value per property.
    values: Vec<f64>,
    /// Unread words of the current line, if lines are wrapped.
    words: Option<VecDeque<String>>,
}

/// A parsed element.
pub(super) enum Row<'r> {
    /// One value per property. NaN for lists and for properties that are not read.
    Values(&'r [f64]),
    /// An element with a word that is not a number: line number and reason.
    Unread(u64, String),
}

/// Reason why a line is not an element.
enum Wrong {
    Missing(String),
    Word(String),
}

impl PlyRows {
    pub(super) fn new(lines: Lines) -> Self {
        Self { lines, values: Vec::new(), words: None }
    }

    pub(super) fn are_wrapped(&self) -> bool {
        self.words.is_some()
    }

    /// Skips all elements of a type.
    pub(super) fn pass(&mut self, element: &Element) -> Result<()> {
        for done in 0..element.count {
            let is_there = match self.are_wrapped() {
                true => self.take(element, &|_| false)?.is_some(),
                false => self.lines.pass()?,
            };
            if !is_there {
                return Err(self.cut(element, done));
            }
        }
        Ok(())
    }

    /// Reads the next element. `done` is the number of elements already read.
    pub(super) fn next(
        &mut self,
        element: &Element,
        done: u64,
        is_read: &dyn Fn(usize) -> bool,
    ) -> Result<Row<'_>> {
        if !self.are_wrapped() {
            let Some(line) = self.next_line()? else { return Err(self.cut(element, done)) };
            match values_of(element, &line, is_read, &mut self.values) {
                Ok(()) => return Ok(Row::Values(&self.values)),
                Err(Wrong::Word(reason)) => return Ok(Row::Unread(self.lines.number(), reason)),
                Err(Wrong::Missing(_)) if done == 0 => {
                    self.words = Some(line.split_ascii_whitespace().map(str::to_owned).collect());
                }
                Err(Wrong::Missing(reason)) => return Err(self.lines.error(reason)),
            }
        }
        match self.take(element, is_read)? {
            None => Err(self.cut(element, done)),
            Some(None) => Ok(Row::Values(&self.values)),
            Some(Some(reason)) => Ok(Row::Unread(self.lines.number(), reason)),
        }
    }

    /// Checks that no words of wrapped lines are left.
    pub(super) fn check_end(&mut self) -> Result<()> {
        match self.word()? {
            None => Ok(()),
            Some(word) => Err(self.lines.error(format!(
                "`{word:.40}` remains after all elements were read from wrapped lines: somewhere there is a number too \
                 few or too many"
            ))),
        }
    }

    /// Reads the words of an element. The outer `None` means the end of the file; an inner text is the reason for an
    /// invalid word.
    fn take(&mut self, element: &Element, is_read: &dyn Fn(usize) -> bool) -> Result<Option<Option<String>>> {
        self.values.clear();
        let mut wrong = None;
        for (at, property) in element.properties.iter().enumerate() {
            let Some(word) = self.word()? else { return Ok(None) };
            if property.list.is_none() {
                let value = value_of(property, &word, is_read(at));
                self.values.push(value.unwrap_or_else(|reason| {
                    wrong.get_or_insert(reason);
                    f64::NAN
                }));
                continue;
            }
            for _ in 0..length_of(&word).map_err(|reason| self.lines.error(reason))? {
                if self.word()?.is_none() {
                    return Ok(None);
                }
            }
            self.values.push(f64::NAN);
        }
        Ok(Some(wrong))
    }

    fn word(&mut self) -> Result<Option<String>> {
        loop {
            if let Some(word) = self.words.as_mut().and_then(VecDeque::pop_front) {
                return Ok(Some(word));
            }
            let Some(line) = self.next_line()? else { return Ok(None) };
            self.words = Some(line.split_ascii_whitespace().map(str::to_owned).collect());
        }
    }

    /// Returns the next line that is not blank.
    fn next_line(&mut self) -> Result<Option<String>> {
        while let Some((_, line)) = self.lines.next()? {
            if !line.trim().is_empty() {
                return Ok(Some(line));
            }
        }
        Ok(None)
    }

    fn cut(&self, element: &Element, done: u64) -> Error {
        self.lines.error(format!("the file ends after {done} of {} {}", element.count, element.name))
    }
}

/// Parses the values of a line: one per property, NaN for a list.
fn values_of(
    element: &Element,
    line: &str,
    is_read: &dyn Fn(usize) -> bool,
    values: &mut Vec<f64>,
) -> std::result::Result<(), Wrong> {
    values.clear();
    let mut words = line.split_ascii_whitespace();
    let mut wrong = None;
    for (at, property) in element.properties.iter().enumerate() {
        let missing = || Wrong::Missing(format!("the value of `{}` is missing", property.name));
        let word = words.next().ok_or_else(missing)?;
        if property.list.is_none() {
            let value = value_of(property, word, is_read(at));
            values.push(value.unwrap_or_else(|reason| {
                wrong.get_or_insert(reason);
                f64::NAN
            }));
            continue;
        }
        for _ in 0..length_of(word).map_err(Wrong::Word)? {
            words.next().ok_or_else(missing)?;
        }
        values.push(f64::NAN);
    }
    wrong.map_or(Ok(()), |reason| Err(Wrong::Word(reason)))
}

/// Parses the value of a property that is not a list.
fn value_of(property: &Property, word: &str, is_read: bool) -> std::result::Result<f64, String> {
    if !is_read {
        return Ok(f64::NAN);
    }
    let value = number(word).ok_or_else(|| format!("`{word:.40}` is not a number"))?;
    // Digits beyond the precision of a float are dropped, for equal results from text and binary files.
    Ok(if property.kind == Scalar::F32 { f64::from(value as f32) } else { value })
}

fn length_of(word: &str) -> std::result::Result<u64, String> {
    word.parse().map_err(|_| format!("`{word:.40}` is not a list length"))
}

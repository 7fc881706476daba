use anyhow::{Context, Result};
use std::path::Path;

/// A table: rounded in Markdown, in full precision as CSV.
pub struct Table {
    /// Name of the CSV file, without extension.
    pub file: &'static str,
    /// Caption, one sentence.
    pub caption: String,
    /// Whether only the CSV file is linked, as the table is too long.
    pub is_only_csv: bool,
    columns: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A whole number.
    Count(u64),
    /// A measured number, and the number of decimals in Markdown.
    Number(f64, usize),
    /// A ratio, shown as a percentage in Markdown.
    Share(f64),
}

impl Table {
    /// Creates a table without rows.
    pub fn new(
        file: &'static str,
        caption: impl Into<String>,
        columns: impl IntoIterator<Item: Into<String>>,
    ) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { file, caption: caption.into(), is_only_csv: false, columns, rows: Vec::new() }
    }

    /// Returns the table, marked to be linked as CSV only.
    pub fn only_csv(self) -> Self {
        Self { is_only_csv: true, ..self }
    }

    /// Adds a row with a cell per column.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        let row: Vec<Cell> = row.into_iter().collect();
        debug_assert_eq!(row.len(), self.columns.len(), "{}", self.file);
        self.rows.push(row);
    }

    /// Formats the table in Markdown, rounded.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let is_text =
            |column: usize| matches!(self.rows.first().map(|row| &row[column]), Some(Cell::Text(_)));
        let rule =
            (0..self.columns.len()).map(|column| if is_text(column) { "---" } else { "---:" }.to_owned());
        let mut text = line(self.columns.clone()) + &line(rule.collect());
        for row in &self.rows {
            text += &line(row.iter().map(Cell::for_reading).collect());
        }
        text
    }

    /// Writes the table as CSV into a folder, in full precision.
    pub fn write_csv(&self, folder: &Path) -> Result<()> {
        let path = folder.join(format!("{}.csv", self.file));
        let cannot = || format!("{}: cannot write", path.display());
        let mut writer = csv::Writer::from_path(&path).with_context(cannot)?;
        writer.write_record(&self.columns).with_context(cannot)?;
        for row in &self.rows {
            writer.write_record(row.iter().map(Cell::in_full)).with_context(cannot)?;
        }
        writer.flush().with_context(cannot)
    }
}

impl Cell {
    fn for_reading(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => with_spaces(*count),
            Self::Number(number, _) | Self::Share(number) if !number.is_finite() => "-".to_owned(),
            Self::Number(number, digits) => format!("{number:.digits$}"),
            Self::Share(share) => format!("{:.1} %", share * 100.0),
        }
    }

    fn in_full(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(number, _) | Self::Share(number) if !number.is_finite() => String::new(),
            // No measurement has more than six significant decimals.
            Self::Number(number, _) | Self::Share(number) => format!("{number:.6}"),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

/// Formats a number with its digits in groups of three.
fn with_spaces(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("numbers", "Some.", ["set", "voxels", "ms", "hits"]);
        table.push(["street, wet".into(), 1_234_567.into(), Cell::Number(1.25, 1), Cell::Share(0.5)]);
        table.push(["hall".into(), 12.into(), Cell::Number(f64::NAN, 1), Cell::Share(1.0)]);
        table
    }

    #[test]
    fn markdown_is_rounded() {
        let expected = "| set | voxels | ms | hits |\n| --- | ---: | ---: | ---: |\n\
                        | street, wet | 1 234 567 | 1.2 | 50.0 % |\n| hall | 12 | - | 100.0 % |\n";
        assert_eq!(table().markdown(), expected);
    }

    #[test]
    fn csv_is_in_full_and_quoted() {
        let folder = tempfile::tempdir().unwrap();
        table().write_csv(folder.path()).unwrap();
        let text = std::fs::read_to_string(folder.path().join("numbers.csv")).unwrap();
        let expected = "set,voxels,ms,hits\n\"street, wet\",1234567,1.250000,0.500000\nhall,12,,1.000000\n";
        assert_eq!(text, expected);
    }
}

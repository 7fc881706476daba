use voxtile::FormatError;

/// Counts the invalid rows of a text and keeps the first.
#[derive(Debug, Default)]
pub(super) struct SkippedRows {
    rows: u64,
    first: Option<(u64, String)>,
}

impl SkippedRows {
    pub(super) fn add(&mut self, line: u64, reason: String) {
        self.rows += 1;
        self.first.get_or_insert((line, reason));
    }

    /// Returns a remark on the skipped rows.
    pub(super) fn remark(&self) -> Option<String> {
        let (line, reason) = self.first.as_ref()?;
        let rows = if self.rows == 1 { "row is not a point" } else { "rows are not points" };
        Some(format!("{} {rows}, skipped (line {line}: {reason})", self.rows))
    }

    /// Returns the error for a text without any valid row; `None` if no row was skipped.
    pub(super) fn error(&self) -> Option<FormatError> {
        let (line, reason) = self.first.as_ref()?;
        Some(FormatError::at_line(*line, reason.clone()))
    }
}

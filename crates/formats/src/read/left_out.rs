use voxtile::FormatError;

/// Rows of a text that are no points: how many there are, and the first of them.
#[derive(Debug, Default)]
pub(super) struct LeftOut {
    rows: u64,
    first: Option<(u64, String)>,
}

impl LeftOut {
    /// Counts the row of a line.
    pub(super) fn add(&mut self, line: u64, reason: String) {
        self.rows += 1;
        self.first.get_or_insert((line, reason));
    }

    /// What a person should know of them.
    pub(super) fn remark(&self) -> Option<String> {
        let (line, reason) = self.first.as_ref()?;
        let rows = if self.rows == 1 { "row is no point" } else { "rows are no points" };
        Some(format!("{} {rows}, left out (line {line}: {reason})", self.rows))
    }

    /// The error of a text without any other row; none if nothing was left out.
    pub(super) fn error(&self) -> Option<FormatError> {
        let (line, reason) = self.first.as_ref()?;
        Some(FormatError::at_line(*line, reason.clone()))
    }
}

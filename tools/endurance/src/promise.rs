use report::{Cell, Table};
use serde::Serialize;

/// A required bound on a measured value, and the value.
#[derive(Clone, Debug, Serialize)]
pub struct Promise {
    /// Name of the measured value.
    pub what: String,
    /// Measured value.
    pub found: f64,
    /// Required bound.
    pub wanted: Wanted,
    /// Unit; empty for ratios and counts.
    pub unit: &'static str,
    /// Whether it depends on the speed and load of the machine.
    pub is_about_time: bool,
}

/// Bound on a value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Wanted {
    /// Upper bound, inclusive.
    AtMost(f64),
    /// Lower bound, inclusive.
    AtLeast(f64),
}

impl Promise {
    /// Creates a promise that does not depend on time.
    pub fn new(what: impl Into<String>, found: f64, wanted: Wanted, unit: &'static str) -> Self {
        Self { what: what.into(), found, wanted, unit, is_about_time: false }
    }

    /// Creates a promise about time.
    pub fn about_time(what: impl Into<String>, found: f64, wanted: Wanted, unit: &'static str) -> Self {
        Self { is_about_time: true, ..Self::new(what, found, wanted, unit) }
    }

    /// Returns whether the value is within its bound; NaN never is.
    pub fn is_kept(&self) -> bool {
        match self.wanted {
            Wanted::AtMost(most) => self.found <= most,
            Wanted::AtLeast(least) => self.found >= least,
        }
    }

    /// Describes a broken promise.
    pub fn complaint(&self) -> String {
        format!("{}: {}, wanted {}", self.what, self.found_text(), self.wanted.text(self.unit))
    }

    fn found_text(&self) -> String {
        let Self { found, unit, .. } = self;
        let digits = if unit.is_empty() && found.fract() == 0.0 { 0 } else { 2 };
        format!("{found:.digits$} {unit}").trim_end().to_owned()
    }
}

impl Wanted {
    fn text(self, unit: &str) -> String {
        let (sign, limit) = match self {
            Self::AtMost(most) => ("<=", most),
            Self::AtLeast(least) => (">=", least),
        };
        format!("{sign} {limit} {unit}").trim_end().to_owned()
    }
}

/// Table of promises.
pub fn table(file: &'static str, caption: &str, promises: &[Promise]) -> Table {
    let mut table = Table::new(file, caption, ["promise", "found", "wanted", "kept"]);
    for promise in promises {
        let kept = if promise.is_kept() { "yes" } else { "**no**" };
        table.push([
            Cell::Text(promise.what.clone()),
            Cell::Text(promise.found_text()),
            Cell::Text(promise.wanted.text(promise.unit)),
            kept.into(),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_inclusive_and_nan_breaks_it() {
        let kept = |found, wanted| Promise::new("it", found, wanted, "").is_kept();
        assert!(kept(4.0, Wanted::AtMost(4.0)) && !kept(4.1, Wanted::AtMost(4.0)));
        assert!(kept(0.6, Wanted::AtLeast(0.6)) && !kept(0.5, Wanted::AtLeast(0.6)));
        assert!(!kept(f64::NAN, Wanted::AtMost(4.0)) && !kept(f64::NAN, Wanted::AtLeast(4.0)));
    }

    #[test]
    fn tables_and_complaints_show_the_bound() {
        let promise = Promise::new("bytes written by bytes of the map", 4.126, Wanted::AtMost(4.0), "x");
        assert_eq!(promise.complaint(), "bytes written by bytes of the map: 4.13 x, wanted <= 4 x");
        let table = table("promises", "All.", &[promise]).markdown();
        assert!(table.contains("| 4.13 x | <= 4 x | **no** |"), "{table}");
    }
}

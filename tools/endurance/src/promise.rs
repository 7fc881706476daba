use report::{Cell, Table};
use serde::Serialize;

/// Something that voxtile is held to, and what was found.
#[derive(Clone, Debug, Serialize)]
pub struct Promise {
    /// What it is about.
    pub what: String,
    /// What was measured.
    pub found: f64,
    /// What is wanted.
    pub wanted: Wanted,
    /// What it is measured in; empty for what has no unit.
    pub unit: &'static str,
    /// Whether it depends on how fast the machine is and what else it does.
    pub is_about_time: bool,
}

/// Where a number is wanted to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Wanted {
    /// Not above this.
    AtMost(f64),
    /// Not below this.
    AtLeast(f64),
}

impl Promise {
    /// One that holds on any machine, or not.
    pub fn new(what: impl Into<String>, found: f64, wanted: Wanted, unit: &'static str) -> Self {
        Self { what: what.into(), found, wanted, unit, is_about_time: false }
    }

    /// One about time.
    pub fn about_time(what: impl Into<String>, found: f64, wanted: Wanted, unit: &'static str) -> Self {
        Self { is_about_time: true, ..Self::new(what, found, wanted, unit) }
    }

    /// Whether what was found is as wanted; what is no number is not.
    pub fn is_kept(&self) -> bool {
        match self.wanted {
            Wanted::AtMost(most) => self.found <= most,
            Wanted::AtLeast(least) => self.found >= least,
        }
    }

    /// What is to be said of a promise that was not kept.
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

/// Promises as a table.
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
    fn a_promise_is_kept_up_to_its_limit_and_never_by_what_is_no_number() {
        let kept = |found, wanted| Promise::new("it", found, wanted, "").is_kept();
        assert!(kept(4.0, Wanted::AtMost(4.0)) && !kept(4.1, Wanted::AtMost(4.0)));
        assert!(kept(0.6, Wanted::AtLeast(0.6)) && !kept(0.5, Wanted::AtLeast(0.6)));
        assert!(!kept(f64::NAN, Wanted::AtMost(4.0)) && !kept(f64::NAN, Wanted::AtLeast(4.0)));
    }

    #[test]
    fn tables_and_complaints_say_what_was_wanted() {
        let promise = Promise::new("bytes written by bytes of the map", 4.126, Wanted::AtMost(4.0), "x");
        assert_eq!(promise.complaint(), "bytes written by bytes of the map: 4.13 x, wanted <= 4 x");
        let table = table("promises", "All.", &[promise]).markdown();
        assert!(table.contains("| 4.13 x | <= 4 x | **no** |"), "{table}");
    }
}

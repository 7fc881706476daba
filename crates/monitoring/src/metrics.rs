use std::fmt::Write;

/// Media type of the text.
pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Metrics in the text format of Prometheus, version 0.0.4.
///
/// Names follow its conventions: a prefix, base units (`_seconds`, `_bytes`), and `_total` for counters.
///
/// ```
/// let mut metrics = voxtile_monitoring::Metrics::default();
/// metrics.counter("voxtile_clouds_mapped_total", "Clouds in the map.").value(7);
/// let mut dropped = metrics.counter("voxtile_clouds_dropped_total", "Clouds that are not in the map.");
/// dropped.labelled(&[("cause", "malformed")], 2);
/// assert!(metrics.text().contains("voxtile_clouds_dropped_total{cause=\"malformed\"} 2\n"));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Metrics {
    text: String,
}

/// Samples of one metric.
#[derive(Debug)]
pub struct Family<'a> {
    text: &'a mut String,
    name: &'a str,
}

impl Metrics {
    /// Begins a counter, which only increases while the process runs. Its name must end with `_total`.
    pub fn counter<'a>(&'a mut self, name: &'a str, help: &str) -> Family<'a> {
        debug_assert!(name.ends_with("_total"), "{name}");
        self.family(name, help, "counter")
    }

    /// Begins a gauge.
    pub fn gauge<'a>(&'a mut self, name: &'a str, help: &str) -> Family<'a> {
        debug_assert!(!name.ends_with("_total"), "{name}");
        self.family(name, help, "gauge")
    }

    /// Begins a summary: quantiles, sum and count of observations.
    pub fn summary<'a>(&'a mut self, name: &'a str, help: &str) -> Family<'a> {
        self.family(name, help, "summary")
    }

    /// Returns the text of all metrics.
    pub fn text(&self) -> &str {
        &self.text
    }

    fn family<'a>(&'a mut self, name: &'a str, help: &str, kind: &str) -> Family<'a> {
        debug_assert!(is_name(name), "{name}");
        let help = help.replace('\\', "\\\\").replace('\n', "\\n");
        // Writes to a string cannot fail.
        let _ = writeln!(self.text, "# HELP {name} {help}\n# TYPE {name} {kind}");
        Family { text: &mut self.text, name }
    }
}

impl Family<'_> {
    /// Adds the sample of a metric without labels.
    pub fn value(&mut self, value: impl Number) {
        self.sample("", &[], &value.text());
    }

    /// Adds a sample with labels.
    pub fn labelled(&mut self, labels: &[(&str, &str)], value: impl Number) {
        self.sample("", labels, &value.text());
    }

    /// Adds the sum and the number of the observations of a summary.
    pub fn sum_and_count(&mut self, sum: f64, count: u64) {
        self.sample("_sum", &[], &sum.text());
        self.sample("_count", &[], &count.text());
    }

    fn sample(&mut self, suffix: &str, labels: &[(&str, &str)], value: &str) {
        let Self { text, name } = self;
        text.push_str(name);
        text.push_str(suffix);
        for (number, (label, value)) in labels.iter().enumerate() {
            debug_assert!(is_name(label), "{label}");
            let value = value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
            let before = if number == 0 { "{" } else { "," };
            let _ = write!(text, "{before}{label}=\"{value}\"");
        }
        let after = if labels.is_empty() { "" } else { "}" };
        let _ = writeln!(text, "{after} {value}");
    }
}

/// Value of a sample.
pub trait Number {
    /// Returns the value as text.
    fn text(&self) -> String;
}

impl Number for u64 {
    fn text(&self) -> String {
        self.to_string()
    }
}

impl Number for f64 {
    fn text(&self) -> String {
        match *self {
            f64::INFINITY => "+Inf".to_owned(),
            f64::NEG_INFINITY => "-Inf".to_owned(),
            value => value.to_string(),
        }
    }
}

/// Returns whether a text is a valid name of a metric or a label.
fn is_name(text: &str) -> bool {
    text.starts_with(|letter: char| letter.is_ascii_lowercase())
        && text.chars().all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_numbers_are_those_of_prometheus() {
        let mut metrics = Metrics::default();
        metrics
            .gauge("a_bytes", "One \\ two\nthree")
            .labelled(&[("name", "a\"b\\c\nd"), ("k", "")], 1_u64 << 60);
        let mut numbers = metrics.gauge("b_seconds", "b");
        for value in [0.25, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e300, -1e-9] {
            numbers.value(value);
        }
        let mut summary = metrics.summary("c_seconds", "c");
        summary.labelled(&[("quantile", "0.5")], 0.5);
        summary.sum_and_count(2.0, 4);
        let text = metrics.text();
        let expected = "\
# HELP a_bytes One \\\\ two\\nthree
# TYPE a_bytes gauge
a_bytes{name=\"a\\\"b\\\\c\\nd\",k=\"\"} 1152921504606846976
# HELP b_seconds b
# TYPE b_seconds gauge
b_seconds 0.25
b_seconds +Inf
b_seconds -Inf
b_seconds NaN
";
        assert!(text.starts_with(expected), "{text}");
        assert!(text.contains("\nb_seconds -0.000000001\n"), "{text}");
        assert!(
            text.ends_with("c_seconds{quantile=\"0.5\"} 0.5\nc_seconds_sum 2\nc_seconds_count 4\n"),
            "{text}"
        );
    }
}

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// Scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Logarithmic; values of 0 and less are not shown.
    Log,
}

/// An axis for given values: its ends and ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    scale: Scale,
    ends: [f64; 2],
    ticks: Vec<f64>,
    /// Labels of the ticks 0, 1, 2 and so on instead of numbers.
    categories: Vec<String>,
}

/// Approximate maximum number of ticks.
const TICKS: f64 = 6.0;
/// Margin beyond the values, as a share of the axis.
const MARGIN: f64 = 0.04;

impl Axis {
    /// Creates an axis that shows all of these values; `from_zero` starts a linear one at 0.
    pub fn of(scale: Scale, values: impl Iterator<Item = f64>, from_zero: bool) -> Self {
        let values = values.filter(|value| value.is_finite() && (scale == Scale::Linear || *value > 0.0));
        let (mut least, mut most) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        if least > most {
            (least, most) = (1.0, 2.0);
        }
        if scale == Scale::Linear && from_zero {
            least = least.min(0.0);
        }
        if least == most {
            (least, most) = if scale == Scale::Log { (least / 2.0, most * 2.0) } else { (least, most + 1.0) };
        }
        let (ticks, ends) = match scale {
            Scale::Log => {
                let margin = (most / least).powf(MARGIN);
                (log_ticks(least, most), [least / margin, most * margin])
            }
            Scale::Linear => {
                let margin = (most - least) * MARGIN;
                (linear_ticks(least, most), [if from_zero { least } else { least - margin }, most + margin])
            }
        };
        Self { scale, ends, ticks, categories: Vec::new() }
    }

    /// Creates an axis of categories, at the values 0, 1, 2 and so on.
    pub fn of_categories(categories: Vec<String>) -> Self {
        let ticks = (0..categories.len()).map(|k| k as f64).collect();
        Self { scale: Scale::Linear, ends: [-0.6, categories.len() as f64 - 0.4], ticks, categories }
    }

    /// Returns whether the axis can show a value.
    pub fn shows(&self, value: f64) -> bool {
        value.is_finite() && (self.scale == Scale::Linear || value > 0.0)
    }

    /// Label of a tick.
    pub fn label(&self, value: f64) -> String {
        self.categories.get(value.round() as usize).cloned().unwrap_or_else(|| readable(value))
    }

    /// Position of a value, 0 to 1 from one end to the other.
    fn share(&self, value: f64) -> f64 {
        let [place, first, last] = [value, self.ends[0], self.ends[1]].map(|value| match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        });
        (place - first) / (last - first)
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        (f64::from(first) + self.share(*value) * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.ends[0]..self.ends[1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        readable(*value)
    }
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks(least: f64, most: f64) -> Vec<f64> {
    let rough = (most - least) / TICKS;
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * decade).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * decade);
    let (first, last) = ((least / step - 1e-9).ceil() as i64, (most / step + 1e-9).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

/// Powers of ten; also 2 and 5 times them if the range is small.
fn log_ticks(least: f64, most: f64) -> Vec<f64> {
    let decades = least.log10().floor() as i32..=most.log10().ceil() as i32;
    let steps: &[f64] = if (most / least).log10() < TICKS / 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let ticks = decades.flat_map(|decade| steps.iter().map(move |step| step * 10_f64.powi(decade)));
    ticks.filter(|tick| (least * 0.999..=most * 1.001).contains(tick)).collect()
}

/// Formats a tick without rounding noise, thousands as k and millions as M.
fn readable(value: f64) -> String {
    let (value, unit) = match value.abs() {
        x if x >= 999_999.5 => (value / 1e6, " M"),
        x if x >= 9_999.5 => (value / 1e3, " k"),
        _ => (value, ""),
    };
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks.iter().map(|&tick| axis.label(tick)).collect()
    }

    #[test]
    fn ticks_are_round_numbers_within_the_values() {
        assert_eq!(
            labels(&Axis::of(Scale::Linear, [3.0, 47.0].into_iter(), true)),
            ["0", "10", "20", "30", "40"]
        );
        let few_decades = Axis::of(Scale::Log, [0.0, 3.0, 70.0, f64::NAN].into_iter(), false);
        assert_eq!(labels(&few_decades), ["5", "10", "20", "50"]);
        let many_decades = Axis::of(Scale::Log, [100.0, 5e6].into_iter(), false);
        assert_eq!(labels(&many_decades), ["100", "1000", "10 k", "100 k", "1 M"]);
    }

    #[test]
    fn an_axis_needs_no_values() {
        for scale in [Scale::Linear, Scale::Log] {
            for values in [vec![], vec![7.0], vec![0.0], vec![f64::NAN]] {
                let axis = Axis::of(scale, values.iter().copied(), false);
                assert!(axis.ends[0] < axis.ends[1] && axis.ends.iter().all(|end| end.is_finite()));
                assert!(!axis.ticks.is_empty());
            }
        }
    }

    #[test]
    fn equal_factors_have_equal_lengths_on_a_logarithmic_axis() {
        let axis = Axis::of(Scale::Log, [1.0, 100.0].into_iter(), false);
        let [a, b, c] = [1.0, 10.0, 100.0].map(|value| axis.map(&value, (1000, 0)));
        assert!(a > b && b > c && (a - b - (b - c)).abs() <= 1);
        assert!(!axis.shows(0.0) && axis.shows(3.0));
    }
}

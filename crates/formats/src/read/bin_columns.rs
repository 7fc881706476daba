//! Guesses the columns of a headerless file of numbers.

use super::scalar::Scalar;

/// First bytes of a file of numbers.
pub(super) struct BinStart<'b> {
    bytes: &'b [u8],
    file_bytes: u64,
}

/// Interpretation of a file: the type of its numbers and the numbers per point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reading {
    pub(super) kind: Scalar,
    pub(super) columns: usize,
}

/// Result of judging an interpretation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// No other interpretation fits better.
    Right,
    /// Another interpretation fits clearly better.
    Other(Reading),
    /// Two other interpretations fit; the columns of one are a multiple of the other's.
    Either(Reading, Reading),
    /// Another interpretation fits as well, and the fourth column has negative values, which intensities do not have.
    Doubtful(Reading),
    /// The bytes are not little-endian floats, for instance text or big-endian numbers.
    Wrong(&'static str),
}

/// Numbers per point to try.
const COLUMNS: std::ops::RangeInclusive<usize> = 3..=8;
/// Minimum number of points that give enough evidence.
const FEW_POINTS: usize = 16;
/// Maximum ratio of the spread of the correct interpretation to that of any wrong one. Measured ratios for lidars and
/// depth cameras, also in random point order, are 0.01 to 0.3.
const CLEARLY: f64 = 0.5;
/// Numbers with a larger spread are unrelated.
const UNRELATED: f64 = 0.7;
/// Fractions of plausible values: nearly all values, or few of them.
const NEARLY_ALL: f64 = 0.98;
const HARDLY_ANY: f64 = 0.5;

impl Reading {
    pub(super) fn point_bytes(self) -> u64 {
        (self.kind.bytes() * self.columns) as u64
    }

    pub(super) fn type_name(self) -> &'static str {
        if self.kind == Scalar::F64 { "float64" } else { "float32" }
    }
}

impl<'b> BinStart<'b> {
    pub(super) fn new(bytes: &'b [u8], file_bytes: u64) -> Self {
        Self { bytes, file_bytes }
    }

    /// Judges an interpretation. In the correct one, successive values of a column are close, and values of different
    /// columns are not.
    pub(super) fn judge(&self, reading: Reading) -> Verdict {
        let is_text = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
        if self.bytes.len() >= FEW_POINTS && self.bytes.iter().all(is_text) {
            return Verdict::Wrong("it is a text file: read it with `format` xyz");
        }
        let floats = self.values(Scalar::F32, false);
        let doubles = self.values(Scalar::F64, false);
        if plausible(&floats) < NEARLY_ALL && plausible(&doubles) >= NEARLY_ALL {
            let wide = Reading { kind: Scalar::F64, columns: reading.columns };
            let spreads = Spreads::of(&doubles);
            let Some(best) = self.best(Scalar::F64, &spreads, wide) else { return Verdict::Right };
            let spread = spreads.at(best.columns).unwrap_or(f64::INFINITY);
            if let Some(multiple) = self.multiple_of(best, &spreads) {
                return Verdict::Either(best, multiple);
            }
            return if spread < UNRELATED * spreads.min_of_others(best.columns) {
                Verdict::Other(best)
            } else {
                Verdict::Wrong(
                    "its numbers are float64: give its columns, for instance `fields` x:f64,y:f64,z:f64",
                )
            };
        }
        if plausible(&floats) < HARDLY_ANY && plausible(&self.values(Scalar::F32, true)) >= NEARLY_ALL {
            return Verdict::Wrong("its numbers are big-endian: write it as little-endian, `astype('<f4')`");
        }
        if floats.len() < FEW_POINTS * reading.columns {
            return Verdict::Right;
        }
        let spreads = Spreads::of(&floats);
        let Some(own) = spreads.at(reading.columns) else { return Verdict::Right };
        let Some(best) = self.best(Scalar::F32, &spreads, reading) else { return Verdict::Right };
        let other = spreads.at(best.columns).unwrap_or(f64::INFINITY);
        let is_multiple = best.columns.is_multiple_of(reading.columns);
        if other < CLEARLY * own && !(is_multiple && own < UNRELATED) {
            return match self.multiple_of(best, &spreads) {
                Some(multiple) => Verdict::Either(best, multiple),
                None => Verdict::Other(best),
            };
        }
        let mut fourth = floats.iter().skip(3).step_by(reading.columns);
        let is_sure = own < UNRELATED * spreads.min_of_others(reading.columns);
        if !is_sure && reading.columns > 3 && fourth.any(|value| *value < 0.0) {
            return Verdict::Doubtful(best);
        }
        Verdict::Right
    }

    /// Returns an interpretation with a multiple of the columns that fits clearly better. Either it is correct, or the
    /// points alternate, as those of two lasers do.
    fn multiple_of(&self, reading: Reading, spreads: &Spreads) -> Option<Reading> {
        let spread = |columns: usize| spreads.at(columns).unwrap_or(f64::INFINITY);
        let mut multiples = (2..=COLUMNS.end() / reading.columns).map(|times| times * reading.columns);
        let columns = multiples.find(|columns| spread(*columns) < CLEARLY * spread(reading.columns))?;
        let multiple = Reading { columns, ..reading };
        self.file_bytes.is_multiple_of(multiple.point_bytes()).then_some(multiple)
    }

    /// Returns the best interpretation other than `than` that gives a whole number of points: the one with the least
    /// spread, with fewest columns among multiples.
    fn best(&self, kind: Scalar, spreads: &Spreads, than: Reading) -> Option<Reading> {
        let readings = COLUMNS.map(|columns| Reading { kind, columns });
        let fitting = readings.filter(|reading| self.file_bytes.is_multiple_of(reading.point_bytes()));
        let spread = |reading: &Reading| spreads.at(reading.columns);
        let mut best: Option<(Reading, f64)> = None;
        for reading in fitting.filter(|reading| *reading != than || kind == Scalar::F64) {
            let Some(spread) = spread(&reading) else { continue };
            let is_better = best.is_none_or(|(best, least)| {
                let is_multiple = reading.columns.is_multiple_of(best.columns) && least < UNRELATED;
                spread < UNRELATED * least && !is_multiple
            });
            if is_better {
                best = Some((reading, spread));
            }
        }
        best.map(|(reading, _)| reading)
    }

    fn values(&self, kind: Scalar, is_big: bool) -> Vec<f64> {
        self.bytes.chunks_exact(kind.bytes()).map(|bytes| kind.value(bytes, is_big)).collect()
    }
}

/// Returns the fraction of numbers that are plausible coordinates, intensities or times.
fn plausible(values: &[f64]) -> f64 {
    let numbers = values.iter().filter(|value| !value.is_nan());
    let (mut all, mut good) = (0_u32, 0_u32);
    for value in numbers {
        all += 1;
        good += u32::from(*value == 0.0 || (1e-9..=1e10).contains(&value.abs()));
    }
    if all == 0 { 1.0 } else { f64::from(good) / f64::from(all) }
}

/// Mean squared difference of numbers a given number of places apart, in units of their variance: about 1 for unrelated
/// numbers.
struct Spreads(Vec<Option<f64>>);

impl Spreads {
    fn of(values: &[f64]) -> Self {
        // Coordinates and intensities have different scales.
        let scaled: Vec<f64> = values.iter().map(|value| scaled(*value)).collect();
        let count = scaled.len() as f64;
        let mean = scaled.iter().sum::<f64>() / count;
        let variance = scaled.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        let spread = |columns: usize| {
            let pairs = scaled.iter().zip(scaled.iter().skip(columns));
            let apart: f64 = pairs.clone().map(|(one, next)| (next - one).powi(2)).sum();
            (variance > 0.0 && pairs.len() > 0).then(|| apart / pairs.len() as f64 / 2.0 / variance)
        };
        Self(COLUMNS.map(spread).collect())
    }

    fn at(&self, columns: usize) -> Option<f64> {
        self.0.get(columns.checked_sub(*COLUMNS.start())?).copied().flatten()
    }

    /// Returns the least spread over column counts that are not multiples of `columns`.
    fn min_of_others(&self, columns: usize) -> f64 {
        let others = COLUMNS.filter(|other| !other.is_multiple_of(columns));
        others.filter_map(|other| self.at(other)).fold(f64::INFINITY, f64::min)
    }
}

fn scaled(value: f64) -> f64 {
    if value.is_finite() { value.abs().ln_1p().copysign(value) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Row<'r> = &'r dyn Fn(usize) -> Vec<f64>;

    /// Deterministic pseudo-random numbers.
    fn noise(seed: usize) -> f64 {
        let mixed = (seed as u64)
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .rotate_left(31)
            .wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn bytes(kind: Scalar, points: usize, row: &dyn Fn(usize) -> Vec<f64>) -> Vec<u8> {
        let encode = |value: f64| match kind {
            Scalar::F64 => value.to_le_bytes().to_vec(),
            _ => (value as f32).to_le_bytes().to_vec(),
        };
        (0..points).flat_map(row).flat_map(encode).collect()
    }

    fn judge(bytes: &[u8], columns: usize) -> Verdict {
        BinStart::new(bytes, bytes.len() as u64).judge(Reading { kind: Scalar::F32, columns })
    }

    /// Random points of a room.
    fn room(k: usize) -> [f64; 3] {
        [6.0 * noise(3 * k) + 1.0, 8.0 * noise(3 * k + 1) - 4.0, noise(3 * k + 2) - 1.0]
    }

    fn circle(k: usize) -> [f64; 3] {
        let angle = k as f64 * 0.01;
        [20.0 * angle.cos(), 20.0 * angle.sin(), -1.5]
    }

    #[test]
    fn four_columns_are_judged_right() {
        let rows: [(&str, Row); 4] = [
            ("a room", &|k| [&room(k)[..], &[noise(k + 7)]].concat()),
            ("a circle", &|k| [&circle(k)[..], &[noise(k)]].concat()),
            ("intensities below 0", &|k| [&circle(k)[..], &[noise(k) - 0.5]].concat()),
            ("two returns by turns", &|k| {
                [&circle(k)[..], &[if k.is_multiple_of(2) { 5.0 } else { 90.0 }]].concat()
            }),
        ];
        for (what, row) in rows {
            // A number of points for which the file size fits every column count.
            assert_eq!(judge(&bytes(Scalar::F32, 840, row), 4), Verdict::Right, "{what}");
        }
        assert_eq!(judge(&bytes(Scalar::F32, 840, &|_| vec![0.0; 4]), 4), Verdict::Right);
    }

    #[test]
    fn other_columns_are_judged_right() {
        let (narrow, wide) = (Scalar::F32, Scalar::F64);
        let rows: [(&str, Scalar, usize, Row); 8] = [
            ("x y z", narrow, 3, &|k| room(k).to_vec()),
            ("x y z on a circle", narrow, 3, &|k| circle(k).to_vec()),
            ("colours", narrow, 6, &|k| [&room(k)[..], &[0.5, 0.5, 0.5]].concat()),
            ("colours up to 255", narrow, 6, &|k| {
                [&circle(k)[..], &[200.0 + noise(k), 100.0 + noise(k + 1), 50.0]].concat()
            }),
            ("intensity, laser, time", narrow, 6, &|k| {
                [&room(k)[..], &[40.0 * noise(k), (k % 128) as f64, 1e-3 * k as f64]].concat()
            }),
            ("doubles x y z", wide, 3, &|k| room(k).to_vec()),
            ("doubles x y z intensity", wide, 4, &|k| [&room(k)[..], &[noise(k)]].concat()),
            ("doubles of floats", wide, 3, &|k| room(k).map(|value| f64::from(value as f32)).to_vec()),
        ];
        for (what, kind, columns, row) in rows {
            let found = judge(&bytes(kind, 840, row), 4);
            assert_eq!(found, Verdict::Other(Reading { kind, columns }), "{what}");
        }
    }

    #[test]
    fn ambiguous_columns_are_doubtful_only_with_negative_intensity() {
        // All columns have the same distribution.
        let cube = |k: usize| [0, 1, 2].map(|axis| noise(3 * k + axis) - 0.5).to_vec();
        let three = bytes(Scalar::F32, 840, &cube);
        assert!(matches!(judge(&three, 4), Verdict::Doubtful(_)));
        let above = bytes(Scalar::F32, 840, &|k| cube(k).iter().map(|value| value + 0.5).collect());
        assert_eq!(judge(&above, 4), Verdict::Right);
    }

    #[test]
    fn alternating_points_are_not_halved() {
        let turns =
            |k: usize| [circle(k)[0], circle(k)[1], if k.is_multiple_of(2) { 2.0 } else { -2.0 }].to_vec();
        let [three, six] = [3, 6].map(|columns| Reading { kind: Scalar::F32, columns });
        assert_eq!(judge(&bytes(Scalar::F32, 840, &turns), 4), Verdict::Either(three, six));
    }

    #[test]
    fn other_kinds_of_bytes_are_reported() {
        assert!(
            matches!(judge(&b"1.5 2.5 3.5 0.5\n".repeat(40), 4), Verdict::Wrong(why) if why.contains("text"))
        );
        let big: Vec<u8> = (0..200)
            .flat_map(|k| [&room(k)[..], &[noise(k)]].concat())
            .flat_map(|v| (v as f32).to_be_bytes())
            .collect();
        assert!(matches!(judge(&big, 4), Verdict::Wrong(why) if why.contains("big-endian")));
    }
}

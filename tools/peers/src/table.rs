use Target::{AtLeast, AtMost};

pub struct Row {
    /// Name of the measurement.
    pub what: String,
    /// Name of the workload.
    pub workload: String,
    pub octomap: String,
    pub voxtile: String,
    /// OctoMap's figure divided by voxtile's: above 1, voxtile is better.
    pub ratio: Option<Ratio>,
    /// Target, and the value that is compared with it.
    pub target: Option<(Target, f64)>,
}

/// Ratio of medians, with the smallest and largest ratio of a single run.
#[derive(Clone, Copy)]
pub struct Ratio {
    pub of_medians: f64,
    pub least: f64,
    pub most: f64,
}

/// Target of a value: the floor that it must reach and, optionally, a goal.
#[derive(Clone, Copy)]
pub enum Target {
    /// For ratios.
    AtLeast(f64, Option<f64>),
    /// For bytes and nanoseconds.
    AtMost(f64, Option<f64>),
}

/// The samples of both contenders, run by run.
#[derive(Default)]
pub struct Pairs(Vec<[f64; 2]>);

impl Pairs {
    pub fn push(&mut self, octomap: f64, voxtile: f64) {
        self.0.push([octomap, voxtile]);
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn octomap(&self) -> f64 {
        median(self.0.iter().map(|pair| pair[0]).collect())
    }

    pub fn voxtile(&self) -> f64 {
        median(self.0.iter().map(|pair| pair[1]).collect())
    }

    pub fn ratio(&self) -> Ratio {
        let ratios = || self.0.iter().map(|[octomap, voxtile]| octomap / voxtile);
        Ratio {
            of_medians: self.octomap() / self.voxtile(),
            least: ratios().fold(f64::INFINITY, f64::min),
            most: ratios().fold(0.0, f64::max),
        }
    }
}

impl Ratio {
    /// Smallest and largest ratio of single runs; empty for a single run.
    fn spread(&self) -> String {
        if self.least == self.most {
            return String::new();
        }
        format!("{:.1} to {:.1}", self.least, self.most)
    }
}

impl Target {
    fn columns(&self) -> [String; 2] {
        let (sign, floor, goal) = match self {
            AtLeast(floor, goal) => ("", floor, goal),
            AtMost(floor, goal) => ("<= ", floor, goal),
        };
        [format!("{sign}{floor}"), goal.map_or(String::new(), |goal| format!("{sign}{goal}"))]
    }

    fn verdict(&self, value: f64) -> &'static str {
        let reaches = |limit: f64| match self {
            AtLeast(..) => value >= limit,
            AtMost(..) => value <= limit,
        };
        let (AtLeast(floor, goal) | AtMost(floor, goal)) = *self;
        match goal {
            _ if !reaches(floor) => "missed",
            Some(goal) if reaches(goal) => "goal",
            _ => "floor",
        }
    }
}

/// Formats the rows as a table in Markdown.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = String::from(
        "| what | workload | OctoMap | voxtile | ratio | of single runs | floor | goal | reached |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let [ratio, spread] = row
            .ratio
            .map_or_else(Default::default, |ratio| [format!("{:.1}", ratio.of_medians), ratio.spread()]);
        let [floor, goal] = row.target.map_or_else(Default::default, |(target, _)| target.columns());
        let reached = row.target.map_or("", |(target, value)| target.verdict(value));
        let Row { what, workload, octomap, voxtile, .. } = row;
        text.push_str(&format!(
            "| {what} | {workload} | {octomap} | {voxtile} | {ratio} | {spread} | {floor} | {goal} | {reached} |\n"
        ));
    }
    text
}

/// The middle value, or the mean of the two middle values; NaN without values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        count => (values[(count - 1) / 2] + values[count / 2]) / 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![9.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![9.0, 1.0, 2.0, 4.0]), 3.0);
        assert!(median(Vec::new()).is_nan());
    }

    #[test]
    fn a_target_is_missed_or_reaches_floor_or_goal() {
        let ratio = AtLeast(21.0, Some(42.0));
        assert_eq!([20.9, 21.0, 42.0].map(|value| ratio.verdict(value)), ["missed", "floor", "goal"]);
        let bytes = AtMost(16.0, Some(8.0));
        assert_eq!([16.1, 16.0, 8.0].map(|value| bytes.verdict(value)), ["missed", "floor", "goal"]);
        assert_eq!(AtMost(50.0, None).verdict(1.0), "floor");
        assert_eq!(AtLeast(15.0, None).verdict(f64::NAN), "missed");
    }

    #[test]
    fn ratios_are_of_medians_with_the_range_of_single_runs() {
        let mut pairs = Pairs::default();
        [[10.0, 1.0], [12.0, 2.0], [90.0, 3.0]]
            .into_iter()
            .for_each(|[octomap, voxtile]| pairs.push(octomap, voxtile));
        let Ratio { of_medians, least, most } = pairs.ratio();
        assert_eq!([of_medians, least, most], [6.0, 6.0, 30.0]);
    }
}

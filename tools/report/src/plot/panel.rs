use super::axis::{Axis, Scale};

/// One coordinate system of a plot.
pub struct Panel {
    /// Title above it.
    pub title: String,
    /// Label of the horizontal axis.
    pub x_label: String,
    /// Label of the vertical axis.
    pub y_label: String,
    /// Lines or bars.
    pub content: Content,
}

/// Content of a panel.
pub enum Content {
    /// Lines through points.
    Lines {
        /// Scale of the horizontal axis.
        x_scale: Scale,
        /// Scale of the vertical axis.
        y_scale: Scale,
        /// The lines.
        lines: Vec<Line>,
    },
    /// Bars.
    Bars(Bars),
}

/// A line through points.
pub struct Line {
    /// Name in the legend; the same name has the same color in all panels.
    pub name: String,
    /// The points, in the order in which they are joined; points that are not finite are left out.
    pub points: Vec<[f64; 2]>,
}

/// Bars, from 0 up.
pub struct Bars {
    /// Labels below the bars.
    pub categories: Vec<String>,
    /// Names in the legend, each with a value per category.
    pub series: Vec<(String, Vec<f64>)>,
    /// Whether the bars of a category are stacked instead of side by side.
    pub are_stacked: bool,
}

/// Share of a category's width that its bars fill.
const FILLED: f64 = 0.8;

impl Content {
    /// The two axes.
    pub fn axes(&self) -> [Axis; 2] {
        match self {
            Self::Lines { x_scale, y_scale, lines } => {
                let values =
                    |k: usize| lines.iter().flat_map(move |line| line.points.iter().map(move |p| p[k]));
                [Axis::of(*x_scale, values(0), false), Axis::of(*y_scale, values(1), true)]
            }
            Self::Bars(bars) => {
                let tops = bars.rectangles().into_iter().map(|(_, [_, [_, top]])| top);
                [Axis::of_categories(bars.categories.clone()), Axis::of(Scale::Linear, tops, true)]
            }
        }
    }

    /// The names of the legend.
    pub fn names(&self) -> Vec<&str> {
        match self {
            Self::Lines { lines, .. } => lines.iter().map(|line| line.name.as_str()).collect(),
            Self::Bars(bars) => bars.series.iter().map(|(name, _)| name.as_str()).collect(),
        }
    }
}

impl Bars {
    /// The bars: number of the series, and two opposite corners. Values that are not finite have no bar.
    pub fn rectangles(&self) -> Vec<(usize, [[f64; 2]; 2])> {
        let mut rectangles = Vec::new();
        for category in 0..self.categories.len() {
            let mut bottom = 0.0;
            for (number, (_, values)) in self.series.iter().enumerate() {
                let Some(value) = values.get(category).filter(|value| value.is_finite()) else { continue };
                let left = category as f64 - FILLED / 2.0;
                let width = FILLED / self.series.len() as f64;
                if self.are_stacked {
                    rectangles.push((number, [[left, bottom], [left + FILLED, bottom + value]]));
                    bottom += value;
                } else {
                    let left = left + width * number as f64;
                    rectangles.push((number, [[left, 0.0], [left + width, *value]]));
                }
            }
        }
        rectangles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::coord::ranged1d::Ranged;

    fn bars(are_stacked: bool) -> Bars {
        let series = vec![("a".to_owned(), vec![1.0, f64::NAN]), ("b".to_owned(), vec![2.0, 4.0])];
        Bars { categories: vec!["p".to_owned(), "q".to_owned()], series, are_stacked }
    }

    #[test]
    fn bars_are_side_by_side_or_stacked() {
        let side_by_side =
            [(0, [[-0.4, 0.0], [0.0, 1.0]]), (1, [[0.0, 0.0], [0.4, 2.0]]), (1, [[1.0, 0.0], [1.4, 4.0]])];
        assert_eq!(bars(false).rectangles(), side_by_side);
        let stacked =
            [(0, [[-0.4, 0.0], [0.4, 1.0]]), (1, [[-0.4, 1.0], [0.4, 3.0]]), (1, [[0.6, 0.0], [1.4, 4.0]])];
        assert_eq!(bars(true).rectangles(), stacked);
        let [x, y] = Content::Bars(bars(true)).axes();
        assert_eq!([x.label(0.0), x.label(1.0)], ["p", "q"]);
        assert_eq!(y.range().start, 0.0);
        assert!(y.range().end > 4.0);
    }
}

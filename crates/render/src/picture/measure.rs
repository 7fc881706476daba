use super::typeface;

/// Sizes of type, lines and spaces at a resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measure {
    /// Pixels per inch.
    dpi: f64,
}

/// Size of labels in points.
const LABEL_PT: f64 = 8.5;
/// Size of titles in points.
const TITLE_PT: f64 = 11.0;
const POINTS_PER_INCH: f64 = 72.0;
/// Width of a picture whose resolution is not set, in inches: the text of an A4 page.
const PAGE_WIDTH_IN: f64 = 6.7;
/// Pixels across that are enough for labels of legible size.
const MIN_PX: usize = 760;

/// A size of type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Type {
    /// Size in pixels per em.
    pub size_px: f64,
}

impl Measure {
    /// Returns the measure of a picture of a size in pixels: of this resolution, or else one that is as wide as a page.
    pub fn of(size_px: [usize; 2], dpi: Option<f64>) -> Self {
        let across = size_px[0].max(size_px[1] * 2 / 3).max(MIN_PX);
        Self { dpi: dpi.unwrap_or(across as f64 / PAGE_WIDTH_IN) }
    }

    pub fn dpi(self) -> f64 {
        self.dpi
    }

    /// Returns a length in pixels, at least 1.
    pub fn px(self, points: f64) -> usize {
        (self.exact_px(points).round() as usize).max(1)
    }

    /// Returns a length in fractions of pixels.
    pub fn exact_px(self, points: f64) -> f64 {
        points * self.dpi / POINTS_PER_INCH
    }

    pub fn label(self) -> Type {
        Type { size_px: self.exact_px(LABEL_PT) }
    }

    pub fn title(self) -> Type {
        Type { size_px: self.exact_px(TITLE_PT) }
    }
}

impl Type {
    /// Returns the height of capitals in pixels.
    pub fn height(self) -> usize {
        ((typeface::CAPITALS * self.size_px).round() as usize).max(1)
    }

    /// Returns the width of a text in pixels.
    pub fn width_of(self, text: &str) -> usize {
        typeface::width_of(text, self.size_px).ceil() as usize
    }

    /// Returns the start of a text that fits a width, with an ellipsis if something is omitted.
    pub fn fitted(self, text: &str, width: usize) -> String {
        if self.width_of(text) <= width {
            return text.to_owned();
        }
        let letters: Vec<char> = text.chars().collect();
        let start = |count: usize| letters[..count].iter().collect::<String>().trim_end().to_owned() + "…";
        let counts: Vec<usize> = (0..letters.len()).collect();
        let fitting = counts.partition_point(|&count| self.width_of(&start(count)) <= width);
        fitting.checked_sub(1).map_or(String::new(), start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn type_grows_with_the_picture_or_has_the_size_of_the_resolution() {
        let sizes = [1000, 2000, 8000].map(|px| Measure::of([px, 100], None).label().size_px / px as f64);
        assert!(sizes.iter().all(|size| (size - sizes[0]).abs() < 1e-12), "{sizes:?}");
        let print = Measure::of([100, 100], Some(300.0));
        assert_eq!((print.px(72.0), print.px(0.01)), (300, 1));
        assert_eq!(print.label().size_px, 8.5 * 300.0 / 72.0);
    }

    #[test]
    fn long_titles_end_with_an_ellipsis() {
        let title = Measure::of([760, 760], None).title();
        let text = "a map with a very long name, é <& 漢";
        assert_eq!(title.fitted(text, 10_000), text);
        for width in [0, 1, 30, 100, 200] {
            let fitted = title.fitted(text, width);
            assert!(title.width_of(&fitted) <= width, "{fitted}");
            assert!(fitted.is_empty() || fitted.ends_with('…'));
        }
        assert!(title.fitted(text, 200).starts_with("a map with"));
    }
}

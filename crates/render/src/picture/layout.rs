use super::legend::{Entry, legend_height};
use super::measure::Measure;
use super::options::Picture;

/// Layout of the image in pixels.
pub(super) struct Layout {
    pub width: usize,
    pub height: usize,
    pub margin: usize,
    /// Upper left corner of the map.
    pub left: usize,
    pub top: usize,
    /// First row of the legend.
    pub foot: usize,
    pub measure: Measure,
}

/// Width that the legend needs, and the margin, in points.
const MIN_WIDTH_PT: f64 = 400.0;
const MARGIN_PT: f64 = 10.0;

impl Layout {
    /// Returns the layout of a picture whose map has a size in pixels.
    pub fn of(picture: &Picture, size: [usize; 2], entries: &[Entry]) -> Self {
        let measure = Measure::of(size, picture.dpi);
        if !picture.has_legend {
            let [width, height] = size;
            return Self { width, height, margin: 0, left: 0, top: 0, foot: height, measure };
        }
        let margin = measure.px(MARGIN_PT);
        let width = size[0].max(measure.px(MIN_WIDTH_PT)) + 2 * margin;
        let top = 2 * margin + measure.title().height();
        let foot = top + size[1] + margin;
        let height = foot + legend_height(entries, width, measure) + margin;
        Self { width, height, margin, left: (width - size[0]) / 2, top, foot, measure }
    }
}

use super::canvas::Canvas;
use super::labels::{grouped, labels};
use super::measure::Measure;
use super::palette::{self, Rgb};
use super::scale::{length_label, round_length_m};
use super::theme::Theme;
use super::view::ColorBy;
use crate::{ColorMap, Layer};

/// Legend below the map.
pub struct Legend {
    pub metres_a_pixel: f64,
    /// Distance between grid lines in metres, if there are any.
    pub lines_m: Option<f64>,
    /// Names and directions of the axes in the image, right and down, of length 1 or less.
    pub axes: Vec<(&'static str, [f64; 2])>,
    /// Whether the y axis is north.
    pub has_north: bool,
    /// Whether the trajectory is drawn.
    pub has_path: bool,
    /// Whether free and unknown space are drawn.
    pub has_space: bool,
    pub scale: Scale,
    /// Further colors with their meaning, in rows below the other parts.
    pub entries: Vec<Entry>,
}

/// A color and its meaning, or a remark without a color.
pub struct Entry {
    pub color: Option<Rgb>,
    pub label: String,
}

/// Meaning of the colors.
pub enum Scale {
    /// Quantity, with the values of the first and the last color if there are any.
    Values { color_by: ColorBy, color_map: &'static ColorMap, range: Option<[f64; 2]> },
    /// Change from one state to another.
    Change,
    /// Classes of a comparison, which are entries.
    Comparison,
}

/// Lengths in points. Space at both sides:
const MARGIN: f64 = 10.0;
/// Height of the legend without entries.
const HEIGHT: f64 = 23.0;
/// Top of the first row of labels.
const FIRST_LABEL: f64 = 3.0;
/// Bottom of bars and of the second row of labels.
const BOTTOM: f64 = 21.0;
/// Top of the first row of entries.
const FIRST_ROW: f64 = 28.0;
/// Distance between rows of entries.
const ROW: f64 = 11.0;
/// Edge of a swatch, and the distance from its left border to its label.
const SWATCH: [f64; 2] = [6.0, 9.5];
/// Width of the columns of swatches.
const COLUMN: f64 = 56.0;

/// Returns the height of the legend of an image in pixels.
pub fn legend_height(entries: &[Entry], width: usize, measure: Measure) -> usize {
    match places_of(entries, width, measure).last() {
        Some([_, top]) => top + measure.px(SWATCH[0] + 2.0),
        None => measure.px(HEIGHT),
    }
}

/// Returns the upper left corners of the entries in pixels from the first row of the legend, in rows that fit the width
/// of the image.
fn places_of(entries: &[Entry], width: usize, measure: Measure) -> Vec<[usize; 2]> {
    let margin = measure.px(MARGIN);
    let (mut left, mut top) = (margin, measure.px(FIRST_ROW));
    let place = |entry: &Entry| {
        let wide = measure.px(SWATCH[1]) + measure.label().width_of(&entry.label);
        if left + wide + margin > width && left > margin {
            (left, top) = (margin, top + measure.px(ROW));
        }
        let place = [left, top];
        left += wide + measure.px(10.0);
        place
    };
    entries.iter().map(place).collect()
}

/// Returns the entry of points on moving objects.
pub fn moving_entry(points: u64) -> Entry {
    Entry { color: Some(palette::MOVING), label: format!("moving points: {}", grouped(points)) }
}

/// Where and how a legend is drawn.
pub struct Pen<'a> {
    pub canvas: &'a mut Canvas,
    /// First row of the legend.
    pub foot: usize,
    pub measure: Measure,
    pub theme: &'a Theme,
}

impl Legend {
    /// Draws axes, scale bar, free and unknown space, colors.
    pub fn draw(&self, pen: &mut Pen) {
        self.draw_axes(pen);
        self.draw_scale_bar(pen);
        let (measure, label) = (pen.measure, pen.measure.label());
        let right = pen.canvas.width() - measure.px(MARGIN);
        let bar = self.bar_width(pen.canvas.width(), measure);
        self.draw_colors(pen, [right, bar]);
        let [top, line] = pen.rows();
        let mut swatch = right.saturating_sub(bar + measure.px(COLUMN + 8.0));
        let is_of_distances = matches!(self.scale, Scale::Values { color_by: ColorBy::Distance, .. });
        let first = if is_of_distances { (pen.theme.ink, "obstacle") } else { (pen.theme.free, "free") };
        if self.has_space {
            pen.swatch([swatch, top], first.0, first.1);
            pen.swatch([swatch, line], pen.theme.ground, "unknown");
            swatch = swatch.saturating_sub(measure.px(COLUMN - 8.0));
        }
        if self.has_path {
            let color = if matches!(self.scale, Scale::Change) { pen.theme.ink } else { pen.theme.path };
            let middle = top + label.height() / 2;
            let dot = [swatch + measure.px(3.0), middle];
            pen.canvas.path(std::iter::once(dot), measure.px(1.6), color, pen.theme.ground);
            pen.canvas.text(swatch + measure.px(SWATCH[1]), top, label, pen.theme.faint_ink, "sensor");
        }
        let places = places_of(&self.entries, pen.canvas.width(), measure);
        for (entry, [left, row]) in self.entries.iter().zip(places) {
            let place = [left, pen.foot + row];
            match entry.color {
                Some(color) => pen.swatch(place, color, &entry.label),
                None => pen.canvas.text(place[0], place[1], label, pen.theme.faint_ink, &entry.label),
            }
        }
    }

    /// Draws an arrow for each axis, with its name, and the direction of north.
    fn draw_axes(&self, pen: &mut Pen) {
        let (measure, label, ink) = (pen.measure, pen.measure.label(), pen.theme.ink);
        let arm = measure.exact_px(16.0);
        // Arrows that point to the left or down need space there.
        let most = |k: usize, sign: f64| self.axes.iter().map(|(_, to)| sign * to[k]).fold(0.0, f64::max);
        let start = [
            measure.exact_px(MARGIN) + arm * most(0, -1.0),
            pen.foot as f64 + measure.exact_px(BOTTOM) - arm * most(1, 1.0),
        ];
        for (name, to) in &self.axes {
            let is_north = self.has_north && *name == "y";
            pen.arrow(start, to.map(|k| k * arm), ink);
            let name = if is_north { "y, north" } else { name };
            let length = to[0].hypot(to[1]).max(1e-9);
            let [wide, high] = [label.width_of(name), label.height()].map(|px| px as f64);
            // Beyond the tip, and above it if the arrow is steep.
            let gap = measure.exact_px(4.0);
            let tip: [f64; 2] = std::array::from_fn(|k| start[k] + to[k] * arm + to[k] / length * gap);
            let left = match to[0] / length {
                right if right > 0.5 => tip[0],
                right if right < -0.5 => tip[0] - wide,
                // A long name is aligned with its arrow.
                _ if is_north => tip[0] - 0.2 * high,
                _ => tip[0] - 0.5 * wide,
            };
            let top = if to[1] / length < -0.8 { tip[1] - high } else { tip[1] - 0.5 * high };
            pen.canvas.text(left.max(0.0) as usize, top.max(0.0) as usize, label, ink, name);
        }
    }

    fn draw_scale_bar(&self, pen: &mut Pen) {
        let (measure, label, ink) = (pen.measure, pen.measure.label(), pen.theme.ink);
        let length_m = round_length_m(pen.canvas.width() as f64 * 0.2 * self.metres_a_pixel);
        let length = ((length_m / self.metres_a_pixel).round() as usize).max(1);
        let (left, bottom) = (measure.px(MARGIN + 36.0), pen.foot + measure.px(BOTTOM));
        let [top, line] = pen.rows();
        let (thick, end) = (measure.px(1.4), measure.px(5.0));
        pen.canvas.text(left, top, label, ink, &length_label(length_m));
        pen.canvas.fill(left, bottom - thick, [length, thick], ink, 1.0);
        for at in [left, left + length.saturating_sub(measure.px(0.9))] {
            pen.canvas.fill(at, bottom - end, [measure.px(0.9), end], ink, 1.0);
        }
        if let Some(every_m) = self.lines_m {
            let text = format!("grid {}", length_label(every_m));
            pen.canvas.text(left + length + measure.px(7.0), line, label, pen.theme.faint_ink, &text);
        }
    }

    fn draw_colors(&self, pen: &mut Pen, [right, bar]: [usize; 2]) {
        let ([top, line], label) = (pen.rows(), pen.measure.label());
        let (ink, faint) = (pen.theme.ink, pen.theme.faint_ink);
        let Scale::Values { color_by, color_map, range } = &self.scale else {
            if matches!(self.scale, Scale::Comparison) {
                return;
            }
            let left = right - bar;
            pen.swatch([left, top], palette::APPEARED, "appeared");
            pen.swatch([left, line], palette::VANISHED, "vanished");
            pen.swatch([left + pen.measure.px(COLUMN), top], palette::SAME, "same");
            return;
        };
        let Some(range) = *range else {
            let name = match color_by {
                ColorBy::Layer(Layer::Colour) => "mean color of the points",
                ColorBy::Layer(Layer::Class) => "class",
                _ => return,
            };
            pen.canvas.text_before(right, top, label, faint, name);
            return;
        };
        let high = pen.measure.px(6.0);
        let bar_top = pen.foot + pen.measure.px(BOTTOM) - high;
        for x in 0..bar {
            let color = color_map.color_of(x as f64 / (bar - 1).max(1) as f64);
            pen.canvas.fill(right - bar + x, bar_top, [1, high], color, 1.0);
        }
        let (name, [low, high]) = labels(*color_by, range);
        pen.canvas.text(right - bar, top, label, ink, &low);
        pen.canvas.text_before(right, top, label, ink, &high);
        if bar >= needed_width(name, [&low, &high], pen.measure) {
            let [low, name_width, high] = [&low, name, &high].map(|text| label.width_of(text));
            let end = right - bar / 2 + (low + name_width) / 2 - high / 2;
            pen.canvas.text_before(end, top, label, faint, name);
        }
    }

    /// Returns the width of the color bar: a quarter of the picture, or up to half of it if its labels need more.
    fn bar_width(&self, width: usize, measure: Measure) -> usize {
        let needed = match &self.scale {
            Scale::Values { color_by, range: Some(range), .. } => {
                let (name, [low, high]) = labels(*color_by, *range);
                needed_width(name, [&low, &high], measure)
            }
            _ => 0,
        };
        needed.min(width / 2).max(width / 4).max(1)
    }
}

impl Pen<'_> {
    /// Returns the tops of both rows of labels.
    fn rows(&self) -> [usize; 2] {
        let bottom = self.foot + self.measure.px(BOTTOM);
        [self.foot + self.measure.px(FIRST_LABEL), bottom - self.measure.label().height()]
    }

    fn swatch(&mut self, [left, top]: [usize; 2], color: Rgb, label: &str) {
        let (edge, border) = (self.measure.px(SWATCH[0]), self.measure.px(0.4));
        self.canvas.fill(left, top, [edge; 2], self.theme.faint_ink, 1.0);
        let inner = [edge.saturating_sub(2 * border); 2];
        self.canvas.fill(left + border, top + border, inner, color, 1.0);
        let text = left + self.measure.px(SWATCH[1]);
        self.canvas.text(text, top, self.measure.label(), self.theme.faint_ink, label);
    }

    fn arrow(&mut self, start: [f64; 2], along: [f64; 2], color: Rgb) {
        let tip: [f64; 2] = std::array::from_fn(|k| start[k] + along[k]);
        let length = along[0].hypot(along[1]);
        // A direction towards the viewer is a dot.
        if length < self.measure.exact_px(2.0) {
            return;
        }
        let (width, head) = (self.measure.exact_px(0.9), self.measure.exact_px(3.2) / length);
        self.canvas.line([start, tip], width, color, 1.0);
        for side in [-0.6, 0.6] {
            let back = [-along[0] - side * along[1], -along[1] + side * along[0]];
            self.canvas.line([tip, [tip[0] + head * back[0], tip[1] + head * back[1]]], width, color, 1.0);
        }
    }
}

/// Returns the width of a name between two values in pixels, with gaps.
fn needed_width(name: &str, ends: [&str; 2], measure: Measure) -> usize {
    let label = measure.label();
    label.width_of(name) + ends.map(|end| label.width_of(end)).iter().sum::<usize>() + measure.px(10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_fill_rows() {
        let entry = |label: &str| Entry { color: Some([0; 3]), label: label.to_owned() };
        let entries = ["2 ground", "6 building", "5 high vegetation", "9 water"].map(entry);
        let measure = Measure::of([760, 760], Some(144.0));
        let places = places_of(&entries, 400, measure);
        assert_eq!(places[0], [20, 56]);
        assert!(places.windows(2).any(|pair| pair[1] == [20, pair[0][1] + 22]), "{places:?}");
        for (entry, [left, _]) in entries.iter().zip(&places) {
            assert!(left + 19 + measure.label().width_of(&entry.label) <= 380);
        }
        assert_eq!(legend_height(&entries, 400, measure), places[3][1] + 16);
        assert_eq!(places_of(&entries, 10, measure).len(), 4);
    }

    #[test]
    fn a_name_and_its_values_do_not_overlap() {
        for (width, dpi, is_named) in [(2000, 144.0, true), (600, 144.0, true), (600, 250.0, false)] {
            let (measure, color_map) = (Measure::of([width; 2], Some(dpi)), ColorMap::voxtile());
            let scale = Scale::Values { color_by: ColorBy::Height, color_map, range: Some([-12.5, 108.6]) };
            let legend = Legend {
                metres_a_pixel: 0.1,
                lines_m: None,
                axes: Vec::new(),
                has_north: false,
                has_path: false,
                has_space: true,
                scale,
                entries: Vec::new(),
            };
            let bar = legend.bar_width(width, measure);
            assert!(bar <= width / 2);
            let needed = needed_width("height", ["-12.5 m", "108.6 m"], measure);
            assert_eq!(bar >= needed, is_named, "{width}");
        }
    }
}

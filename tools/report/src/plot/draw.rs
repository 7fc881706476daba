use super::axis::Axis;
use super::panel::{Bars, Content, Line, Panel};
use anyhow::{Context, Result};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::fs;
use std::path::Path;

/// Panels side by side with a common legend, in one SVG file.
pub struct Plot {
    /// Name of the file, without extension.
    pub file: &'static str,
    /// Caption, one sentence.
    pub caption: String,
    /// The panels, in reading order.
    pub panels: Vec<Panel>,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Axis, Axis>>;

const PANEL_PIXELS: (u32, u32) = (380, 290);
const LEGEND_PIXELS: u32 = 30;
const MAX_PANELS_A_ROW: usize = 3;
/// Colors that are distinguishable with red-green blindness (Okabe and Ito).
const COLORS: [RGBColor; 8] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(120, 120, 120),
];

impl Plot {
    /// Writes the file into a folder.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(format!("{}.svg", self.file));
        let svg = self.svg().with_context(|| format!("{}: cannot draw", path.display()))?;
        fs::write(&path, svg).with_context(|| format!("{}: cannot write", path.display()))
    }

    fn svg(&self) -> Result<String> {
        let columns = match self.panels.len() {
            4 => 2,
            count => count.clamp(1, MAX_PANELS_A_ROW),
        };
        let rows = self.panels.len().div_ceil(columns).max(1);
        let width = (PANEL_PIXELS.0 * columns as u32).max(self.legend_pixels());
        let size = (width, PANEL_PIXELS.1 * rows as u32 + LEGEND_PIXELS);
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            root.fill(&WHITE)?;
            let (legend, panels) = root.split_vertically(LEGEND_PIXELS);
            self.draw_legend(&legend)?;
            for (area, panel) in panels.split_evenly((rows, columns)).iter().zip(&self.panels) {
                self.draw_panel(area, panel)?;
            }
            root.present()?;
        }
        Ok(svg)
    }

    /// The names of all panels, each once, in order.
    fn names(&self) -> Vec<&str> {
        let mut names = Vec::new();
        for name in self.panels.iter().flat_map(|panel| panel.content.names()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    fn color(&self, name: &str) -> RGBColor {
        let number = self.names().iter().position(|known| *known == name);
        COLORS[number.unwrap_or_default() % COLORS.len()]
    }

    fn legend_pixels(&self) -> u32 {
        20 + self.names().iter().map(|name| entry_pixels(name)).sum::<i32>() as u32
    }

    fn draw_legend(&self, area: &Area<'_>) -> Result<()> {
        let mut x = 20;
        for name in self.names() {
            area.draw(&Rectangle::new([(x, 10), (x + 14, 20)], self.color(name).filled()))?;
            area.draw(&Text::new(name.to_owned(), (x + 20, 8), ("sans-serif", 14)))?;
            x += entry_pixels(name);
        }
        Ok(())
    }

    fn draw_panel(&self, area: &Area<'_>, panel: &Panel) -> Result<()> {
        let [x, y] = panel.content.axes();
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, ("sans-serif", 15))
            .margin(8)
            .x_label_area_size(38)
            .y_label_area_size(58)
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart
            .configure_mesh()
            .x_desc(&panel.x_label)
            .y_desc(&panel.y_label)
            .label_style(("sans-serif", 12))
            .axis_desc_style(("sans-serif", 13))
            .light_line_style(TRANSPARENT)
            .x_label_formatter(&|value| x.label(*value))
            .y_label_formatter(&|value| y.label(*value))
            .draw()?;
        match &panel.content {
            Content::Lines { lines, .. } => {
                lines.iter().try_for_each(|line| self.draw_line(&mut chart, [&x, &y], line))
            }
            Content::Bars(bars) => self.draw_bars(&mut chart, bars),
        }
    }

    fn draw_line(&self, chart: &mut Chart<'_, '_>, [x, y]: [&Axis; 2], line: &Line) -> Result<()> {
        let color = self.color(&line.name);
        let points = line.points.iter().map(|[a, b]| (*a, *b));
        let points: Vec<(f64, f64)> = points.filter(|(a, b)| x.shows(*a) && y.shows(*b)).collect();
        chart.draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))?;
        // Long lines are distributions, whose steps need no dots.
        if points.len() <= 20 {
            chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, color.filled())))?;
        }
        Ok(())
    }

    fn draw_bars(&self, chart: &mut Chart<'_, '_>, bars: &Bars) -> Result<()> {
        let rectangles = bars.rectangles().into_iter().map(|(number, corners)| {
            let color = self.color(&bars.series[number].0);
            Rectangle::new(corners.map(|[a, b]| (a, b)), color.filled())
        });
        chart.draw_series(rectangles)?;
        Ok(())
    }
}

/// Width of a legend entry. An estimate that fits most letters: text widths need fonts.
fn entry_pixels(name: &str) -> i32 {
    40 + 7 * name.chars().count() as i32
}

#[cfg(test)]
mod tests {
    use super::super::Scale;
    use super::*;

    #[test]
    fn a_plot_has_its_titles_ticks_and_names() {
        let lines = vec![Line {
            name: "serial & co".to_owned(),
            points: vec![[1.0, 10.0], [8.0, f64::NAN], [16.0, 80.0]],
        }];
        let of_lines = Content::Lines { x_scale: Scale::Log, y_scale: Scale::Linear, lines };
        let bars = Bars {
            categories: vec!["wet".to_owned()],
            series: vec![("off".to_owned(), vec![3.0])],
            are_stacked: true,
        };
        let panels = [("first", of_lines), ("second", Content::Bars(bars))].map(|(title, content)| Panel {
            title: title.to_owned(),
            x_label: "τ".to_owned(),
            y_label: "ms".to_owned(),
            content,
        });
        let plot = Plot { file: "plot", caption: String::new(), panels: panels.into() };
        let svg = plot.svg().unwrap();
        for word in [
            "first",
            "second",
            "serial &amp; co",
            "off",
            "wet",
            "τ",
            "ms",
            "\n80\n",
            "\n10\n",
            "<polyline",
            "<circle",
        ] {
            assert!(svg.contains(word), "{word} is not in\n{svg}");
        }
        assert!(!svg.contains("NaN"));
    }
}

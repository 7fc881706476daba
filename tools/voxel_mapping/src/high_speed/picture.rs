use super::flight::Flight;
use super::forest::{Forest, WIDTH_M};
use std::fmt::Write;

const SCALE: f64 = 5.0;
/// Distance between forests, in metres.
const PITCH_M: f64 = WIDTH_M + 6.0;
const COLORS: [&str; 2] = ["#1f9e89", "#e0662f"];

/// Draws a forest from above with the flights of both maps, as a group of an SVG.
pub fn row(forest: &Forest, flights: [&Flight; 2]) -> String {
    let mut row = String::new();
    let (x, y) = (|x: f64| (x + 10.0) * SCALE, |y: f64| (PITCH_M / 2.0 - y) * SCALE);
    for tree in &forest.trees {
        let (min, max) = (tree.bounds.min, tree.bounds.max);
        let (width, height) = ((max[0] - min[0]) * SCALE, (max[1] - min[1]) * SCALE);
        let (left, top) = (x(min[0]), y(max[1]));
        let _ = write!(row, "<rect x='{left:.1}' y='{top:.1}' width='{width:.1}' height='{height:.1}'/>");
    }
    for (flight, color) in flights.into_iter().zip(COLORS) {
        let points = flight.path.iter().map(|at| format!("{:.1},{:.1}", x(at[0]), y(at[1])));
        let points: Vec<String> = points.collect();
        let _ = write!(
            row,
            "<polyline points='{}' fill='none' stroke='{color}' stroke-width='2'/>",
            points.join(" ")
        );
        if let Some(end) = flight.path.last().filter(|_| !flight.has_arrived) {
            let (x, y) = (x(end[0]), y(end[1]));
            let _ = write!(
                row,
                "<circle cx='{x:.1}' cy='{y:.1}' r='6' fill='none' stroke='{color}' stroke-width='3'/>"
            );
        }
    }
    row
}

/// Puts all forests below each other, with a legend.
pub fn page(rows: &[String]) -> String {
    let (width, height) = (220.0 * SCALE, rows.len() as f64 * PITCH_M * SCALE + 40.0);
    let mut page = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' font-family='sans-serif' \
         font-size='18'><rect width='{width}' height='{height}' fill='white'/>\
         <text x='20' y='28' fill='{}'>local map</text><text x='140' y='28' fill='{}'>window of 16 m</text>\
         <text x='320' y='28'>circle: the flight ended here</text>\n",
        COLORS[0], COLORS[1]
    );
    for (number, row) in rows.iter().enumerate() {
        let top = 40.0 + number as f64 * PITCH_M * SCALE;
        let _ = writeln!(page, "<g transform='translate(0 {top:.0})' fill='#555'>{row}</g>");
    }
    page + "</svg>\n"
}

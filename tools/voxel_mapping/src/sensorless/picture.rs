use super::forest::{Forest, LENGTH_M, WIDTH_M};
use super::robots::{Sharing, Traveller};
use std::collections::BTreeSet;
use std::fmt::Write;

const SCALE: f64 = 9.0;
const MARGIN_M: f64 = 4.0;
const COLORS: [&str; 4] = ["#b2182b", "#d6604d", "#2166ac", "#4393c3"];

/// Draws the forest from above twice: once with the shared voxels and the flights that use them, once with the flights
/// that use own sensors.
pub fn page(forest: &Forest, sharing: &Sharing, flights: [&[Traveller]; 2]) -> String {
    let (width, height) = ((LENGTH_M + 2.0 * MARGIN_M) * SCALE, (WIDTH_M + 2.0 * MARGIN_M) * SCALE);
    let mut page = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {}' font-family='sans-serif' font-size='18'>\
         <rect width='100%' height='100%' fill='white'/>",
        2.0 * height
    );
    let titles = ["sensorless: with the maps of two spotters (green: shared voxels)", "with own sensors"];
    for (number, (flights, title)) in flights.into_iter().zip(titles).enumerate() {
        let top = number as f64 * height;
        let _ = write!(page, "<g transform='translate(0 {top})'><text x='20' y='22'>{title}</text>");
        if number == 0 {
            page += &shared(sharing);
        }
        page += &trees(forest);
        flights.iter().zip(COLORS).for_each(|(flight, color)| page += &path(flight, color));
        page += "</g>\n";
    }
    page + "</svg>\n"
}

fn at(x: f64, y: f64) -> (f64, f64) {
    ((x + MARGIN_M) * SCALE, (WIDTH_M / 2.0 + MARGIN_M - y) * SCALE)
}

/// Columns of 0.3 m with a shared voxel above the ground.
fn shared(sharing: &Sharing) -> String {
    let columns: BTreeSet<[i32; 2]> = sharing
        .layers()
        .flat_map(|layer| layer.iter())
        .filter(|voxel| voxel[2] > 3)
        .map(|[x, y, _]| [x.div_euclid(3), y.div_euclid(3)])
        .collect();
    let square = |[x, y]: &[i32; 2]| {
        let (left, top) = at(f64::from(*x) * 0.3, f64::from(y + 1) * 0.3);
        format!("M{left:.0} {top:.0}h3v3h-3z")
    };
    let squares: String = columns.iter().map(square).collect();
    format!("<path d='{squares}' fill='#5aae61'/>")
}

fn trees(forest: &Forest) -> String {
    let tree = |tree: &voxtile_simulation::Solid| {
        let (min, max) = (tree.bounds.min, tree.bounds.max);
        let (left, top) = at(min[0], max[1]);
        let (width, height) = ((max[0] - min[0]) * SCALE, (max[1] - min[1]) * SCALE);
        format!(
            "<rect x='{left:.1}' y='{top:.1}' width='{width:.1}' height='{height:.1}' fill='none' stroke='#555'/>"
        )
    };
    forest.trees.iter().map(tree).collect()
}

fn path(flight: &Traveller, color: &str) -> String {
    let points: Vec<String> = flight
        .path
        .iter()
        .map(|point| at(point[0], point[1]))
        .map(|(x, y)| format!("{x:.1},{y:.1}"))
        .collect();
    format!("<polyline points='{}' fill='none' stroke='{color}' stroke-width='2'/>", points.join(" "))
}

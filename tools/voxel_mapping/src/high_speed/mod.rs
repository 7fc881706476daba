//! Table III of the paper: the same A* planner flies through synthetic forests with a local map, and with a fixed
//! window of 16 m around the robot. The picture shows every forest from above with both flights.
//!
//! The simulation compares planning ranges only: it moves a point with limited acceleration, not a drone.

mod flight;
mod forest;
mod picture;
mod window;

use flight::{Flight, fly};
use forest::Forest;
use std::fs;
use std::path::Path;
use voxtile::{Result, Scan};
use voxtile_local::{LocalMap, LocalParameters, LocalView};
use window::Window;

const RESOLUTION_M: f64 = 0.1;
/// Inflation of obstacles: half of the drone's width, and a margin for deviations from the path.
const INFLATION_M: f64 = 0.6;

/// A map that a planner can use.
trait PlannersMap {
    /// Inserts a scan.
    fn insert(&mut self, scan: &Scan) -> Result<()>;
    /// View for the planner.
    fn view(&self) -> &LocalView;
    /// Memory of the map alone, in bytes.
    fn bytes(&self) -> usize;
}

impl PlannersMap for LocalMap {
    fn insert(&mut self, scan: &Scan) -> Result<()> {
        self.insert_scan(scan).map(drop)
    }

    fn view(&self) -> &LocalView {
        LocalMap::view(self)
    }

    fn bytes(&self) -> usize {
        LocalMap::bytes(self)
    }
}

/// Flies through `forests` forests, prints the table and writes the picture.
pub fn run(forests: u64, picture: &Path) -> anyhow::Result<()> {
    let mut flights: [Vec<Flight>; 2] = Default::default();
    let mut drawn = Vec::new();
    for seed in 0..forests {
        let forest = Forest::new(seed);
        // Parameters of the paper: 50 000 voxels, no limit of input or inflation range.
        let parameters = LocalParameters::passive_perception().with_inflation_radius(INFLATION_M);
        flights[0].push(fly(&forest, &mut LocalMap::new(RESOLUTION_M, parameters)?)?);
        flights[1].push(fly(&forest, &mut Window::new()?)?);
        let both = flights.each_ref().map(|of_map| of_map.last().expect("one was just flown"));
        drawn.push(picture::row(&forest, both));
        eprintln!("forest {seed}: {}", both.map(|flight| flight.to_string()).join("  |  "));
    }
    println!("| map | d_fly (m) | t_fly (s) | speed (m/s) | t_cal (ms) | collisions | arrived | map (MB) |");
    println!("|---|---|---|---|---|---|---|---|");
    for (name, flights) in ["local map", "robocentric, 16 m"].into_iter().zip(&flights) {
        println!("| {name} | {} |", summary(flights));
    }
    fs::write(picture, picture::page(&drawn))?;
    println!("picture: {}", picture.display());
    Ok(())
}

/// Means of length, time and speed over the flights that arrived; other means over all flights.
fn summary(flights: &[Flight]) -> String {
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    let arrived = || flights.iter().filter(|flight| flight.has_arrived);
    let length_m = mean(&mut arrived().map(|flight| flight.length_m));
    let time_s = mean(&mut arrived().map(|flight| flight.time_s));
    let planning_ms = mean(&mut flights.iter().map(|flight| flight.planning_ms));
    let collisions = mean(&mut flights.iter().map(|flight| f64::from(u8::from(flight.has_collided))));
    let bytes = flights.iter().map(|flight| flight.map_bytes).max().unwrap_or_default();
    format!(
        "{length_m:.1} | {time_s:.1} | {:.1} | {planning_ms:.2} | {collisions:.1} | {} of {} | {:.1}",
        length_m / time_s.max(1e-9),
        arrived().count(),
        flights.len(),
        bytes as f64 / 1e6
    )
}

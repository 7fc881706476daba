//! Table II of the paper: travellers without sensors fly around the trees of synthetic forests with the maps that two
//! spotters share. For comparison, other travellers use their own sensors without sharing. The picture shows the first
//! forest from above.
//!
//! The simulation shows that a shared map is enough for planning: it moves points at the paper's 3 m/s that do not
//! avoid each other.

mod forest;
mod picture;
mod robots;

use forest::Forest;
use robots::{Sensing, Sharing, Traveller};
use std::fs;
use std::path::Path;
use std::time::Duration;

const RESOLUTION_M: f64 = 0.1;
/// Interval of plans, and of the scans of a spotter (5 Hz).
const STEP: Duration = Duration::from_millis(200);
/// Maximum number of steps of a flight. A longer flight counts as not arrived.
const MAX_STEPS: u32 = 600;
/// Number of steps of the spotters before the travellers start.
const HEAD_START_STEPS: u32 = 25;

struct Outcome {
    travellers: Vec<Traveller>,
    /// Bytes per second between the robots, or from the sensors at 16 bytes per point.
    bytes_per_s: f64,
}

/// Flies through `forests` forests, prints the table and writes the picture.
pub fn run(forests: u64, picture: &Path) -> anyhow::Result<()> {
    let mut outcomes: [Vec<Outcome>; 2] = Default::default();
    for seed in 0..forests {
        let forest = Forest::new(seed);
        let mut sharing = Sharing::new(seed)?;
        outcomes[0].push(by_shared_map(&forest, &mut sharing)?);
        outcomes[1].push(by_own_sensor(&forest)?);
        if seed == 0 {
            let page =
                picture::page(&forest, &sharing, [&outcomes[0][0].travellers, &outcomes[1][0].travellers]);
            fs::write(picture, page)?;
        }
        eprintln!("forest {seed} is done");
    }
    println!("| setup | d_fly (m) | t_fly (s) | t_cal (ms) | collisions a flight | arrived | kB/s |");
    println!("|---|---|---|---|---|---|---|");
    for (name, outcomes) in ["sensorless, two spotters", "own sensor"].into_iter().zip(&outcomes) {
        println!("| {name} | {} |", summary(outcomes));
    }
    println!("picture: {}", picture.display());
    Ok(())
}

/// Flies with the shared maps of two spotters.
fn by_shared_map(forest: &Forest, sharing: &mut Sharing) -> voxtile::Result<Outcome> {
    let mut travellers = Traveller::four()?;
    for step in 0..MAX_STEPS {
        let middle =
            travellers.iter().map(|traveller| traveller.at[0]).sum::<f64>() / travellers.len() as f64;
        sharing.step(forest, middle, step)?;
        for traveller in travellers.iter_mut().filter(|traveller| !traveller.is_over()) {
            traveller.receive(sharing)?;
            if step >= HEAD_START_STEPS {
                traveller.fly(forest);
            }
        }
        if travellers.iter().all(Traveller::is_over) {
            break;
        }
    }
    let bytes_per_s = sharing.bytes_per_s();
    Ok(Outcome { travellers, bytes_per_s })
}

/// Flies with the travellers' own sensors of 10 m range.
fn by_own_sensor(forest: &Forest) -> voxtile::Result<Outcome> {
    let mut travellers = Traveller::four()?;
    let (mut points, mut steps) = (0, 0);
    for step in 0..MAX_STEPS {
        for (number, traveller) in
            travellers.iter_mut().enumerate().filter(|(_, traveller)| !traveller.is_over())
        {
            // 10 Hz: two scans per step.
            for half in 0..2 {
                let sensing = Sensing::ONBOARD;
                points += traveller.scan(forest, sensing, u64::from(step) * 16 + number as u64 * 2 + half)?;
            }
            traveller.fly(forest);
        }
        steps += 1;
        if travellers.iter().all(Traveller::is_over) {
            break;
        }
    }
    let bytes_per_s = 16.0 * points as f64 / (f64::from(steps) * STEP.as_secs_f64());
    Ok(Outcome { travellers, bytes_per_s })
}

/// Means of lengths and times over the flights that arrived; other means over all flights.
fn summary(outcomes: &[Outcome]) -> String {
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let all = || outcomes.iter().flat_map(|outcome| &outcome.travellers);
    let arrived = || all().filter(|traveller| traveller.has_arrived);
    format!(
        "{:.1} | {:.1} | {:.2} | {:.2} | {} of {} | {:.1}",
        mean(arrived().map(|traveller| traveller.length_m).collect()),
        mean(arrived().map(|traveller| f64::from(traveller.steps) * STEP.as_secs_f64()).collect()),
        mean(all().map(Traveller::planning_ms).collect()),
        mean(all().map(|traveller| f64::from(u8::from(traveller.has_collided))).collect()),
        arrived().count(),
        all().count(),
        mean(outcomes.iter().map(|outcome| outcome.bytes_per_s / 1e3).collect()),
    )
}

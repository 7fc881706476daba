//! A robot node: one thread receives scans, another one plans: `cargo run --release --example robot_node`.

use std::sync::mpsc;
use std::thread;
use std::time::Duration;
use voxtile::{MapConfig, MapOptions, Mapper, Queries, Scan, Shape, UnknownAs};
use voxtile_simulation::Survey;

const SCANS: usize = 40;

fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let folder = std::env::temp_dir().join(format!("voxtile_robot_node_{}", std::process::id()));
    let config = MapConfig::new(0.2, 10.0)?.with_range(0.5, 60.0);
    let options = MapOptions::new().config(config).create_if_missing(true).memory_bytes(128 << 20);
    let mut mapper = options.open(&folder)?;
    let reader = mapper.reader()?;
    let (sensor, scans) = mpsc::sync_channel::<Scan>(4);
    let (goal, goals) = mpsc::channel();

    thread::scope(|scope| {
        // Driver of the lidar, which waits if mapping falls behind.
        scope.spawn(move || Survey::demo(1).take(SCANS).try_for_each(|scan| sensor.send(scan)));

        // Planner, 40 times a second. It does not wait for flushes.
        let planner = scope.spawn(move || -> voxtile::Result<(u32, u32)> {
            let (mut checked, mut blocked) = (0, 0);
            while let Some(at) = goals.iter().next() {
                let at: [f64; 3] = at;
                let view = reader.view(); // All queries of this round see the same scan.
                for ahead_m in [2.0, 5.0, 10.0] {
                    let body =
                        Shape::SweptSphere { from: at, to: [at[0], at[1] + ahead_m, at[2]], radius_m: 0.4 };
                    checked += 1;
                    blocked += u32::from(view.collision(&body, UnknownAs::Free)?.is_some());
                }
                thread::sleep(Duration::from_millis(25));
            }
            Ok((checked, blocked))
        });

        for (number, scan) in scans.iter().enumerate() {
            mapper.insert_scan(&scan)?;
            goal.send(scan.origin)?;
            if number % 10 == 9 {
                mapper.flush()?; // The scans so far survive a crash.
            }
        }
        drop(goal);
        let (checked, blocked) = planner.join().map_err(|_| "the planner panicked")??;
        println!("{SCANS} scans mapped; {blocked} of {checked} paths blocked");
        Ok::<_, Box<dyn std::error::Error + Send + Sync>>(())
    })?;
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}

use crate::{Arguments, recorded};
use anyhow::Result;
use report::Stopwatch;
use voxtile::{InMemoryMapper, Mapper};
use voxtile_distance::{DistanceOptions, LiveDistances, MapDistances, UnknownRule};

/// Box around the robot.
const SIZE_M: [f64; 3] = [40.0, 40.0, 8.0];

pub fn measure(arguments: &Arguments) -> Result<()> {
    for unknown in [UnknownRule::Unknown, UnknownRule::Free] {
        let options = DistanceOptions::new(arguments.cap).with_unknown(unknown);
        let mut map = InMemoryMapper::new(recorded::config(arguments)?)?;
        let mut live = LiveDistances::new(SIZE_M, options)?;
        let (mut moved_ms, mut update_ms, mut rows) = (Vec::new(), Vec::new(), 0);
        recorded::for_each_scan(arguments, |scan| {
            map.insert_scan(scan)?;
            let clock = Stopwatch::start()?;
            let update = live.update(&map, scan.origin)?;
            let milliseconds = 1e3 * clock.stop()?.cpu_s();
            if update.has_moved {
                moved_ms.push(milliseconds)
            } else {
                update_ms.push(milliseconds)
            }
            rows += update.changed_rows;
            Ok(())
        })?;
        let field = live.field().expect("a recorded set has scans");
        let voxels = field.voxel_box();
        let metres = |k: i32| f64::from(k) * arguments.resolution;
        let region = voxtile::Aabb { min: voxels.min.map(metres), max: voxels.end.map(metres) };
        let is_equal = map.distance_field(&region, options)?.to_array() == field.to_array();
        let count = update_ms.len() + moved_ms.len();
        println!(
            "| `{}` | {} | {} | {} | {} | {:.1} | {:.1} | {:.1} | {} | {:.1} | {} |",
            recorded::name(arguments),
            arguments.resolution,
            arguments.cap,
            format!("{unknown:?}").to_lowercase(),
            rows / count.max(1),
            quantile(&mut update_ms, 0.5),
            quantile(&mut update_ms, 0.95),
            quantile(&mut update_ms, 1.0),
            moved_ms.len(),
            quantile(&mut moved_ms, 0.5),
            if is_equal { "yes" } else { "**no**" },
        );
    }
    Ok(())
}

fn quantile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    values.get((part * last).round() as usize).copied().unwrap_or(f64::NAN)
}

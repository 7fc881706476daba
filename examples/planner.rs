//! Checks a path against the archive, the local map and both combined: `cargo run --release --example planner`.

use voxtile::{InMemoryMapper, MapConfig, Mapper, Queries, Shape, United, UnknownAs};
use voxtile_local::{LocalMap, LocalParameters, Obstacle};
use voxtile_simulation::Survey;

const ROBOT_RADIUS_M: f64 = 0.4;

/// Returns the first blocked leg of a path, and the voxel that blocks it.
fn blocked(map: &dyn Queries, path: &[[f64; 3]]) -> voxtile::Result<Option<(usize, [f64; 3])>> {
    for (leg, ends) in path.windows(2).enumerate() {
        let body = Shape::SweptSphere { from: ends[0], to: ends[1], radius_m: ROBOT_RADIUS_M };
        if let Some(hit) = map.collision(&body, UnknownAs::Free)? {
            return Ok(Some((leg, hit.center_m)));
        }
    }
    Ok(None)
}

fn main() -> voxtile::Result<()> {
    let mut archive = InMemoryMapper::new(MapConfig::new(0.2, 10.0)?.with_range(0.5, 60.0))?;
    let mut local = LocalMap::new(0.2, LocalParameters::local_mapping())?;
    let scans: Vec<_> = Survey::demo(1).take(20).collect();
    for (number, scan) in scans.iter().enumerate() {
        archive.insert_scan(scan)?;
        // The local map receives only the end of the drive.
        if number >= 15 {
            local.insert_scan(scan)?;
        }
    }
    let view = local.reader().view();
    let inflated = view.obstacles(Obstacle::Inflated);
    let both = United::new(&[&inflated, &archive])?;

    let along: Vec<_> = scans.iter().map(|scan| scan.origin).collect();
    let [x, y, z] = along[10];
    let across = vec![[x, y, z], [x + 40.0, y, z]];
    for (name, path) in [("along the drive", along), ("across the houses", across)] {
        for (map, name_of_map) in
            [(&archive as &dyn Queries, "the archive"), (&inflated, "the local map"), (&both, "both")]
        {
            match blocked(map, &path)? {
                None => println!("{name}: free by {name_of_map}"),
                Some((leg, at)) => println!("{name}: leg {leg} is blocked at {at:.1?} by {name_of_map}"),
            }
        }
    }
    Ok(())
}

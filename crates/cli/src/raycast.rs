use crate::args::RaycastArgs;
use crate::json;
use crate::part::point_of;
use std::io::Write;
use std::process::ExitCode;
use voxtile::Queries;
use voxtile::query::{RayQuery, UnknownAs};
use voxtile_pipeline::read_any_map;

pub fn run(args: &RaycastArgs) -> anyhow::Result<ExitCode> {
    let query = RayQuery {
        origin: point_of(&args.origin),
        direction: point_of(&args.direction),
        max_range_m: args.max_range,
        unknown: if args.unknown_blocks { UnknownAs::Obstacle } else { UnknownAs::Free },
    };
    let hit = read_any_map(&args.map, |reader| Ok(reader.cast_ray(&query)?))?;
    let mut out = std::io::stdout().lock();
    match hit {
        _ if args.json => json::print(&serde_json::json!({ "hit": hit }), &mut out)?,
        None => writeln!(out, "no hit")?,
        Some(hit) => {
            let [x, y, z] = hit.center_m;
            let what = match hit.probability {
                Some(probability) => format!("occupied, probability {probability:.4}"),
                None => "unknown".to_owned(),
            };
            writeln!(out, "hit at {:.3} m: voxel with center {x:.3} {y:.3} {z:.3}, {what}", hit.distance_m)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

use serde::Serialize;
use voxtile::mapper::MapView;
use voxtile::space::Point;
use voxtile::{MapQueries, Occupancy};

/// State of a map at a point.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// The queried point.
    pub point_m: Point,
    /// `unknown`, `free` or `occupied`.
    pub state: &'static str,
    /// Probability of being occupied; `None` if unknown.
    pub probability: Option<f64>,
    /// Log-odds of being occupied; `None` if unknown.
    pub log_odds: Option<f64>,
    /// Number of updates of the voxel; `None` if unknown.
    pub observation_count: Option<i32>,
    /// Center of the voxel; `None` if unknown.
    pub voxel_center_m: Option<Point>,
}

/// Returns the state of a map at a point.
///
/// # Errors
///
/// As for [`MapQueries::voxel_at`].
pub fn answer_at(map: &impl MapView, point: Point) -> voxtile::Result<Answer> {
    let grid = map.config().grid;
    let voxel = map.voxel_at(point)?;
    let occupancy = Occupancy::of(map.config(), voxel.map(|voxel| voxel.evidence));
    Ok(Answer {
        point_m: point,
        state: state_of(&occupancy),
        probability: occupancy.probability(),
        log_odds: voxel.map(|voxel| voxel.evidence.log_odds),
        observation_count: voxel.map(|voxel| voxel.evidence.observation_count),
        voxel_center_m: grid.voxel_of(point).map(|voxel| grid.center_m(voxel)),
    })
}

fn state_of(occupancy: &Occupancy) -> &'static str {
    match occupancy {
        Occupancy::Unknown => "unknown",
        Occupancy::Free(_) => "free",
        Occupancy::Occupied(_) => "occupied",
    }
}

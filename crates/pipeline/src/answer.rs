use serde::Serialize;
use std::collections::BTreeMap;
use voxtile::mapper::MapView;
use voxtile::space::Point;
use voxtile::{MapConfig, MapQueries, Occupancy, VoxelLayers};

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
    /// Layers of the voxel; `None` if no point hit it, or the map has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layers: Option<LayersAnswer>,
}

/// Layers of a voxel. A value that no point has is absent.
#[derive(Debug, Serialize)]
pub struct LayersAnswer {
    /// Number of points that hit the voxel.
    pub points: u64,
    /// Mean red, green and blue, 0 to 255.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour: Option<[u8; 3]>,
    /// Mean intensity, in the unit of the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intensity: Option<f64>,
    /// Standard deviation of the intensities.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intensity_deviation: Option<f64>,
    /// Votes for each class.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub classes: BTreeMap<u8, u64>,
    /// Time stamp of the first scan with a hit, in nanoseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_ns: Option<i64>,
    /// Time stamp of the last scan with a hit, in nanoseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_ns: Option<i64>,
    /// Mean of the points in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_m: Option<Point>,
    /// Covariance of the points in square metres: xx, yy, zz, xy, xz and yz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance_m2: Option<[f64; 6]>,
}

impl LayersAnswer {
    fn of(made: &VoxelLayers, config: &MapConfig, center_m: Point) -> Self {
        let (layers, edge_m) = (config.layers(), config.grid.resolution_m());
        let mean = made.mean_offset(&layers);
        Self {
            points: made.points,
            colour: made.mean_colour(),
            intensity: made.mean_intensity(&layers),
            intensity_deviation: made.intensity_deviation(&layers),
            classes: made.classes.iter().map(|votes| (votes.class, votes.votes)).collect(),
            first_ns: made.time.map(|time| time.first_ns),
            last_ns: made.time.map(|time| time.last_ns),
            mean_m: mean.map(|mean| std::array::from_fn(|k| center_m[k] + mean[k] * edge_m)),
            covariance_m2: made.covariance(&layers).map(|all| all.map(|k| k * edge_m * edge_m)),
        }
    }
}

/// Returns the state of a map at a point.
///
/// # Errors
///
/// As for [`MapQueries::voxel_at`].
pub fn answer_at(map: &impl MapView, point: Point) -> voxtile::Result<Answer> {
    let grid = map.config().grid;
    let voxel = map.voxel_at(point)?;
    let center_m = grid.voxel_of(point).map(|voxel| grid.center_m(voxel));
    let layers = map.layers_at(point)?.zip(center_m);
    let occupancy = Occupancy::of(map.config(), voxel.map(|voxel| voxel.evidence));
    Ok(Answer {
        point_m: point,
        state: state_of(&occupancy),
        probability: occupancy.probability(),
        log_odds: voxel.map(|voxel| voxel.evidence.log_odds),
        observation_count: voxel.map(|voxel| voxel.evidence.observation_count),
        voxel_center_m: center_m,
        layers: layers.map(|(made, center_m)| LayersAnswer::of(&made, map.config(), center_m)),
    })
}

fn state_of(occupancy: &Occupancy) -> &'static str {
    match occupancy {
        Occupancy::Unknown => "unknown",
        Occupancy::Free(_) => "free",
        Occupancy::Occupied(_) => "occupied",
    }
}

use super::outlet::Outlet;
use super::publishing::POLL_EVERY;
use crate::frontiers::Frontiers;
use crate::live_map::{LiveMap, MapVersion, Moment};
use crate::messages::{Color, Header, Marker, MarkerArray, Pose, PoseArray};
use crate::transport::{Transport, TypeName};
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use voxtile_compare::{Frontier, FrontierOptions, frontiers_in};

/// Publisher of the frontiers around the sensor, in a thread of its own: for rviz as markers, like those of
/// explore_lite; for planners as poses.
pub struct FrontierPublisher {
    map: Arc<LiveMap>,
    frontiers: Frontiers,
    markers: Outlet<MarkerArray>,
    goals: Outlet<PoseArray>,
    begun: Option<Instant>,
    /// The frontiers of a version, for both topics.
    last: Option<(MapVersion, Vec<Frontier>)>,
}

impl FrontierPublisher {
    /// # Errors
    ///
    /// The transport cannot create the publishers.
    pub fn new(transport: &mut Transport, map: Arc<LiveMap>, frontiers: Frontiers) -> anyhow::Result<Self> {
        let (markers, poses) =
            (TypeName::new("visualization_msgs", "MarkerArray"), TypeName::new("geometry_msgs", "PoseArray"));
        Ok(Self {
            map,
            frontiers,
            markers: Outlet::new(transport, "frontiers", markers)?,
            goals: Outlet::new(transport, "frontier_goals", poses)?,
            begun: None,
            last: None,
        })
    }

    pub fn run(&mut self, stop: &AtomicBool) {
        while !stop.load(Ordering::Relaxed) {
            self.refresh();
            std::thread::sleep(POLL_EVERY);
        }
    }

    /// Publishes a new version at the interval of the parameters.
    fn refresh(&mut self) {
        let is_wanted = self.markers.is_wanted() || self.goals.is_wanted();
        if !is_wanted || self.begun.is_some_and(|begun| begun.elapsed() < self.frontiers.every) {
            return;
        }
        self.begun = Some(Instant::now());
        let Self { map, frontiers, last, .. } = self;
        let moment = map.moment();
        self.markers.refresh(moment.version, || {
            Ok(markers(found(map, frontiers, &moment, last)?, &map.header(&moment)))
        });
        self.goals.refresh(moment.version, || {
            Ok(goals(found(map, frontiers, &moment, last)?, map.header(&moment)))
        });
    }
}

/// Returns the frontiers of the present version.
fn found<'a>(
    map: &LiveMap,
    frontiers: &Frontiers,
    moment: &Moment,
    last: &'a mut Option<(MapVersion, Vec<Frontier>)>,
) -> anyhow::Result<&'a [Frontier]> {
    let version = moment.version;
    if last.as_ref().is_none_or(|(of, _)| *of != version) {
        let region = frontiers.around(moment.sensor_m);
        let mut found = frontiers_in(&map.view(), &region, &FrontierOptions::default())?;
        found.retain(|frontier| frontier.area_m2 >= frontiers.min_area_m2);
        *last = Some((version, found));
    }
    Ok(last.as_ref().map_or(&[], |(_, found)| found))
}

/// Returns a sphere at the goal of each frontier, whose cross section is the frontier's area, and a cube around its
/// voxels. They replace those of the previous message.
fn markers(frontiers: &[Frontier], header: &Header) -> MarkerArray {
    let mut markers = vec![Marker::that_deletes_all(header.clone())];
    for frontier in frontiers {
        let id = i32::try_from(frontier.number).unwrap_or(i32::MAX);
        let edge_m = 2.0 * (frontier.area_m2 / PI).sqrt();
        let sphere = Marker::sphere(header.clone(), [edge_m; 3], GOAL, goal(frontier));
        markers.push(sphere.named("goals", id));
        let bounds = &frontier.bounds_m;
        let size_m = std::array::from_fn(|k| bounds.max[k] - bounds.min[k]);
        let center_m = std::array::from_fn(|k| 0.5 * (bounds.min[k] + bounds.max[k]));
        let cube = Marker::cube(header.clone(), size_m, BOX, center_m);
        markers.push(cube.named("boxes", id));
    }
    MarkerArray { markers }
}

const GOAL: Color = Color { r: 0.1, g: 0.4, b: 1.0, a: 0.8 };
const BOX: Color = Color { r: 0.1, g: 0.4, b: 1.0, a: 0.15 };

fn goals(frontiers: &[Frontier], header: Header) -> PoseArray {
    PoseArray { header, poses: frontiers.iter().map(|frontier| Pose::at(goal(frontier))).collect() }
}

fn goal(frontier: &Frontier) -> [f64; 3] {
    frontier.goal_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, Scan};

    #[test]
    fn markers_and_goals_have_the_frontiers() {
        let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0).unwrap()).unwrap();
        let scan = Scan { origin: [0.05; 3], points: vec![[2.05, 0.05, 0.05]], intensities: None };
        map.insert_scan(&scan).unwrap();
        let region = Aabb { min: [-1.0; 3], max: [1.0; 3] };
        let found = frontiers_in(&map, &region, &FrontierOptions::default()).unwrap();
        let MarkerArray { markers } = markers(&found, &Header::default());
        let names: Vec<(&str, i32)> = markers.iter().map(|marker| (marker.ns.as_str(), marker.id)).collect();
        assert_eq!(names, [("", 0), ("goals", 1), ("boxes", 1)]);
        let area_m2 = PI * (markers[1].scale[0] / 2.0).powi(2);
        assert!((area_m2 - 0.41).abs() < 1e-9, "{area_m2}");
        let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-9);
        assert!(near(markers[2].scale, [1.0, 0.1, 0.1]), "{:?}", markers[2]);
        let goals = goals(&found, Header::default()).poses;
        assert!(goals.len() == 1 && near(goals[0].position, [0.45, 0.05, 0.05]), "{goals:?}");
    }
}

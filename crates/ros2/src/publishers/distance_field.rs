use super::occupied_voxels::MAX_VOXELS;
use super::outlet::Outlet;
use super::publishing::POLL_EVERY;
use crate::distances::Distances;
use crate::live_map::LiveMap;
use crate::messages::{Header, PointCloud2};
use crate::transport::{Transport, TypeName};
use anyhow::ensure;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use voxtile::space::VoxelBox;
use voxtile_distance::{Distance, DistanceField, LiveDistances};

/// Topic of the distances.
pub(super) const DISTANCE_FIELD: &str = "distance_field";

/// Publisher of the distances around the sensor. They are computed only while the topic has a subscriber, in a thread of
/// its own: a large box takes longer than the interval of other topics.
pub struct DistancePublisher {
    map: Arc<LiveMap>,
    distances: Distances,
    outlet: Outlet<PointCloud2>,
    live: Option<LiveDistances>,
    begun: Option<Instant>,
}

impl DistancePublisher {
    /// # Errors
    ///
    /// The transport cannot create the publisher.
    pub fn new(transport: &mut Transport, map: Arc<LiveMap>, distances: Distances) -> anyhow::Result<Self> {
        let kind = TypeName::new("sensor_msgs", "PointCloud2");
        let outlet = Outlet::new(transport, DISTANCE_FIELD, kind)?;
        Ok(Self { map, distances, outlet, live: None, begun: None })
    }

    pub fn run(&mut self, stop: &AtomicBool) {
        while !stop.load(Ordering::Relaxed) {
            self.refresh();
            std::thread::sleep(POLL_EVERY);
        }
    }

    /// Publishes a new version at the interval of the parameters.
    fn refresh(&mut self) {
        if !self.outlet.is_wanted() {
            self.live = None;
            return;
        }
        if self.begun.is_some_and(|begun| begun.elapsed() < self.distances.every) {
            return;
        }
        self.begun = Some(Instant::now());
        let (map, live, distances) = (&self.map, &mut self.live, self.distances);
        let moment = map.moment();
        self.outlet.refresh(moment.version, || {
            let live = match live {
                Some(live) => live,
                None => live.insert(LiveDistances::new(distances.size_m(), distances.options())?),
            };
            live.update(&map.view(), moment.sensor_m)?;
            match live.field() {
                Some(field) => cloud(&field, map.header(&moment)),
                None => Ok(PointCloud2::of_values(map.header(&moment), "distance", [])),
            }
        });
    }
}

/// Returns the centers of the voxels whose distance is known and within the cap, with the distance.
///
/// # Errors
///
/// More voxels than a message may contain.
fn cloud(field: &DistanceField, header: Header) -> anyhow::Result<PointCloud2> {
    let (VoxelBox { min, end }, grid) = (field.voxel_box(), field.grid());
    let mut points = Vec::new();
    for x in min[0]..end[0] {
        for y in min[1]..end[1] {
            for z in min[2]..end[2] {
                let distance = field.voxel([x, y, z]).in_metres(grid.resolution_m());
                if let Distance::Within(distance_m) = distance {
                    points.push((grid.center_m([x, y, z]), distance_m as f32));
                }
            }
        }
    }
    ensure!(
        points.len() <= MAX_VOXELS,
        "{} voxels exceed the limit of {MAX_VOXELS} per message: use a smaller --distance-radius or --distance-height",
        points.len()
    );
    Ok(PointCloud2::of_values(header, "distance", points))
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, Scan};
    use voxtile_distance::{DistanceOptions, MapDistances};

    #[test]
    fn a_cloud_has_the_known_voxels_within_the_cap() {
        let mut map = InMemoryMapper::new(MapConfig::new(0.5, 10.0).unwrap()).unwrap();
        let scan = Scan { origin: [0.25; 3], points: vec![[4.25, 0.25, 0.25]], intensities: None };
        map.insert_scan(&scan).unwrap();
        let region = Aabb { min: [-1.0; 3], max: [6.0; 3] };
        let field = map.distance_field(&region, DistanceOptions::new(1.0)).unwrap();
        let cloud = cloud(&field, Header::default()).unwrap();
        let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!((names, cloud.width, cloud.point_step), (vec!["x", "y", "z", "distance"], 3, 16));
        let values: Vec<f32> =
            cloud.data.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
        let rows: Vec<&[f32]> = values.chunks_exact(4).collect();
        assert_eq!(rows, [[3.25, 0.25, 0.25, 1.0], [3.75, 0.25, 0.25, 0.5], [4.25, 0.25, 0.25, 0.0]]);
    }
}

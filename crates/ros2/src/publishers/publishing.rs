use super::Extent;
use super::changing::Changing;
use super::diagnosing::Diagnosing;
use super::distance_field::DISTANCE_FIELD;
use super::local_obstacles::local_obstacles;
use super::occupied_voxels::{cloud, markers, occupied_voxels};
use super::octomap::octomap;
use super::outlet::Outlet;
use super::projected_map::projected_map;
use crate::args::Args;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use crate::messages::{MarkerArray, OccupancyGrid, Octomap, PointCloud2};
use crate::transport::{Transport, TypeName};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use voxtile::octree::OctreeFormat;
use voxtile_local::Obstacle;

/// Publishing thread. It reads views, so the mapper never waits for it.
pub struct Publishing {
    inbox: Arc<Inbox>,
    map: Arc<LiveMap>,
    every: Duration,
    extent: Extent,
    projected: Extent,
    octomap_binary: Outlet<Octomap>,
    octomap_full: Outlet<Octomap>,
    centers: Outlet<PointCloud2>,
    markers: Outlet<MarkerArray>,
    projected_map: Outlet<OccupancyGrid>,
    local_occupied: Outlet<PointCloud2>,
    local_inflated: Outlet<PointCloud2>,
    changing: Changing,
    diagnosing: Diagnosing,
}

/// Topics of clouds that the node publishes.
pub const PUBLISHED_CLOUDS: [&str; 5] = [CENTERS, CHANGES, LOCAL_OCCUPIED, LOCAL_INFLATED, DISTANCE_FIELD];
const MARKERS: &str = "occupied_cells_vis_array";
const PROJECTED_MAP: &str = "projected_map";
const CENTERS: &str = "octomap_point_cloud_centers";
const CHANGES: &str = "octomap_point_cloud_changes";
const LOCAL_OCCUPIED: &str = "local_occupied";
const LOCAL_INFLATED: &str = "local_inflated";
/// Interval between checks of the stop flag.
pub(super) const POLL_EVERY: Duration = Duration::from_millis(20);

impl Publishing {
    /// # Errors
    ///
    /// Invalid rates or lengths, or a transport that cannot create a publisher.
    pub fn new(
        args: &Args,
        transport: &mut Transport,
        inbox: Arc<Inbox>,
        map: Arc<LiveMap>,
    ) -> anyhow::Result<Self> {
        let octomap = TypeName::new("octomap_msgs", "Octomap");
        let cloud = TypeName::new("sensor_msgs", "PointCloud2");
        Ok(Self {
            every: args.publish_every()?,
            extent: args.extent()?,
            projected: args.projected_extent()?,
            octomap_binary: Outlet::new(transport, "octomap_binary", octomap)?,
            octomap_full: Outlet::new(transport, "octomap_full", octomap)?,
            centers: Outlet::new(transport, CENTERS, cloud)?,
            markers: Outlet::new(transport, MARKERS, TypeName::new("visualization_msgs", "MarkerArray"))?,
            projected_map: Outlet::new(transport, PROJECTED_MAP, TypeName::new("nav_msgs", "OccupancyGrid"))?,
            local_occupied: Outlet::new(transport, LOCAL_OCCUPIED, cloud)?,
            local_inflated: Outlet::new(transport, LOCAL_INFLATED, cloud)?,
            changing: Changing::new(transport, CHANGES)?,
            diagnosing: Diagnosing::new(transport, &args.node_name)?,
            inbox,
            map,
        })
    }

    pub fn run(&mut self, stop: &AtomicBool) {
        let mut begun = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if begun.elapsed() >= self.every {
                begun = Instant::now();
                self.refresh();
            }
            self.diagnosing.refresh(&self.inbox, &self.map);
            std::thread::sleep(POLL_EVERY);
        }
    }

    /// Publishes new versions. Each message uses a view of its own, which is dropped as soon as possible.
    fn refresh(&mut self) {
        let (map, extent) = (&self.map, &self.extent);
        let moment = map.moment();
        let version = moment.version;
        let around = extent.around(moment.sensor_m);
        let header = || map.header(&moment);
        self.octomap_binary.refresh(version, || octomap(&map.view(), &around, OctreeFormat::Bt, header()));
        self.octomap_full.refresh(version, || octomap(&map.view(), &around, OctreeFormat::Ot, header()));
        self.centers.refresh(version, || cloud(&map.view(), &around, extent, header()));
        self.markers.refresh(version, || markers(&map.view(), &around, extent, header()));
        let occupied = || occupied_voxels(&map.view(), &around, extent);
        self.changing.refresh(version, map.grid(), &around, header(), map.layers().colour, occupied);
        let is_wanted = self.local_occupied.is_wanted() || self.local_inflated.is_wanted();
        map.local().set_wanted(is_wanted);
        if let Some(view) = map.local().view() {
            let cloud = |obstacle| local_obstacles(&view, &around, obstacle, header());
            self.local_occupied.refresh(version, || cloud(Obstacle::Occupied));
            self.local_inflated.refresh(version, || cloud(Obstacle::Inflated));
        }
        let around = self.projected.around(moment.sensor_m);
        self.projected_map
            .refresh(version, || projected_map(&map.view(), &around, &self.projected, header()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn layouts_show_published_topics() {
        let assert_is_published = |topic: &str| {
            let published = [MARKERS, PROJECTED_MAP, CENTERS, CHANGES, LOCAL_OCCUPIED, LOCAL_INFLATED];
            assert!(topic.strip_prefix('/').is_some_and(|name| published.contains(&name)), "{topic}");
        };
        let foxglove: Value =
            serde_json::from_str(include_str!("../../layouts/voxtile.foxglove.json")).unwrap();
        let panels = &foxglove["configById"];
        for panel in ["first", "second"] {
            assert!(panels[foxglove["layout"][panel].as_str().unwrap()].is_object(), "{panel}");
        }
        let shown = panels["3D!voxtile"]["topics"].as_object().unwrap();
        shown.keys().for_each(|topic| assert_is_published(topic));
        let rviz: Value = serde_saphyr::from_str(include_str!("../../layouts/voxtile.rviz")).unwrap();
        let displays = rviz["Visualization Manager"]["Displays"].as_array().unwrap();
        let topics: Vec<&Value> =
            displays.iter().map(|display| &display["Topic"]).filter(|topic| topic.is_object()).collect();
        assert_eq!(topics.len(), 4);
        for topic in topics {
            assert_is_published(topic["Value"].as_str().unwrap());
            // Volatile subscriptions would miss the last message.
            assert_eq!(topic["Durability Policy"], "Transient Local");
        }
    }
}

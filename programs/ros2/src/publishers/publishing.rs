use super::Extent;
use super::changing::Changing;
use super::diagnosing::Diagnosing;
use super::local_obstacles::local_obstacles;
use super::occupied_voxels::{cloud, markers, occupied_voxels};
use super::octomap::octomap;
use super::outlet::Outlet;
use super::projected_map::projected_map;
use crate::args::Args;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use crate::messages::{MarkerArray, OccupancyGrid, Octomap, PointCloud2};
use ros2_client::Node;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use voxtile::local::Obstacle;
use voxtile::octree::OctreeFormat;

/// The thread that publishes the map, beside the mapper: it reads views, for which no mapper waits.
pub struct Publishing {
    node: Node,
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

/// How long it sleeps before it looks whether it is to end.
const NAP: Duration = Duration::from_millis(20);

impl Publishing {
    /// # Errors
    ///
    /// Rates and lengths that are none; DDS refuses.
    pub fn new(args: &Args, mut node: Node, inbox: Arc<Inbox>, map: Arc<LiveMap>) -> anyhow::Result<Self> {
        let octomap = ["octomap_msgs", "Octomap"];
        let cloud = ["sensor_msgs", "PointCloud2"];
        let names = args.names()?;
        Ok(Self {
            every: args.publish_every()?,
            extent: args.extent()?,
            projected: args.projected_extent()?,
            octomap_binary: Outlet::new(&mut node, &names, "octomap_binary", octomap)?,
            octomap_full: Outlet::new(&mut node, &names, "octomap_full", octomap)?,
            centers: Outlet::new(&mut node, &names, "octomap_point_cloud_centers", cloud)?,
            markers: Outlet::new(
                &mut node,
                &names,
                "occupied_cells_vis_array",
                ["visualization_msgs", "MarkerArray"],
            )?,
            projected_map: Outlet::new(&mut node, &names, "projected_map", ["nav_msgs", "OccupancyGrid"])?,
            local_occupied: Outlet::new(&mut node, &names, "local_occupied", cloud)?,
            local_inflated: Outlet::new(&mut node, &names, "local_inflated", cloud)?,
            changing: Changing::new(&mut node, &names, "octomap_point_cloud_changes")?,
            diagnosing: Diagnosing::new(&mut node, &args.node_name)?,
            node,
            inbox,
            map,
        })
    }

    /// Publishes until it is told to stop.
    pub fn run(&mut self, stop: &AtomicBool) {
        let mut begun = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if begun.elapsed() >= self.every {
                begun = Instant::now();
                self.refresh();
            }
            self.diagnosing.refresh(&self.node, &self.inbox, &self.map);
            std::thread::sleep(NAP);
        }
    }

    /// Each message has a view of its own, which is held no longer than it takes.
    fn refresh(&mut self) {
        let (map, node, extent) = (&self.map, &self.node, &self.extent);
        let moment = map.moment();
        let version = moment.version;
        let around = extent.around(moment.sensor_m);
        let header = || map.header(&moment);
        self.octomap_binary
            .refresh(node, version, || octomap(&map.view(), &around, OctreeFormat::Bt, header()));
        self.octomap_full
            .refresh(node, version, || octomap(&map.view(), &around, OctreeFormat::Ot, header()));
        self.centers.refresh(node, version, || cloud(&map.view(), &around, extent, header()));
        self.markers.refresh(node, version, || markers(&map.view(), &around, extent, header()));
        let occupied = || occupied_voxels(&map.view(), &around, extent);
        self.changing.refresh(node, version, map.grid(), &around, header(), occupied);
        let is_wanted = self.local_occupied.is_wanted(node) || self.local_inflated.is_wanted(node);
        map.local().want(is_wanted);
        if let Some(view) = map.local().view() {
            let cloud = |obstacle| local_obstacles(&view, &around, obstacle, header());
            self.local_occupied.refresh(node, version, || cloud(Obstacle::Occupied));
            self.local_inflated.refresh(node, version, || cloud(Obstacle::Inflated));
        }
        let around = self.projected.around(moment.sensor_m);
        self.projected_map
            .refresh(node, version, || projected_map(&map.view(), &around, &self.projected, header()));
    }
}

use super::Extent;
use super::diagnosing::Diagnosing;
use super::occupied_voxels::{cloud, markers};
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
        Ok(Self {
            every: args.publish_every()?,
            extent: args.extent()?,
            projected: args.projected_extent()?,
            octomap_binary: Outlet::new(&mut node, "octomap_binary", octomap)?,
            octomap_full: Outlet::new(&mut node, "octomap_full", octomap)?,
            centers: Outlet::new(&mut node, "octomap_point_cloud_centers", cloud)?,
            markers: Outlet::new(
                &mut node,
                "occupied_cells_vis_array",
                ["visualization_msgs", "MarkerArray"],
            )?,
            projected_map: Outlet::new(&mut node, "projected_map", ["nav_msgs", "OccupancyGrid"])?,
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
        let around = self.projected.around(moment.sensor_m);
        self.projected_map
            .refresh(node, version, || projected_map(&map.view(), &around, &self.projected, header()));
    }
}

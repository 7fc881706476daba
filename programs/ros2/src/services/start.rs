use super::servers::Servers;
use super::{Order, Orders, octomaps, queries};
use crate::args::Args;
use crate::live_map::LiveMap;
use crate::messages::{BoxRequest, Empty, Outcome, SnapshotRequest};
use ros2_client::Node;
use rustdds::DomainParticipant;
use std::sync::Arc;
use voxtile::SnapshotName;
use voxtile::octree::OctreeFormat;

/// Makes all services of the node.
///
/// # Errors
///
/// DDS refuses; lengths that are none.
pub fn start(
    args: &Args,
    participant: &DomainParticipant,
    node: &mut Node,
    map: &Arc<LiveMap>,
    orders: &Orders,
) -> anyhow::Result<()> {
    let names = args.names()?;
    let servers = &mut Servers { participant, node, names: &names, rmw: args.rmw };
    change_the_map(servers, orders)?;
    let extent = args.extent()?;
    for (name, format) in [("octomap_binary", OctreeFormat::Bt), ("octomap_full", OctreeFormat::Ot)] {
        let map = map.clone();
        servers.serve(name, ["octomap_msgs", "GetOctomap"], move |request| {
            octomaps::around_sensor(&map, &extent, format, request)
        })?;
    }
    let its_map = map.clone();
    servers.serve("~/octomap_in_box", ["voxtile_msgs", "GetOctomapInBox"], move |request| {
        octomaps::in_box(&its_map, request)
    })?;
    let its_map = map.clone();
    servers.serve("~/cast_ray", ["voxtile_msgs", "CastRay"], move |request| {
        queries::cast_ray(&its_map, request)
    })?;
    let its_map = map.clone();
    servers.serve("~/check_collision", ["voxtile_msgs", "CheckCollision"], move |request| {
        queries::check_collision(&its_map, request)
    })
}

fn change_the_map(servers: &mut Servers<'_>, orders: &Orders) -> anyhow::Result<()> {
    let its_orders = orders.clone();
    servers.serve("~/save", ["std_srvs", "Trigger"], move |_: Empty| {
        Outcome::from(its_orders.place(Order::Save))
    })?;
    // These two responses cannot say what is wrong.
    let tell = |what: &str, result: Result<String, String>| match result {
        Ok(done) => log::info!("{what}: {done}"),
        Err(why) => log::warn!("{what}: not done: {why}"),
    };
    let its_orders = orders.clone();
    servers.serve("~/reset", ["std_srvs", "Empty"], move |_: Empty| {
        tell("reset", its_orders.place(Order::Reset));
        Empty::default()
    })?;
    let its_orders = orders.clone();
    servers.serve("~/clear_bbox", ["octomap_msgs", "BoundingBoxQuery"], move |request: BoxRequest| {
        tell("clear_bbox", its_orders.place(Order::Clear(request.region())));
        Empty::default()
    })?;
    for (name, order) in
        [("~/snapshot", Order::Snapshot as fn(SnapshotName) -> Order), ("~/revert", Order::Revert)]
    {
        let its_orders = orders.clone();
        servers.serve(name, ["voxtile_msgs", "Snapshot"], move |request: SnapshotRequest| {
            let name = SnapshotName::new(request.name).map_err(|error| error.to_string());
            Outcome::from(name.and_then(|name| its_orders.place(order(name))))
        })?;
    }
    Ok(())
}

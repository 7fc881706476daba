use super::{Order, Orders, esdf, octomaps, queries};
use crate::args::Args;
use crate::live_map::LiveMap;
use crate::messages::{BoxRequest, Empty, EsdfRequest, Outcome, SnapshotRequest};
use crate::transport::{Transport, TypeName};
use std::sync::Arc;
use voxtile::SnapshotName;
use voxtile::octree::OctreeFormat;

/// Starts all services of the node.
///
/// # Errors
///
/// The transport cannot create a service, or invalid lengths.
pub fn start(
    args: &Args,
    transport: &mut Transport,
    map: &Arc<LiveMap>,
    orders: &Orders,
) -> anyhow::Result<()> {
    change_the_map(transport, orders)?;
    let (extent, max_bytes) = (args.extent()?, transport.max_response_bytes());
    for (name, format) in [("octomap_binary", OctreeFormat::Bt), ("octomap_full", OctreeFormat::Ot)] {
        let map = map.clone();
        transport.serve(name, TypeName::new("octomap_msgs", "GetOctomap"), move |request| {
            octomaps::around_sensor(&map, &extent, format, max_bytes, request)
        })?;
    }
    let live = map.clone();
    transport.serve(
        "~/octomap_in_box",
        TypeName::new("voxtile_msgs", "GetOctomapInBox"),
        move |request| octomaps::in_box(&live, max_bytes, request),
    )?;
    let live = map.clone();
    transport.serve("~/cast_ray", TypeName::new("voxtile_msgs", "CastRay"), move |request| {
        queries::cast_ray(&live, request)
    })?;
    let live = map.clone();
    transport.serve(
        "~/check_collision",
        TypeName::new("voxtile_msgs", "CheckCollision"),
        move |request| queries::check_collision(&live, request),
    )?;
    let (live, distances) = (map.clone(), args.distances()?);
    transport.serve(
        "~/get_esdf_and_gradient",
        TypeName::new("nvblox_msgs", "EsdfAndGradients"),
        move |request: EsdfRequest| esdf::in_box(&live, &distances, max_bytes, &request),
    )
}

fn change_the_map(transport: &mut Transport, orders: &Orders) -> anyhow::Result<()> {
    let queue = orders.clone();
    transport.serve("~/save", TypeName::new("std_srvs", "Trigger"), move |_: Empty| {
        Outcome::from(queue.place(Order::Save))
    })?;
    // The responses of reset and clear_bbox have no field for an error.
    let log_result = |what: &str, result: Result<String, String>| match result {
        Ok(done) => log::info!("{what}: {done}"),
        Err(why) => log::warn!("{what}: failed: {why}"),
    };
    let queue = orders.clone();
    transport.serve("~/reset", TypeName::new("std_srvs", "Empty"), move |_: Empty| {
        log_result("reset", queue.place(Order::Reset));
        Empty::default()
    })?;
    let queue = orders.clone();
    transport.serve(
        "~/clear_bbox",
        TypeName::new("octomap_msgs", "BoundingBoxQuery"),
        move |request: BoxRequest| {
            log_result("clear_bbox", queue.place(Order::Clear(request.region())));
            Empty::default()
        },
    )?;
    for (name, order) in
        [("~/snapshot", Order::Snapshot as fn(SnapshotName) -> Order), ("~/revert", Order::Revert)]
    {
        let queue = orders.clone();
        transport.serve(
            name,
            TypeName::new("voxtile_msgs", "Snapshot"),
            move |request: SnapshotRequest| {
                let name = SnapshotName::new(request.name).map_err(|error| error.to_string());
                Outcome::from(name.and_then(|name| queue.place(order(name))))
            },
        )?;
    }
    Ok(())
}

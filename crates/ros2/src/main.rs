//! ROS 2 node `voxtile_ros2`: maps point clouds and transforms from DDS or Zenoh into a voxtile map. It needs no ROS
//! installation.
//!
//! ```text
//! Transport -> CloudQueue, TransformBuffer           node: one thread per topic
//! CloudQueue -> cloud with its pose -> Mapper        mapping: one thread
//! Transport -> corrected path -> Mapping -> Remapping   one thread per path, concurrent with mapping
//! LiveMap -> messages -> Transport                   publishers: one thread
//! Transport -> orders -> Mapping, queries -> LiveMap  services: one thread per service
//! CloudQueue, LiveMap -> /metrics, /health           monitor: one thread, and one per request
//! ```

mod args;
mod arrival_watch;
mod clearing_rule;
mod cloud;
mod cloud_points;
mod cloud_poses;
mod cloud_queue;
mod cloud_reader;
mod corrections;
mod counters;
mod distances;
mod drop_warnings;
mod first_map;
mod frame_owners;
mod frontiers;
mod ground_filter;
mod health;
mod inbox;
mod latencies;
mod layer_list;
mod layer_warnings;
mod listen_address;
mod live_map;
mod local_mapping;
mod local_share;
mod log_format;
mod logging;
mod mapping;
mod messages;
mod monitor;
mod names;
mod node;
mod parameters;
mod parent_warnings;
mod point_limits;
mod pose_miss;
mod pose_watch;
mod publishers;
mod refusal;
mod remapping;
mod repeated;
mod services;
mod stamp_check;
mod stop_signals;
mod transform_buffer;
mod transport;
mod when_behind;

use args::Args;
use inbox::Inbox;
use mapping::Mapping;
use monitor::MonitorServer;
use parameters::{Parsed, Remark};
use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    // Use one malloc arena, so that --memory holds: DDS and the mapper run many threads.
    voxtile::begin_with_one_heap();
    let arguments: Vec<_> = std::env::args_os().collect();
    if let Some(code) = monitor::health_command(&arguments) {
        return code;
    }
    let Parsed { args, remarks } = parameters::parse(&arguments).unwrap_or_else(|error| error.exit());
    logging::begin(&args);
    remarks.iter().for_each(Remark::log);
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            logging::report(&error, args.log_format);
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> anyhow::Result<()> {
    let stop = stop_signals::catch()?;
    let inbox = Arc::new(Inbox::new(args));
    let server = args.metrics.map(MonitorServer::bind).transpose()?;
    // Open the map before the node appears on the network, so that a failure is reported first.
    let (orders, placed_orders) = services::orders();
    let mapping = Mapping::open(args, inbox.clone(), placed_orders)?;
    let node = node::start(args, &inbox, mapping.live(), &orders, server)?;
    let outcome = mapping.run(&stop);
    inbox.close();
    node.end();
    outcome
}

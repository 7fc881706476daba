//! The node `voxtile_ros2`: clouds and transforms from ROS 2, over DDS or Zenoh, into a map of voxtile. No ROS
//! installation.
//!
//! ```text
//! Transport -> CloudQueue, TransformBuffer           node: a thread a topic
//! CloudQueue -> cloud with its pose -> Mapper        mapping: one thread
//! Transport -> corrected path -> Mapping -> Remapping   beside it: one thread, for as long as it takes
//! LiveMap -> messages -> Transport                   publishers: one thread
//! Transport -> orders -> Mapping, questions -> LiveMap services: a thread a service
//! ```

mod args;
mod cloud;
mod cloud_points;
mod cloud_queue;
mod corrections;
mod counters;
mod frame_owners;
mod health;
mod inbox;
mod latencies;
mod live_map;
mod local_mapping;
mod local_share;
mod mapping;
mod messages;
mod names;
mod node;
mod parameters;
mod parent_warnings;
mod pose_watch;
mod publishers;
mod refusal;
mod remapping;
mod services;
mod stamp_check;
mod stop_signals;
mod transform_buffer;
mod transport;
mod when_behind;

use args::Args;
use inbox::Inbox;
use mapping::Mapping;
use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    // So that --memory holds: DDS and the mapper have many threads.
    voxtile::begin_with_one_heap();
    // To ros2-client a topic that nobody has subscribed to yet is an error, whenever one looks. To a writer of rustdds
    // it is one when a reader asks again for a message that a newer one has replaced; some readers ask a hundred times.
    let filter = "info,rustdds=error,rustdds::rtps::writer=off,ros2_client=off";
    env_logger::Builder::from_env(env_logger::Env::default().default_filter_or(filter)).init();
    let arguments: Vec<_> = std::env::args_os().collect();
    let args = parameters::parse(&arguments).unwrap_or_else(|error| error.exit());
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("voxtile-ros2: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> anyhow::Result<()> {
    let stop = stop_signals::catch()?;
    let inbox = Arc::new(Inbox::new(args));
    // A map that cannot be opened is told before anybody sees a node.
    let (orders, placed_orders) = services::orders();
    let mapping = Mapping::open(args, inbox.clone(), placed_orders)?;
    let node = node::start(args, &inbox, mapping.live(), &orders)?;
    let outcome = mapping.run(&stop);
    inbox.close();
    node.end();
    outcome
}

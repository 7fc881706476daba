use crate::args::Args;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use crate::publishers::Publishing;
use crate::raw_message::{RawAdapter, RawMessage};
use crate::services::{self, Orders};
use anyhow::{Context as _, anyhow};
use futures::StreamExt;
use futures::executor::block_on;
use ros2_client::{Context, NodeOptions};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{DomainParticipantBuilder, QosPolicies, QosPolicyBuilder, Subscriber, TopicKind};
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use voxtile_clouds::ros::messages::MessageKind;

/// What keeps the node in the graph.
pub struct RunningNode {
    publishing: JoinHandle<()>,
    stop: Arc<AtomicBool>,
    _context: Context,
}

impl RunningNode {
    /// Leaves the graph.
    pub fn end(self) {
        self.stop.store(true, Ordering::Relaxed);
        if self.publishing.join().is_err() {
            log::error!("the thread that publishes has died");
        }
    }
}

const RECEIVE_BUFFER_BYTES: usize = 8 << 20;
/// Below this most fragments of a large cloud are lost.
const LEAST_RECEIVE_BUFFER_BYTES: usize = 2 << 20;

/// Joins the domain and reads each topic in a thread of its own.
///
/// # Errors
///
/// No sockets; names of topics that ROS 2 does not know.
pub fn start(
    args: &Args,
    inbox: &Arc<Inbox>,
    map: Arc<LiveMap>,
    orders: &Orders,
) -> anyhow::Result<RunningNode> {
    let mut builder =
        DomainParticipantBuilder::new(args.domain_id).socket_receive_buffer_size(RECEIVE_BUFFER_BYTES);
    if !args.network {
        builder = builder.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)]);
    }
    check_receive_buffer();
    let names = args.names()?;
    let domain = format!("--domain-id {}", args.domain_id);
    let participant = builder.build().map_err(|error| anyhow!("{error:?}")).context(domain)?;
    let context =
        Context::from_domain_participant(participant.clone()).map_err(|error| anyhow!("{error:?}"))?;
    let mut node =
        context.new_node(names.of_node()?, NodeOptions::new()).map_err(|error| anyhow!("{error:?}"))?;
    let spinner = node.spinner().map_err(|error| anyhow!("{error:?}"))?;
    spawn("spinner", move || drop(block_on(spinner.spin())))?;

    let volatile = qos(Reliability::BestEffort, Durability::Volatile, 5);
    let subscriber = participant.create_subscriber(&volatile).map_err(|error| anyhow!("{error:?}"))?;
    let read = |topic: &str, type_name: &str, qos: &QosPolicies, put: Box<dyn Fn(Vec<u8>) + Send>| {
        // As ROS 2 names topics in DDS.
        let name = names.of(topic).map(|_| format!("rt{}", names.full(topic)))?;
        let topic = participant
            .create_topic(name.clone(), type_name.to_owned(), qos, TopicKind::NoKey)
            .map_err(|error| anyhow!("{name}: {error:?}"))?;
        read_topic(&subscriber, &topic, qos, inbox.clone(), put)
    };
    for (number, topic) in args.cloud.iter().enumerate() {
        let to = inbox.clone();
        let put = Box::new(move |cdr| to.put_cloud(number, cdr));
        read(topic, "sensor_msgs::msg::dds_::PointCloud2_", &volatile, put)?;
    }
    let poses = |kind, is_static| {
        let to = inbox.clone();
        Box::new(move |cdr: Vec<u8>| to.put_poses(kind, &cdr, is_static))
    };
    let reliable = Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(100) };
    let latched = qos(reliable, Durability::TransientLocal, 100);
    let tf = "tf2_msgs::msg::dds_::TFMessage_";
    read("/tf_static", tf, &latched, poses(MessageKind::Tf, true))?;
    match &args.odometry {
        Some(topic) => {
            let odometry = "nav_msgs::msg::dds_::Odometry_";
            read(topic, odometry, &volatile, poses(MessageKind::Odometry, false))?;
        }
        None => {
            let tf_qos = qos(reliable, Durability::Volatile, 100);
            read("/tf", tf, &tf_qos, poses(MessageKind::Tf, false))?;
        }
    }
    if let Some(topic) = &args.path {
        let to = inbox.clone();
        let last = qos(reliable, Durability::Volatile, 1);
        read(topic, "nav_msgs::msg::dds_::Path_", &last, Box::new(move |cdr| to.put_path(&cdr)))?;
    }
    let clouds: Vec<String> = args.cloud.iter().map(|topic| names.full(topic)).collect();
    log::info!("listening to {} in domain {}", clouds.join(", "), args.domain_id);
    services::start(args, &participant, &mut node, &map, orders)?;
    let mut publishing = Publishing::new(args, node, inbox.clone(), map)?;
    let stop = Arc::new(AtomicBool::new(false));
    let its_stop = stop.clone();
    let publishing = spawn("publisher", move || publishing.run(&its_stop))?;
    Ok(RunningNode { publishing, stop, _context: context })
}

fn read_topic(
    subscriber: &Subscriber,
    topic: &rustdds::Topic,
    qos: &QosPolicies,
    inbox: Arc<Inbox>,
    put: Box<dyn Fn(Vec<u8>) + Send>,
) -> anyhow::Result<()> {
    let reader = subscriber
        .create_simple_datareader_no_key::<RawMessage, RawAdapter>(topic, Some(qos.clone()))
        .map_err(|error| anyhow!("{error:?}"))?;
    spawn("reader", move || {
        block_on(reader.as_async_stream().for_each(|sample| {
            match sample {
                Ok(sample) => put(sample.into_value().cdr),
                Err(error) => {
                    log::debug!("a sample is lost: {error:?}");
                    inbox.count(|counters| counters.transport_errors += 1);
                }
            }
            futures::future::ready(())
        }));
    })?;
    Ok(())
}

/// Says what to do where the system gives sockets too little room: it cuts what is asked for without a word.
fn check_receive_buffer() {
    let most = std::fs::read_to_string("/proc/sys/net/core/rmem_max");
    let Some(most) = most.ok().and_then(|text| text.trim().parse::<usize>().ok()) else { return };
    if most < LEAST_RECEIVE_BUFFER_BYTES {
        log::warn!(
            "the system gives sockets {most} bytes, too few for large clouds, most of which will be lost: \
             sysctl net.core.rmem_max={RECEIVE_BUFFER_BYTES}"
        );
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> anyhow::Result<JoinHandle<()>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work).context("a thread cannot be started")
}

fn qos(reliability: Reliability, durability: Durability, depth: i32) -> QosPolicies {
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth })
        .build()
}

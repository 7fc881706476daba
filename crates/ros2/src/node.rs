use crate::args::Args;
use crate::arrival_watch::ArrivalWatch;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use crate::monitor::{Monitor, MonitorServer};
use crate::publishers::{DistancePublisher, FrontierPublisher, PUBLISHED_CLOUDS, Publishing};
use crate::services::{self, Orders};
use crate::transport::{Message, Qos, Transport, TypeName, spawn};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use voxtile_formats::ros::messages::MessageKind;

pub struct RunningNode {
    threads: Vec<JoinHandle<()>>,
    stop: Arc<AtomicBool>,
    transport: Transport,
}

impl RunningNode {
    /// Stops publishing and leaves the graph.
    pub fn end(self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads {
            let name = thread.thread().name().unwrap_or_default().to_owned();
            if thread.join().is_err() {
                log::error!("the thread {name} panicked");
            }
        }
        self.transport.leave();
    }
}

/// Joins the ROS graph and reads each topic in a thread of its own.
///
/// # Errors
///
/// No sockets, or invalid topic names.
pub fn start(
    args: &Args,
    inbox: &Arc<Inbox>,
    map: Arc<LiveMap>,
    orders: &Orders,
    server: Option<MonitorServer>,
) -> anyhow::Result<RunningNode> {
    let mut transport = Transport::join(args, inbox)?;
    let volatile = Qos::best_effort(5);
    for (number, topic) in args.cloud.iter().enumerate() {
        let to = inbox.clone();
        let put = Box::new(move |message: Message| to.put_cloud(number, message.cdr));
        transport.subscribe(topic, TypeName::new("sensor_msgs", "PointCloud2"), volatile, put)?;
    }
    let poses = |kind, is_static| {
        let to = inbox.clone();
        Box::new(move |message: Message| to.put_poses(kind, &message, is_static))
    };
    let tf = TypeName::new("tf2_msgs", "TFMessage");
    transport.subscribe("/tf_static", tf, Qos::latched(100), poses(MessageKind::Tf, true))?;
    match &args.odometry {
        Some(topic) => {
            let odometry = TypeName::new("nav_msgs", "Odometry");
            transport.subscribe(topic, odometry, volatile, poses(MessageKind::Odometry, false))?;
        }
        None => transport.subscribe("/tf", tf, Qos::reliable(100), poses(MessageKind::Tf, false))?,
    }
    if let Some(topic) = &args.path {
        let to = inbox.clone();
        let path = TypeName::new("nav_msgs", "Path");
        transport.subscribe(
            topic,
            path,
            Qos::reliable(1),
            Box::new(move |message: Message| to.put_path(&message.cdr)),
        )?;
    }
    log::info!("subscribed to {} in domain {}", args.cloud_topics().join(", "), args.domain_id);
    services::start(args, &mut transport, &map, orders)?;
    let mut publishing = Publishing::new(args, &mut transport, inbox.clone(), map.clone())?;
    let mut distances = DistancePublisher::new(&mut transport, map.clone(), args.distances()?)?;
    let frontiers = args
        .frontiers()?
        .map(|frontiers| FrontierPublisher::new(&mut transport, map.clone(), frontiers))
        .transpose()?;
    let arrivals = ArrivalWatch::new(args, inbox.clone(), transport.graph(), &PUBLISHED_CLOUDS)?;
    let stop = Arc::new(AtomicBool::new(false));
    let (of_publishing, of_arrivals, of_distances) = (stop.clone(), stop.clone(), stop.clone());
    let mut threads = vec![
        spawn("publisher", move || publishing.run(&of_publishing))?,
        spawn("distances", move || distances.run(&of_distances))?,
        spawn("arrivals", move || arrivals.run(&of_arrivals))?,
    ];
    if let Some(mut frontiers) = frontiers {
        let of_frontiers = stop.clone();
        threads.push(spawn("frontiers", move || frontiers.run(&of_frontiers))?);
    }
    if let Some(server) = server {
        let memory_limit_bytes = args.memory.as_u64();
        let monitor = Arc::new(Monitor { inbox: inbox.clone(), map, memory_limit_bytes });
        let of_server = stop.clone();
        threads.push(spawn("monitoring", move || server.run(monitor, &of_server))?);
    }
    Ok(RunningNode { threads, stop, transport })
}

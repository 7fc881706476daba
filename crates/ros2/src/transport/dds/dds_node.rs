use super::dds_sender::DdsSender;
use super::raw_message::{RawAdapter, RawMessage};
use super::servers::Servers;
use crate::args::Args;
use crate::inbox::Inbox;
use crate::names::Names;
use crate::services::Rmw;
use crate::transport::spawn;
use crate::transport::{self, Gid, Published, Put, Qos, TypeName};
use anyhow::{Context as _, anyhow};
use futures::StreamExt;
use futures::executor::block_on;
use ros2_client::qos::{QosProfile, WhenFull};
use ros2_client::{Context, Message, MessageTypeName, Node, NodeOptions};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, QosPolicies, QosPolicyBuilder, Subscriber, TopicKind,
};
use serde::Serialize;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::{Arc, Mutex, PoisonError};

pub struct DdsNode {
    participant: DomainParticipant,
    subscriber: Subscriber,
    node: Arc<Mutex<Node>>,
    names: Names,
    rmw: Rmw,
    /// Whether peers on other hosts are served.
    network: bool,
    inbox: Arc<Inbox>,
    /// Keeps the node in the graph.
    _context: Context,
}

/// Topics that other participants publish.
pub struct DdsGraph {
    participant: DomainParticipant,
}

impl DdsGraph {
    pub fn published(&self) -> Vec<Published> {
        let writers = self.participant.discovered_writers();
        let published = writers.iter().filter_map(|writer| {
            let data = &writer.publication_topic_data;
            Published::of(data.topic_name().strip_prefix("rt")?, &data.type_name)
        });
        published.collect()
    }
}

const RECEIVE_BUFFER_BYTES: usize = 8 << 20;
/// With a smaller buffer most fragments of a large cloud are lost.
const MIN_RECEIVE_BUFFER_BYTES: usize = 2 << 20;

impl DdsNode {
    /// Joins the domain.
    ///
    /// # Errors
    ///
    /// No sockets, or invalid names.
    pub fn join(args: &Args, inbox: &Arc<Inbox>) -> anyhow::Result<Self> {
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
        let subscriber = participant
            .create_subscriber(&policies(Qos::best_effort(5)))
            .map_err(|error| anyhow!("{error:?}"))?;
        let node = Arc::new(Mutex::new(node));
        Ok(Self {
            participant,
            subscriber,
            node,
            names,
            rmw: args.rmw,
            network: args.network,
            inbox: inbox.clone(),
            _context: context,
        })
    }

    /// Maximum size of a response in bytes for clients of Fast DDS; `None` for Cyclone DDS.
    ///
    /// `rustdds` 0.15 splits responses that do not fit into a datagram, and writes one byte too many in front of the
    /// request's identity in each part (`DataFrag::write_to`), so that clients discard them. Clients of Cyclone DDS find
    /// the identity in the message itself.
    pub fn max_response_bytes(&self) -> Option<usize> {
        // UDP over loopback, and a frame of Ethernet, without headers.
        let datagram = if self.network { 1300 } else { 64_000 };
        (self.rmw == Rmw::Fastrtps).then_some(datagram)
    }

    pub fn subscribe(&self, topic: &str, kind: TypeName, qos: Qos, put: Put) -> anyhow::Result<()> {
        // ROS 2 prefixes topic names with `rt` in DDS.
        let label = self.names.full(topic);
        let name = self.names.of(topic).map(|_| format!("rt{label}"))?;
        let qos = policies(qos);
        let topic = self
            .participant
            .create_topic(name.clone(), kind.of_message(), &qos, TopicKind::NoKey)
            .map_err(|error| anyhow!("{name}: {error:?}"))?;
        let reader = self
            .subscriber
            .create_simple_datareader_no_key::<RawMessage, RawAdapter>(&topic, Some(qos))
            .map_err(|error| anyhow!("{name}: {error:?}"))?;
        let inbox = self.inbox.clone();
        spawn("reader", move || {
            block_on(reader.as_async_stream().for_each(|sample| {
                match sample {
                    Ok(sample) => {
                        let publisher = Some(Gid(sample.writer_guid().to_bytes()));
                        put(transport::Message { cdr: sample.into_value().cdr, publisher });
                    }
                    Err(error) => {
                        inbox.note_lost(1, &format!("{label}: {error:?}"));
                    }
                }
                futures::future::ready(())
            }));
        })?;
        Ok(())
    }

    pub fn advertise<M: Serialize>(
        &self,
        topic: &str,
        kind: TypeName,
        qos: Qos,
    ) -> anyhow::Result<DdsSender<M>> {
        let failed = |error: &dyn std::fmt::Debug| anyhow!("{topic}: {error:?}");
        let name = self.names.of(topic)?;
        let qos = profile(qos);
        let mut node = self.node.lock().unwrap_or_else(PoisonError::into_inner);
        let kind = MessageTypeName::new(kind.package, kind.name);
        let dds_topic = node.create_topic(&name, kind, &qos).map_err(|error| failed(&error))?;
        let publisher = node.create_publisher(&dds_topic, Some(qos)).map_err(|error| failed(&error))?;
        Ok(DdsSender { node: self.node.clone(), publisher })
    }

    /// Returns a view of the topics that others publish.
    pub fn graph(&self) -> DdsGraph {
        DdsGraph { participant: self.participant.clone() }
    }

    pub fn serve<Q, A>(
        &self,
        service: &str,
        kind: TypeName,
        answer: impl Fn(Q) -> A + Send + 'static,
    ) -> anyhow::Result<()>
    where
        Q: Message + Clone + Send + 'static,
        A: Message + Send + 'static,
    {
        let node = &mut self.node.lock().unwrap_or_else(PoisonError::into_inner);
        let mut servers = Servers { participant: &self.participant, node, names: &self.names, rmw: self.rmw };
        servers.serve(service, kind, answer)
    }
}

/// Warns if the system limits socket buffers too much: it silently reduces the requested size.
fn check_receive_buffer() {
    let max_bytes = std::fs::read_to_string("/proc/sys/net/core/rmem_max");
    let Some(max_bytes) = max_bytes.ok().and_then(|text| text.trim().parse::<usize>().ok()) else { return };
    if max_bytes < MIN_RECEIVE_BUFFER_BYTES {
        log::warn!(
            "socket buffers are limited to {max_bytes} bytes, so most large clouds will be lost; raise the limit: \
             sysctl net.core.rmem_max={RECEIVE_BUFFER_BYTES}"
        );
    }
}

/// Returns the policies of a reader.
fn policies(qos: Qos) -> QosPolicies {
    let reliability = match qos.is_reliable {
        true => Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(100) },
        false => Reliability::BestEffort,
    };
    let durability = if qos.is_latched { Durability::TransientLocal } else { Durability::Volatile };
    let depth = i32::try_from(qos.depth).unwrap_or(i32::MAX);
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth })
        .build()
}

/// Returns the profile of a publisher.
fn profile(qos: Qos) -> QosProfile {
    use ros2_client::qos::{Durability, History};
    let mut profile = QosProfile::publisher_default().history(History::KeepLast { depth: qos.depth });
    if qos.is_reliable {
        profile = profile.reliability_reliable(WhenFull::DEFAULT);
    }
    if qos.is_latched {
        profile = profile.durability(Durability::TransientLocal);
    }
    profile
}

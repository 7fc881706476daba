use super::dds::DdsNode;
#[cfg(feature = "zenoh")]
use super::zenoh::ZenohNode;
use super::{Graph, Put, Qos, Sender, TransportName, TypeName};
use crate::args::Args;
use crate::inbox::Inbox;
use ros2_client::Message;
use serde::Serialize;
use std::sync::Arc;

/// The node in the ROS graph. Its methods take names before remapping.
pub enum Transport {
    Dds(DdsNode),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohNode),
}

impl Transport {
    /// Joins the ROS graph. Messages that arrive incomplete are counted in the inbox.
    ///
    /// # Errors
    ///
    /// No sockets, invalid names, or a transport that this program was built without.
    pub fn join(args: &Args, inbox: &Arc<Inbox>) -> anyhow::Result<Self> {
        match args.transport {
            TransportName::Dds => Ok(Self::Dds(DdsNode::join(args, inbox)?)),
            #[cfg(feature = "zenoh")]
            TransportName::Zenoh => Ok(Self::Zenoh(ZenohNode::join(args, inbox)?)),
            #[cfg(not(feature = "zenoh"))]
            TransportName::Zenoh => anyhow::bail!(
                "--transport zenoh: this program was built without Zenoh; rebuild it with --features zenoh"
            ),
        }
    }

    /// Reads a topic in a thread of its own.
    ///
    /// # Errors
    ///
    /// An invalid name, or a transport that cannot create the subscription.
    pub fn subscribe(&mut self, topic: &str, kind: TypeName, qos: Qos, put: Put) -> anyhow::Result<()> {
        match self {
            Self::Dds(node) => node.subscribe(topic, kind, qos, put),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(node) => node.subscribe(topic, kind, qos, put),
        }
    }

    /// Creates a publisher.
    ///
    /// # Errors
    ///
    /// An invalid name, or a transport that cannot create the publisher.
    pub fn advertise<M: Serialize>(
        &mut self,
        topic: &str,
        kind: TypeName,
        qos: Qos,
    ) -> anyhow::Result<Sender<M>> {
        match self {
            Self::Dds(node) => Ok(Sender::Dds(node.advertise(topic, kind, qos)?)),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(node) => Ok(Sender::Zenoh(node.advertise(topic, kind, qos)?)),
        }
    }

    /// Serves requests in a thread of their own, one after the other.
    ///
    /// # Errors
    ///
    /// An invalid name, or a transport that cannot create the service.
    pub fn serve<Q, A>(
        &mut self,
        service: &str,
        kind: TypeName,
        answer: impl Fn(Q) -> A + Send + 'static,
    ) -> anyhow::Result<()>
    where
        Q: Message + Clone + Send + 'static,
        A: Message + Send + 'static,
    {
        match self {
            Self::Dds(node) => node.serve(service, kind, answer),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(node) => node.serve(service, kind, answer),
        }
    }

    /// Maximum size of a response of a service in bytes, if there is one.
    pub fn max_response_bytes(&self) -> Option<usize> {
        match self {
            Self::Dds(node) => node.max_response_bytes(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(_) => None,
        }
    }

    /// Returns a view of the topics that others publish.
    pub fn graph(&self) -> Graph {
        match self {
            Self::Dds(node) => Graph::Dds(node.graph()),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(node) => Graph::Zenoh(node.graph()),
        }
    }

    /// Leaves the ROS graph.
    pub fn leave(self) {
        match self {
            Self::Dds(_) => {}
            #[cfg(feature = "zenoh")]
            Self::Zenoh(node) => node.leave(),
        }
    }
}

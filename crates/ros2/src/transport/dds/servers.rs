use super::marked::Marked;
use crate::names::Names;
use crate::services::Rmw;
use crate::transport::TypeName;
use crate::transport::spawn;
use anyhow::anyhow;
use futures::StreamExt;
use futures::executor::block_on;
use ros2_client::qos::{History, QosProfile};
use ros2_client::{Message, Name, Node, ServiceMapping, ServiceTypeName};
use rustdds::{DomainParticipant, QosPolicies, Topic, TopicKind};

/// Creates the services of a node, each with a thread of its own.
pub struct Servers<'a> {
    pub participant: &'a DomainParticipant,
    pub node: &'a mut Node,
    pub names: &'a Names,
    pub rmw: Rmw,
}

/// Number of requests that DDS queues for a busy service.
const DEPTH: usize = 10;

impl Servers<'_> {
    /// Serves requests one after the other. A name that begins with `~` is below the node's name.
    ///
    /// # Errors
    ///
    /// DDS cannot create the service, or the system cannot create a thread.
    pub fn serve<Q, A>(
        &mut self,
        name: &str,
        kind: TypeName,
        answer: impl Fn(Q) -> A + Send + 'static,
    ) -> anyhow::Result<()>
    where
        Q: Message + Clone + Send + 'static,
        A: Message + Send + 'static,
    {
        let (path, full_name) = (self.names.full(name), self.names.of(name)?);
        match self.rmw {
            Rmw::Fastrtps => self.serve_enhanced(&full_name, kind, answer),
            Rmw::Cyclonedds => self.serve_marked(&path, kind, answer),
        }
    }

    /// Serves clients whose requests are identified by DDS sample identities.
    fn serve_enhanced<Q, A>(
        &mut self,
        path: &Name,
        kind: TypeName,
        answer: impl Fn(Q) -> A + Send + 'static,
    ) -> anyhow::Result<()>
    where
        Q: Message + Clone + Send + 'static,
        A: Message + Send + 'static,
    {
        let failed = |error: &dyn std::fmt::Debug| anyhow!("{path}: {error:?}");
        let type_name = ServiceTypeName::new(kind.package, kind.name);
        let server = self
            .node
            .create_server::<Q, A>(ServiceMapping::Enhanced, path, &type_name, qos(), qos())
            .map_err(|error| failed(&error))?;
        let label = path.clone();
        spawn("service", move || {
            block_on(server.receive_request_stream().for_each(|request| {
                match request {
                    Ok((id, request)) => {
                        if let Err(error) = server.send_response(id, answer(request)) {
                            log::warn!("{label}: cannot send the response: {error:?}");
                        }
                    }
                    Err(error) => log::debug!("{label}: cannot read a request: {error:?}"),
                }
                futures::future::ready(())
            }));
        })?;
        Ok(())
    }

    /// Serves clients that put the identity into the message. Does not use `create_server`, which adds both identities:
    /// responses of more than 64 KB then arrive corrupted.
    fn serve_marked<Q, A>(
        &mut self,
        path: &str,
        kind: TypeName,
        answer: impl Fn(Q) -> A + Send + 'static,
    ) -> anyhow::Result<()>
    where
        Q: Message + Clone + Send + 'static,
        A: Message + Send + 'static,
    {
        let failed = |error: &dyn std::fmt::Debug| anyhow!("{path}: {error:?}");
        let type_name = kind.of_service();
        let requests = self.topic(format!("rq{path}Request"), format!("{type_name}Request_"))?;
        let responses = self.topic(format!("rr{path}Reply"), format!("{type_name}Response_"))?;
        let reader = self.node.create_subscription::<Marked<Q>>(&requests, Some(qos()));
        let reader = reader.map_err(|error| failed(&error))?;
        let writer = self.node.create_publisher::<Marked<A>>(&responses, Some(qos()));
        let writer = writer.map_err(|error| failed(&error))?;
        let label = path.to_owned();
        spawn("service", move || {
            block_on(reader.async_stream().for_each(|request| {
                match request {
                    Ok((Marked { guid, number, body }, _)) => {
                        let response = Marked { guid, number, body: answer(body) };
                        if let Err(error) = writer.publish(response) {
                            log::warn!("{label}: cannot send the response: {error}");
                        }
                    }
                    Err(error) => log::debug!("{label}: cannot read a request: {error:?}"),
                }
                futures::future::ready(())
            }));
        })?;
        Ok(())
    }

    fn topic(&self, name: String, type_name: String) -> anyhow::Result<Topic> {
        let topic = self.participant.create_topic(name.clone(), type_name, &policies(), TopicKind::NoKey);
        topic.map_err(|error| anyhow!("{name}: {error:?}"))
    }
}

fn qos() -> QosProfile {
    QosProfile::publisher_default().history(History::KeepLast { depth: DEPTH })
}

fn policies() -> QosPolicies {
    (&qos()).into()
}

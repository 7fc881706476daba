use super::attachment::Attachment;
use super::configuration::configuration;
use super::graph_name::{Channel, End, GraphName, gid_of};
use super::mailbox::Mailbox;
use super::service::{respond, waiting_bytes};
use super::subscribers::Subscribers;
use super::zenoh_graph::ZenohGraph;
use super::zenoh_sender::ZenohSender;
use crate::args::Args;
use crate::inbox::Inbox;
use crate::names::Names;
use crate::transport::spawn;
use crate::transport::{Gid, Message, Put, Qos, TypeName};
use anyhow::anyhow;
use serde::{Serialize, de::DeserializeOwned};
use std::sync::Arc;
use std::sync::atomic::AtomicI64;
use std::time::Duration;
use zenoh::key_expr::KeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::Sample;
use zenoh::{Session, Wait as _};
use zenoh_ext::{
    AdvancedPublisherBuilderExt as _, AdvancedSubscriberBuilderExt as _, CacheConfig, HistoryConfig,
    MissDetectionConfig, RecoveryConfig,
};

pub struct ZenohNode {
    session: Session,
    name: GraphName,
    names: Names,
    inbox: Arc<Inbox>,
    max_bytes: usize,
    tokens: Vec<LivelinessToken>,
    /// Callbacks that stop the reader threads.
    closers: Vec<Box<dyn Fn() + Send>>,
}

/// Quality of service of services in ROS 2.
const SERVICE_QOS: Qos = Qos::reliable(10);
/// Maximum size of a request including attachment and parameters.
const MAX_REQUEST_BYTES: usize = 1 << 20;
/// Interval at which a publisher repeats its last sequence number after new messages.
const HEARTBEAT: Duration = Duration::from_millis(500);

impl ZenohNode {
    /// Opens the session and announces the node. If the router is missing, Zenoh retries without a time limit.
    ///
    /// # Errors
    ///
    /// An invalid configuration, no sockets, or invalid names.
    pub fn join(args: &Args, inbox: &Arc<Inbox>) -> anyhow::Result<Self> {
        let names = args.names()?;
        names.of_node()?;
        let session = zenoh::open(configuration(args)?).wait();
        let session =
            session.map_err(|error| anyhow!("--transport zenoh: cannot open the session: {error}"))?;
        if session.info().routers_zid().wait().next().is_none() {
            log::warn!(
                "no Zenoh router answers ({}); the node will retry; start a router with: ros2 run rmw_zenoh_cpp rmw_zenohd",
                args.zenoh_config
                    .as_ref()
                    .map_or_else(|| args.zenoh_router.join(" "), |path| path.display().to_string())
            );
        }
        let name = GraphName {
            domain_id: args.domain_id,
            zenoh_id: session.zid().to_string(),
            namespace: names.namespace().to_owned(),
            node_name: args.node_name.clone(),
        };
        let max_bytes = args.queue_bytes();
        let (tokens, closers) = (Vec::new(), Vec::new());
        let mut node = Self { session, name, names, inbox: inbox.clone(), max_bytes, tokens, closers };
        node.announce(node.name.token())?;
        Ok(node)
    }

    pub fn subscribe(&mut self, topic: &str, kind: TypeName, qos: Qos, put: Put) -> anyhow::Result<()> {
        let channel = Channel::topic(&self.names, topic, kind)?;
        let key = key(&channel.key(self.name.domain_id))?;
        let mailbox = Mailbox::new(qos.depth, self.max_bytes);
        let callback = self.receiver(&channel.name, &mailbox);
        let subscriber = self.session.declare_subscriber(key).callback(callback);
        let declared = if qos.is_latched {
            let mut advanced = subscriber
                .advanced()
                .subscriber_detection()
                .history(HistoryConfig::default().detect_late_publishers().max_samples(qos.depth));
            if qos.is_reliable {
                advanced = advanced.recovery(RecoveryConfig::default().heartbeat());
            }
            advanced.background().wait()
        } else {
            subscriber.background().wait()
        };
        declared.map_err(|error| anyhow!("{}: {error}", channel.name))?;
        let reader_mailbox = mailbox.clone();
        spawn("reader", move || {
            while let Some(message) = reader_mailbox.take() {
                put(message);
            }
        })?;
        self.closers.push(Box::new(move || mailbox.close()));
        self.announce_end(End::Subscription, &channel, qos)?;
        Ok(())
    }

    pub fn advertise(&mut self, topic: &str, kind: TypeName, qos: Qos) -> anyhow::Result<ZenohSender> {
        let channel = Channel::topic(&self.names, topic, kind)?;
        let failed = |error: zenoh::Error| anyhow!("{}: {error}", channel.name);
        let subscribers = Subscribers::default();
        let counted = subscribers.clone();
        self.session
            .liveliness()
            .declare_subscriber(key(&self.name.subscriptions(&channel))?)
            .history(true)
            .callback(move |sample| counted.note(sample.key_expr().as_str(), sample.kind()))
            .background()
            .wait()
            .map_err(failed)?;
        let mut publisher =
            self.session.declare_publisher(key(&channel.key(self.name.domain_id))?).advanced();
        if qos.is_latched {
            publisher = publisher
                .cache(CacheConfig::default().max_samples(qos.depth))
                .sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT))
                .publisher_detection();
        }
        let publisher = publisher.wait().map_err(failed)?;
        let gid = gid_of(&self.announce_end(End::Publisher, &channel, qos)?);
        Ok(ZenohSender { publisher, subscribers, gid, sent: AtomicI64::new(0) })
    }

    /// Returns a view of the topics that others publish.
    pub fn graph(&self) -> ZenohGraph {
        ZenohGraph {
            session: self.session.clone(),
            publishers: self.name.publishers(),
            own_id: self.name.zenoh_id.clone(),
        }
    }

    pub fn serve<Q, A>(
        &mut self,
        service: &str,
        kind: TypeName,
        answer: impl Fn(Q) -> A + Send + 'static,
    ) -> anyhow::Result<()>
    where
        Q: DeserializeOwned,
        A: Serialize,
    {
        let channel = Channel::service(&self.names, service, kind)?;
        let key = key(&channel.key(self.name.domain_id))?;
        let mailbox = Mailbox::new(SERVICE_QOS.depth, SERVICE_QOS.depth * MAX_REQUEST_BYTES);
        let (to, label, inbox) = (mailbox.clone(), channel.name.clone(), self.inbox.clone());
        self.session
            .declare_queryable(key.clone())
            .complete(true)
            .callback(move |query| {
                // Zenoh reports an error to the client when the query is dropped.
                let lost = match waiting_bytes(&query) {
                    Some(bytes) if bytes <= MAX_REQUEST_BYTES => to.put(query, bytes),
                    _ => 1,
                };
                if lost > 0 {
                    inbox.note_lost(
                        lost as u64,
                        &format!("{label}: invalid or too large, or the queue is full"),
                    );
                }
            })
            .background()
            .wait()
            .map_err(|error| anyhow!("{}: {error}", channel.name))?;
        let service_mailbox = mailbox.clone();
        spawn("service", move || {
            while let Some(query) = service_mailbox.take() {
                respond(&query, &key, &answer);
            }
        })?;
        self.closers.push(Box::new(move || mailbox.close()));
        self.announce_end(End::Service, &channel, SERVICE_QOS)?;
        Ok(())
    }

    /// Withdraws all tokens and closes the session.
    pub fn leave(self) {
        drop(self.tokens);
        if let Err(error) = self.session.close().wait() {
            log::warn!("cannot close the Zenoh session: {error}");
        }
        self.closers.iter().for_each(|close| close());
    }

    /// Returns the callback of a subscription. It only queues the message, so that Zenoh's threads do not wait.
    fn receiver(
        &self,
        label: &str,
        mailbox: &Arc<Mailbox<Message>>,
    ) -> impl Fn(Sample) + Send + Sync + 'static {
        let (mailbox, inbox, max_bytes) = (mailbox.clone(), self.inbox.clone(), self.max_bytes);
        let label = label.to_owned();
        move |sample| {
            let bytes = sample.payload().len();
            if bytes > max_bytes {
                inbox.note_too_large(&label, bytes);
                return;
            }
            let attachment = sample.attachment().and_then(|bytes| Attachment::from_bytes(&bytes.to_bytes()));
            let publisher = attachment.map(|attachment| Gid(attachment.gid));
            let cdr = sample.payload().to_bytes().into_owned();
            let lost = mailbox.put(Message { cdr, publisher }, bytes);
            if lost > 0 {
                inbox.note_lost(lost as u64, &format!("{label}: messages arrive faster than they are read"));
            }
        }
    }

    fn announce_end(&mut self, end: End, channel: &Channel, qos: Qos) -> anyhow::Result<String> {
        let token = self.name.token_of(self.tokens.len(), end, channel, qos);
        self.announce(token.clone())?;
        Ok(token)
    }

    fn announce(&mut self, token: String) -> anyhow::Result<()> {
        let declared = self.session.liveliness().declare_token(key(&token)?).wait();
        self.tokens.push(declared.map_err(|error| anyhow!("{token}: {error}"))?);
        Ok(())
    }
}

fn key(text: &str) -> anyhow::Result<KeyExpr<'static>> {
    KeyExpr::try_from(text.to_owned()).map_err(|error| anyhow!("{text}: invalid Zenoh key: {error}"))
}

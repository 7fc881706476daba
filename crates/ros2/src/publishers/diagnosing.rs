use super::diagnostics::diagnostics;
use crate::counters::Counters;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use crate::messages::DiagnosticArray;
use crate::transport::{Qos, Sender, Transport, TypeName};
use std::time::{Duration, Instant};

/// Publishes `/diagnostics` once a second.
pub struct Diagnosing {
    node_name: String,
    sender: Sender<DiagnosticArray>,
    before: Counters,
    sent_at: Instant,
}

const EVERY: Duration = Duration::from_secs(1);

impl Diagnosing {
    /// # Errors
    ///
    /// The transport cannot create the publisher.
    pub fn new(transport: &mut Transport, node_name: &str) -> anyhow::Result<Self> {
        let kind = TypeName::new("diagnostic_msgs", "DiagnosticArray");
        let sender = transport.advertise("/diagnostics", kind, Qos::reliable(10))?;
        let node_name = node_name.to_owned();
        Ok(Self { node_name, sender, before: Counters::default(), sent_at: Instant::now() })
    }

    /// Publishes if the interval has passed and there are subscribers.
    pub fn refresh(&mut self, inbox: &Inbox, map: &LiveMap) {
        let since = self.sent_at.elapsed();
        if since < EVERY || self.sender.subscribers() == 0 {
            return;
        }
        let (now, waiting) = inbox.counters();
        let problem = inbox.pose_problem();
        let counters = [&self.before, &now];
        let message =
            diagnostics(&self.node_name, &map.health(), counters, waiting, since, problem.as_deref());
        if let Err(error) = self.sender.send(message) {
            log::debug!("diagnostics: not sent: {error}");
        }
        (self.before, self.sent_at) = (now, Instant::now());
    }
}

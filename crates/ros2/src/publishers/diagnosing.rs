use super::diagnostics::diagnostics;
use crate::counters::Counters;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use crate::messages::DiagnosticArray;
use crate::transport::{Qos, Sender, Transport, TypeName};
use std::time::{Duration, Instant};

/// Tells `/diagnostics` once a second how the node does.
pub struct Diagnosing {
    node_name: String,
    sender: Sender<DiagnosticArray>,
    before: Counters,
    told_at: Instant,
}

const EVERY: Duration = Duration::from_secs(1);

impl Diagnosing {
    /// # Errors
    ///
    /// The transport refuses.
    pub fn new(transport: &mut Transport, node_name: &str) -> anyhow::Result<Self> {
        let kind = TypeName::new("diagnostic_msgs", "DiagnosticArray");
        let sender = transport.advertise("/diagnostics", kind, Qos::reliable(10))?;
        let node_name = node_name.to_owned();
        Ok(Self { node_name, sender, before: Counters::default(), told_at: Instant::now() })
    }

    /// Tells, if it is time and somebody listens.
    pub fn refresh(&mut self, inbox: &Inbox, map: &LiveMap) {
        let since = self.told_at.elapsed();
        if since < EVERY || self.sender.listeners() == 0 {
            return;
        }
        let (now, waiting) = inbox.counters();
        let trouble = inbox.pose_trouble();
        let counters = [&self.before, &now];
        let message =
            diagnostics(&self.node_name, &map.health(), counters, waiting, since, trouble.as_deref());
        if let Err(error) = self.sender.send(message) {
            log::debug!("diagnostics: not sent: {error}");
        }
        (self.before, self.told_at) = (now, Instant::now());
    }
}

use super::graph_name::publisher_of;
use crate::transport::Published;
use std::time::Duration;
use zenoh::{Session, Wait as _};

/// Topics that other sessions publish.
pub struct ZenohGraph {
    pub session: Session,
    /// Pattern for the tokens of publishers.
    pub publishers: String,
    /// Zenoh ID of this session.
    pub own_id: String,
}

const TIMEOUT: Duration = Duration::from_secs(1);
/// Maximum number of publishers read, which bounds the memory under a flood of tokens.
const MAX_PUBLISHERS: usize = 4096;

impl ZenohGraph {
    pub fn published(&self) -> Vec<Published> {
        let replies = match self.session.liveliness().get(self.publishers.as_str()).timeout(TIMEOUT).wait() {
            Ok(replies) => replies,
            Err(error) => {
                log::debug!("cannot list the publishers: {error}");
                return Vec::new();
            }
        };
        let published = replies.iter().take(MAX_PUBLISHERS).filter_map(|reply| {
            let token = reply.result().ok()?.key_expr().as_str().to_owned();
            let (zenoh_id, topic, kind) = publisher_of(&token)?;
            (zenoh_id != self.own_id).then(|| Published::of(&topic, kind)).flatten()
        });
        published.collect()
    }
}

use std::fmt;
use std::time::Duration;

/// A request that a server did not answer in time.
#[derive(Clone, Debug)]
pub struct Unanswered {
    /// Method (`GET`, `PUT`, `HEAD`, `DELETE` or `LIST`) and object.
    pub request: String,
    /// Server, if known.
    pub server: Option<String>,
    /// Time since the start of the request.
    pub waited: Duration,
    /// Number of attempts.
    pub attempts: u32,
    /// Limit of the time without progress.
    pub limit: Duration,
}

impl fmt::Display for Unanswered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.request)?;
        if let Some(server) = &self.server {
            write!(f, " from {server}")?;
        }
        write!(
            f,
            " in {:.1} s and {} attempt{}; check the network and the server and try again, or allow more than {} s \
             without progress (--bucket-timeout, VOXTILE_BUCKET_TIMEOUT)",
            self.waited.as_secs_f64(),
            self.attempts,
            if self.attempts == 1 { "" } else { "s" },
            self.limit.as_secs_f64()
        )
    }
}

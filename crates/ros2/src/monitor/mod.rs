//! Monitoring of a running node over HTTP.
//!
//! ```text
//! GET /metrics, /health -> MonitorServer -> Monitor (reads counters and the sampled health) -> text
//! voxtile-ros2 health -> GET /health -> exit code
//! ```

mod health_command;
mod health_verdict;
mod monitor_server;
mod node_metrics;
mod request;

pub use health_command::health_command;
pub use health_verdict::verdict;
pub use monitor_server::{Monitor, MonitorServer};

//! Monitoring of programs that run for long: metrics in the text format of Prometheus, and log lines in JSON.
//!
//! ```text
//! log record -> CountedLog (counts by level) -> another logger, perhaps with json_line
//! Metrics: families of samples -> text of /metrics; process: metrics of this process and of its log
//! ```

mod counted_log;
mod json_line;
mod metrics;
mod process;
mod time_text;

pub use counted_log::{CountedLog, log_counts};
pub use json_line::json_line;
pub use metrics::{CONTENT_TYPE, Family, Metrics};
pub use process::{note_start, process};

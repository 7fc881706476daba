//! Tracing of scans: the range rule for each point, the rays on all threads, and the updates at the end.

mod concurrent_scans;
mod scan_hits;
mod scan_rays;
mod scan_tracer;
mod trace_limit;

pub(super) use scan_hits::HitsByTile;
pub use scan_tracer::ScanTracer;
pub(crate) use scan_tracer::{TraceRules, UpdateOrder, check_count, check_intensities};
pub(crate) use trace_limit::{Allowance, CollectorLimit};

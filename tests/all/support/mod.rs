//! What the tests share.

pub mod random_scans;
pub mod reference_map;

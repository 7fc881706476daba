//! Tests of a map on a faulty disk: operations, interruptions, and the states that they may leave.
//!
//! - `map.rs`: the map that these tests share, its configuration, and shortcuts to read and verify it;
//! - `interruption.rs`: a [`Subject`] is any procedure on a disk; [`sweep`] interrupts it at many moments by faults of
//!   every kind, and checks the result;
//! - `job.rs`: a [`Job`] is one atomic call;
//! - `acts.rs`: operations on a map ([`Act`]); `scans.rs`: scans for them; `model.rs`: the naive map after an act
//!   ([`State`]); `life.rs`: a [`Life`] is a list of acts, each in a process of its own, and a [`Subject`].

mod acts;
mod interruption;
mod job;
mod life;
mod map;
mod model;
mod scans;

pub use acts::{Act, perform};
pub use interruption::{EVERY_CRASH, Left, Reached, Subject, faults, sweep, sweep_after_kills};
pub use job::Job;
pub use life::{Life, check_files};
pub use map::{
    all_layers, at, config, damage_in, digest_of, is_whole, keeping_scans, make_foreign, map, name,
    open_or_create, replay, scans, snapshot_names,
};
pub use model::{Content, State};
pub use scans::{Taken, new_marks, new_poses};

//! A map on a disk that fails: what is done, where it breaks, what must hold.
//!
//! - `map.rs`: the map that these tests share, its configuration, and short ways to read and verify it;
//! - `interruption.rs`: a [`Subject`] is anything done to a disk; [`sweep`] interrupts it at many moments, by faults of
//!   every kind, and checks what is left; `job.rs`: a [`Job`] is one call, before which or after which the map is;
//! - `acts.rs`: what is done with a map ([`Act`]), `scans.rs`: the scans for it; `model.rs`: the naive map after an act
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
    at, config, damage_in, digest_of, is_whole, keeping_scans, make_foreign, map, name, open_or_create,
    rework, scans, snapshot_names,
};
pub use model::{Content, State};
pub use scans::{Taken, new_poses};

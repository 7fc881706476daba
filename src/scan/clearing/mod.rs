//! Which misses of a scan count in full, see [`Clearing`](crate::config::Clearing).
//!
//! The rule depends on the marks of the whole scan in a brick and its 26 neighbors. It is applied after all marks are
//! collected, one brick at a time: `guard` has the rule, `marks` what it reads, `around` the neighbors of a brick, and
//! `cells` operations on sets.

mod around;
mod cells;
mod guard;
mod marks;

pub(crate) use around::{AROUND, Step, moved, near_set};
pub(crate) use guard::{BrickCells, Clearance};
pub(crate) use marks::{BrickMarks, Marks, MarksAround};

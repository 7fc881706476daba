//! Which misses of a scan count in full, see [`Clearing`](crate::config::Clearing).
//!
//! The rule depends on the marks of the whole scan in a brick and its 26 neighbors. It is applied when all marks are
//! collected, to one brick at a time; `cells` has its operations on sets.

mod cells;
mod guard;
mod marks;

pub(crate) use guard::{AROUND, BrickCells, Clearance, near_set};
pub(crate) use marks::{BrickMarks, Marks, MarksAround, Step, moved};

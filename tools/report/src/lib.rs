//! What tools that measure voxtile have in common: clocks, samples, and a page into which tables and plots go.
//!
//! ```text
//! Stopwatch -> Samples -> Table, Plot -> Answer -> a section of the Page, and files beside it
//! ```

mod answer;
mod machine;
mod page;
pub mod plot;
mod samples;
mod stopwatch;
mod table;

pub use answer::Answer;
pub use machine::description as machine;
pub use page::Page;
pub use samples::Samples;
pub use stopwatch::{Stopwatch, Took};
pub use table::{Cell, Table};

//! Common parts of voxtile's benchmarks: options, clocks, samples, and a page for tables and plots.
//!
//! ```text
//! Options -> Bench -> Stopwatch -> Samples -> Table, Plot -> Answer -> a section of the Page, and files next to it
//! ```

mod answer;
mod bench;
mod machine;
mod options;
mod page;
pub mod plot;
mod samples;
mod stopwatch;
mod table;
mod work_folder;

pub use answer::Answer;
pub use bench::{Bench, exit_code};
pub use machine::{description as machine, processor};
pub use options::{Options, recorded_set};
pub use page::Page;
pub use samples::Samples;
pub use stopwatch::{Elapsed, Stopwatch};
pub use table::{Cell, Table};
pub use work_folder::WorkFolder;

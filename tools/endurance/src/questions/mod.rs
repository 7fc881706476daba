//! The questions, one per file.

mod board;
mod day;
mod export;
mod flat_cost;
mod flushes;
mod hard_scans;
mod idle;
mod memory;
mod random_scans;
mod storage;
mod throughput;

use crate::findings::Findings;
use crate::setting::Setting;
use anyhow::Result;

pub struct Question {
    /// Name of the section in the page and for `--only`.
    pub name: &'static str,
    /// File of the promises, without extension.
    pub promises: &'static str,
    /// Runs the measurements.
    pub answer: fn(&Setting) -> Result<Findings>,
}

/// All questions, in the order of the page.
pub const QUESTIONS: [Question; 11] = [
    Question { name: "memory", promises: "memory_promises", answer: memory::answer },
    Question { name: "hard-scans", promises: "hard_scans_promises", answer: hard_scans::answer },
    Question { name: "random-scans", promises: "random_scans_promises", answer: random_scans::answer },
    Question { name: "throughput", promises: "throughput_promises", answer: throughput::answer },
    Question { name: "storage", promises: "storage_promises", answer: storage::answer },
    Question { name: "flat-cost", promises: "flat_cost_promises", answer: flat_cost::answer },
    Question { name: "flushes", promises: "flushes_promises", answer: flushes::answer },
    Question { name: "board", promises: "board_promises", answer: board::answer },
    Question { name: "day", promises: "day_promises", answer: day::answer },
    Question { name: "export", promises: "export_promises", answer: export::answer },
    Question { name: "idle", promises: "idle_promises", answer: idle::answer },
];

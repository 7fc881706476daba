//! The measurements of both versions: one module per section of the page.

mod answers;
mod files;
mod insertion;
mod local_map;
mod threads;

use crate::setting::Setting;
use anyhow::Result;
use report::Answer;

/// A section of the page.
pub struct Question {
    /// Name for `--only`.
    pub name: &'static str,
    /// Runs the measurements.
    pub answer: fn(&Setting) -> Result<Answer>,
}

/// All questions, in the order of the page.
pub const QUESTIONS: [Question; 5] = [
    Question { name: "insertion", answer: insertion::answer },
    Question { name: "threads", answer: threads::answer },
    Question { name: "questions", answer: answers::answer },
    Question { name: "files", answer: files::answer },
    Question { name: "local-map", answer: local_map::answer },
];

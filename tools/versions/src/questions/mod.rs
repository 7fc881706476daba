//! What is asked of both versions: a module for each section of the page.

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
    /// What `--only` takes.
    pub name: &'static str,
    /// Answers it.
    pub answer: fn(&Setting) -> Result<Answer>,
}

/// All of them, in the page's order.
pub const QUESTIONS: [Question; 5] = [
    Question { name: "insertion", answer: insertion::answer },
    Question { name: "threads", answer: threads::answer },
    Question { name: "questions", answer: answers::answer },
    Question { name: "files", answer: files::answer },
    Question { name: "local-map", answer: local_map::answer },
];

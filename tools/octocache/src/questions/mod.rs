//! The questions, one a file.

mod duplicates;
mod update_order;

use crate::answer::{Answer, Setting};
use anyhow::Result;

/// A question of the paper.
pub struct Question {
    /// Its section in the page, and what `--only` takes.
    pub name: &'static str,
    /// Measures.
    pub answer: fn(&Setting) -> Result<Answer>,
}

/// All of them, in the order of the page.
pub const QUESTIONS: [Question; 2] = [
    Question { name: "update-order", answer: update_order::answer },
    Question { name: "duplicates", answer: duplicates::answer },
];

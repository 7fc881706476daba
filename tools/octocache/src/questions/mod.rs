//! The questions, one per file.

mod bucket_depth;
mod cache_size;
mod duplicates;
mod first_answer;
mod stages;
mod update_order;
mod workflows;

use crate::setting::Setting;
use anyhow::Result;
use report::Answer;

/// A question of the paper.
pub struct Question {
    /// Name of the section in the page and for `--only`.
    pub name: &'static str,
    /// Runs the measurements.
    pub answer: fn(&Setting) -> Result<Answer>,
}

/// All questions, in the order of the page.
pub const QUESTIONS: [Question; 8] = [
    Question { name: "update-order", answer: update_order::answer },
    Question { name: "duplicates", answer: duplicates::answer },
    Question { name: "every-ray", answer: workflows::every_ray },
    Question { name: "once-a-scan", answer: workflows::once_a_scan },
    Question { name: "stages", answer: stages::answer },
    Question { name: "cache-size", answer: cache_size::answer },
    Question { name: "bucket-depth", answer: bucket_depth::answer },
    Question { name: "first-answer", answer: first_answer::answer },
];

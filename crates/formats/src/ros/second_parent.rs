use std::fmt;

/// A parent that a transform gives to a frame that has another one, or that is below the frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SecondParent {
    /// The frame.
    pub child: String,
    /// The parent that came last.
    pub parent: String,
    /// The parent that counts without it.
    pub before: Option<String>,
    /// The frames of the loop that it makes: from the parent up to the child; empty if it makes none.
    pub loop_frames: Vec<String>,
}

/// Longer names are cut, and longer loops.
const MAX_CHARS: usize = 60;
const MAX_FRAMES: usize = 8;

impl fmt::Display for SecondParent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (child, parent) = (name(&self.child), name(&self.parent));
        match &self.before {
            Some(before) => write!(f, "frame {child} has two parents: {} and {parent}", name(before))?,
            None => write!(f, "frame {child} has the parent {parent}")?,
        }
        if !self.loop_frames.is_empty() {
            let cut = if self.loop_frames.len() > MAX_FRAMES { " .." } else { "" };
            let frames: Vec<String> =
                self.loop_frames.iter().take(MAX_FRAMES).map(|frame| name(frame)).collect();
            write!(f, ", which makes a loop ({child} in {}{cut})", frames.join(" in "))?;
        }
        Ok(())
    }
}

/// What others sent is printed without what a terminal obeys.
fn name(frame: &str) -> String {
    let cut: String = frame.chars().take(MAX_CHARS).collect();
    cut.escape_debug().to_string()
}

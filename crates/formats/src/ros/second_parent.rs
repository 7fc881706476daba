use std::fmt;

/// A transform that gives a frame an additional parent, or a parent below the frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SecondParent {
    /// The frame.
    pub child: String,
    /// The latest parent.
    pub parent: String,
    /// Another parent of the frame, if it has one.
    pub before: Option<String>,
    /// Frames of the loop that the transform closes: from the parent up to the child. Empty if there is no loop.
    pub loop_frames: Vec<String>,
}

/// Limits for the length of a name and of a loop in messages.
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
            write!(f, ", which closes a loop ({child} in {}{cut})", frames.join(" in "))?;
        }
        Ok(())
    }
}

/// Escapes control characters, which a terminal would obey, in names from untrusted sources.
fn name(frame: &str) -> String {
    let cut: String = frame.chars().take(MAX_CHARS).collect();
    cut.escape_debug().to_string()
}

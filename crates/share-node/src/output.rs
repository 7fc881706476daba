//! What a person or a program reads. Either may be gone while there is still work to do, such as maps to write.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// Prints lines on standard output. A reader who is gone misses nothing.
///
/// # Errors
///
/// Any other failure, such as a full disk.
pub fn print(lines: impl Display) -> io::Result<()> {
    unless_gone(writeln!(io::stdout().lock(), "{lines}"))
}

/// Tells a person of something, on standard error. There is nowhere else to say that this failed.
pub fn tell(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "voxtile share: {text}");
}

fn unless_gone(printed: io::Result<()>) -> io::Result<()> {
    match printed {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        printed => printed,
    }
}

//! Output for people and programs. A closed pipe is no error: there may still be work to do, such as maps to write.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// Prints lines on standard output. A closed pipe is ignored.
///
/// # Errors
///
/// Any other failure, such as a full disk.
pub fn print(lines: impl Display) -> io::Result<()> {
    ignore_closed_pipe(writeln!(io::stdout().lock(), "{lines}"))
}

/// Prints a message on standard error. Ignores a failure, which could not be reported anyway.
pub fn report(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "voxtile share: {text}");
}

fn ignore_closed_pipe(printed: io::Result<()>) -> io::Result<()> {
    match printed {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        printed => printed,
    }
}

use super::failure::message_of;
use std::fmt;
use voxtile::Error;

/// Why a command that was called as a function failed.
#[derive(Debug)]
pub struct CallError {
    message: String,
    error: Option<Error>,
}

impl CallError {
    /// The error of the library behind it. The message of the whole may say more.
    pub fn library_error(&self) -> Option<&Error> {
        self.error.as_ref()
    }
}

impl fmt::Display for CallError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for CallError {}

impl From<anyhow::Error> for CallError {
    fn from(error: anyhow::Error) -> Self {
        Self { message: message_of(&error), error: error.downcast().ok() }
    }
}

impl From<Error> for CallError {
    fn from(error: Error) -> Self {
        Self { message: format!("{error:#}"), error: Some(error) }
    }
}

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Calls into a library that may panic on a damaged file, and makes an error of it. What the call was using may hold
/// nonsense after that: it is at most asked once more, guarded again.
pub(crate) fn guarded<T, E: std::fmt::Display>(call: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(result) => result.map_err(|error| error.to_string()),
        Err(_) => Err("the file is damaged: its library gave up".into()),
    }
}

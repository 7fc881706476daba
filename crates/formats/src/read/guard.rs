use std::cell::RefCell;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::Once;

thread_local! {
    /// First panic of each guarded call of this thread, from the outermost to the innermost call.
    static PANICS: RefCell<Vec<Option<String>>> = const { RefCell::new(Vec::new()) };
}

/// Calls a library that may panic on a damaged file, and converts a panic to an error without printing it. Afterwards,
/// the state used by the call may be inconsistent: use it at most once more, also guarded.
#[cfg(any(feature = "las", feature = "e57"))]
pub(crate) fn guarded<T, E: std::fmt::Display>(call: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    catch(call).map_or_else(
        |place| Err(format!("its decoder failed ({place}): the file is damaged or of an unsupported kind")),
        |result| result.map_err(|error| error.to_string()),
    )
}

/// Returns the result of a call, or the source location of its panic.
pub(crate) fn catch<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !note(info) {
                print(info);
            }
        }));
    });
    PANICS.with_borrow_mut(|panics| panics.push(None));
    let result = catch_unwind(AssertUnwindSafe(call));
    let place = PANICS.with_borrow_mut(Vec::pop).flatten();
    result.map_err(|_| place.unwrap_or_default())
}

/// Records a panic of this thread. Returns `false` if no guarded call is active.
fn note(info: &PanicHookInfo<'_>) -> bool {
    PANICS
        .try_with(|panics| {
            let Ok(mut panics) = panics.try_borrow_mut() else { return false };
            let Some(panic) = panics.last_mut() else { return false };
            let place = info.location().map(|place| {
                // The file name is enough: the folder is a path of the build machine.
                let file = place.file().rsplit(['/', '\\']).next().unwrap_or_default();
                format!("{file}:{}", place.line())
            });
            *panic = panic.take().or(place);
            true
        })
        .unwrap_or(false)
}

#[cfg(test)]
mod tests {
    #[cfg(any(feature = "las", feature = "e57"))]
    use super::*;

    #[cfg(any(feature = "las", feature = "e57"))]
    #[test]
    fn panics_become_errors_with_their_location() {
        let inner = guarded(|| -> Result<(), String> {
            assert!(
                guarded(|| -> Result<(), String> { panic!("inner") }).unwrap_err().contains("(guard.rs:")
            );
            panic!("outer")
        });
        assert!(inner.unwrap_err().contains("its decoder failed (guard.rs:"));
        assert_eq!(guarded(|| Ok::<_, String>(5)), Ok(5));
        assert_eq!(guarded(|| Err::<(), _>("no")), Err("no".to_owned()));
        PANICS.with_borrow(|panics| assert!(panics.is_empty()));
    }
}

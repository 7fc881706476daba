//! Restricts glibc to one heap, so that a memory limit holds.

/// glibc reads this variable only when a process starts.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const HEAPS: &str = "MALLOC_ARENA_MAX";

/// Restarts the process with a single heap, unless `MALLOC_ARENA_MAX` is set.
///
/// For programs with a memory limit: call it first in `main`, before starting threads or reading standard input. glibc
/// gives each thread its own heap, and threads cannot use free memory of other heaps. A build limited to 64 MiB used
/// 133 MiB of system memory with two heaps and 89 MiB with one, in the same time. If the restart fails, the program
/// continues unchanged. With other C libraries this does nothing.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn begin_with_one_heap() {
    use std::os::unix::process::CommandExt;
    if std::env::var_os(HEAPS).is_some() {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    let mut arguments = std::env::args_os();
    let mut command = std::process::Command::new(program);
    if let Some(name) = arguments.next() {
        command.arg0(name);
    }
    let error = command.args(arguments).env(HEAPS, "1").exec();
    log::debug!("cannot restart with one heap: {error}");
}

/// Does nothing on other systems.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn begin_with_one_heap() {}

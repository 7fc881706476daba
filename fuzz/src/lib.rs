//! Shared code of the fuzz targets, which `run.sh` builds and runs.

use cap::Cap;
use std::alloc::System;

/// Bodies of the targets. The integration tests replay the corpus through the same code.
#[path = "../../tests/all/fuzz_corpus/targets.rs"]
pub mod targets;

/// Targets of the crate for other programs' file formats.
#[path = "../../crates/formats/tests/fuzz_corpus/targets.rs"]
pub mod clouds;

/// Memory limit. An input has at most 64 KiB; an allocation beyond this limit fails and is a finding.
const MAX_BYTES: usize = 64 << 20;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, MAX_BYTES);

/// Lets panics of the crates `las` and `e57` unwind to our readers, which convert them to errors; the panic hook of
/// libFuzzer would end the program first. A panic that no reader catches still ends the program, in libFuzzer's own
/// frame. The memory limit applies to these crates, too, because no reader could catch a failed allocation.
pub fn catch_panics() {
    std::panic::set_hook(Box::new(|_| {}));
}

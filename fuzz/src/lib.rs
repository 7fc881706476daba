//! What the fuzz targets share; `run.sh` builds and runs them.

use cap::Cap;
use std::alloc::System;

/// Bodies of the targets; the ordinary tests replay the corpus through the same.
#[path = "../../tests/all/fuzz_corpus/targets.rs"]
pub mod targets;

/// The same of the crate of other programs' files.
#[path = "../../crates/formats/tests/fuzz_corpus/targets.rs"]
pub mod clouds;

/// No input of 64 KiB may need more memory: beyond it an allocation fails, which is a finding.
const MAX_BYTES: usize = 64 << 20;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, MAX_BYTES);

/// Lets panics of the crates `las` and `e57` unwind to the readers here, which make errors of them; the hook of
/// libFuzzer would end the program before. A panic that comes through all readers still ends it: libFuzzer's own frame
/// stops it there. The memory limit holds for these crates, too, as no reader could catch a failed allocation.
pub fn catch_panics() {
    std::panic::set_hook(Box::new(|_| {}));
}

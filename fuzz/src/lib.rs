//! What the fuzz targets share; `run.sh` builds and runs them.

use cap::Cap;
use std::alloc::System;

/// Bodies of the targets; the ordinary tests replay the corpus through the same.
#[path = "../../tests/all/fuzz_corpus/targets.rs"]
pub mod targets;

/// No input of 64 KiB may need more memory: beyond it an allocation fails, which is a finding.
const MAX_BYTES: usize = 64 << 20;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, MAX_BYTES);

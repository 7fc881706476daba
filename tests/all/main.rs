//! All integration tests in one binary, a module a subject.

/// The same sentences about every mapper: equal to the naive one, to the bit.
mod mapper_contract;
/// OctoMap's own files, to the last node and byte.
mod octomap_files;
mod support;

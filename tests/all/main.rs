//! All integration tests in one binary, a module a subject.

/// The same sentences about every mapper: equal to the naive one, to the bit.
mod mapper_contract;
mod support;

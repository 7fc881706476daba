//! Generators of small test files.
#![allow(dead_code)]

pub mod bag1;
#[cfg(feature = "las")]
pub mod las;
pub mod message;
pub mod voxels;

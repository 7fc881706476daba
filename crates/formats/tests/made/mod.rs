//! Small files that tests make.
#![allow(dead_code)]

pub mod bag1;
pub mod message;
pub mod voxels;

use std::io::{Read, Seek, Write};

/// A file of nobody else's, for what has no room in memory for a while: it has no name, and goes when it is dropped.
pub trait Scratch: Read + Write + Seek + Send {}

impl<T: Read + Write + Seek + Send> Scratch for T {}

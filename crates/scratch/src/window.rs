use memmap2::Mmap;
use std::ops::Deref;

/// A part of a file as memory. It outlives the file.
#[derive(Debug)]
pub struct Window {
    /// An empty part has none.
    pub(crate) mapping: Option<Mmap>,
}

impl Deref for Window {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.mapping.as_deref().unwrap_or_default()
    }
}

use memmap2::Mmap;
use std::ops::Deref;

/// Memory map of a part of a file. It can outlive the file.
#[derive(Debug)]
pub struct Window {
    /// `None` for an empty part.
    pub(crate) mapping: Option<Mmap>,
}

impl Deref for Window {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.mapping.as_deref().unwrap_or_default()
    }
}

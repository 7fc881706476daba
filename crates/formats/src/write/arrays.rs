use super::Result;
use super::npz::npy_head;
use super::zip_store::ZipStore;
use std::io::Read;
use std::path::Path;

/// Array of a `.npz` file, in C order.
#[derive(Clone, Debug)]
pub struct NpyArray {
    /// Name in the archive, which ends in `.npy`.
    pub name: &'static str,
    /// NumPy's name of the type, little-endian, such as `<f4`.
    pub kind: &'static str,
    /// Lengths of the axes; a number has none.
    pub shape: Vec<usize>,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Writes arrays to an uncompressed `.npz` file.
///
/// # Errors
///
/// An I/O error.
pub fn write_arrays(path: &Path, arrays: &[NpyArray]) -> Result<()> {
    let mut zip = ZipStore::create(path)?;
    for NpyArray { name, kind, shape, bytes } in arrays {
        let lengths: String = shape.iter().map(|length| format!("{length}, ")).collect();
        let head = npy_head(kind, &format!("({lengths})"));
        let mut crc = crc32fast::Hasher::new();
        crc.update(&head);
        crc.update(bytes);
        let length = (head.len() + bytes.len()) as u64;
        let parts: &mut [&mut dyn Read] = &mut [&mut head.as_slice(), &mut bytes.as_slice()];
        zip.entry(name, crc.finalize(), length, parts)?;
    }
    zip.finish()
}

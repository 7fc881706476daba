use anyhow::Result;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes an array of numpy, by z, y, x.
pub fn write(path: &Path, shape: [usize; 3], kind: &str, bytes: impl Iterator<Item = Vec<u8>>) -> Result<()> {
    let [z, y, x] = shape;
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({z}, {y}, {x}), }}");
    let padding = 63 - (10 + head.len()) % 64;
    let mut out = BufWriter::new(File::create(path)?);
    out.write_all(b"\x93NUMPY\x01\0")?;
    out.write_all(&((head.len() + padding + 1) as u16).to_le_bytes())?;
    writeln!(out, "{head}{}", " ".repeat(padding))?;
    for bytes in bytes {
        out.write_all(&bytes)?;
    }
    Ok(out.flush()?)
}

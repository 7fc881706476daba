//! TIFF and BigTIFF files: data first, then the directory that refers to it.

use super::out_file::OutFile;
use super::{Error, Result};
use std::io::{Seek, SeekFrom};
use std::path::Path;

/// Space for the header of either form.
const HEADER_BYTES: u64 = 16;

/// TIFF file. Data is written first. Whether offsets need 64 bits (BigTIFF) is known at the end.
pub(super) struct TiffFile {
    out: OutFile,
}

/// Values of a field of the directory.
pub(super) enum Values<'a> {
    Shorts(Vec<u16>),
    Longs(Vec<u32>),
    Doubles(Vec<f64>),
    Text(String),
    /// Offsets or lengths in the file: their number, and the value at a position.
    Places(u64, &'a dyn Fn(u64) -> u64),
}

/// Form of the file: 32-bit or 64-bit offsets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Classic,
    Big,
}

impl Form {
    /// Returns the bytes of an offset or of a number of values.
    fn offset_bytes(self) -> usize {
        if self == Self::Big { 8 } else { 4 }
    }

    fn put_offset(self, bytes: &mut Vec<u8>, offset: u64) {
        bytes.extend(&offset.to_le_bytes()[..self.offset_bytes()]);
    }
}

impl Values<'_> {
    /// Returns the type of the field, and the number and the bytes of its values.
    fn kind(&self, form: Form) -> (u16, u64, u64) {
        match self {
            Self::Text(text) => (2, text.len() as u64 + 1, 1),
            Self::Shorts(values) => (3, values.len() as u64, 2),
            Self::Longs(values) => (4, values.len() as u64, 4),
            Self::Doubles(values) => (12, values.len() as u64, 8),
            Self::Places(count, _) => {
                (if form == Form::Big { 16 } else { 4 }, *count, form.offset_bytes() as u64)
            }
        }
    }

    /// Visits the bytes of the values, some at a time.
    fn for_each_chunk(&self, form: Form, mut visit: impl FnMut(&[u8]) -> Result<()>) -> Result<()> {
        match self {
            Self::Text(text) => visit(&[text.as_bytes(), &[0]].concat()),
            Self::Shorts(values) => values.iter().try_for_each(|value| visit(&value.to_le_bytes())),
            Self::Longs(values) => values.iter().try_for_each(|value| visit(&value.to_le_bytes())),
            Self::Doubles(values) => values.iter().try_for_each(|value| visit(&value.to_le_bytes())),
            Self::Places(count, place) => {
                (0..*count).try_for_each(|at| visit(&place(at).to_le_bytes()[..form.offset_bytes()]))
            }
        }
    }
}

impl TiffFile {
    pub(super) fn create(path: &Path) -> Result<Self> {
        let mut out = OutFile::create(path)?;
        out.write(&[0; HEADER_BYTES as usize])?;
        Ok(Self { out })
    }

    pub(super) fn path(&self) -> &Path {
        self.out.path()
    }

    /// Appends data. Returns its offset.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<u64> {
        let offset = self.out.len();
        self.out.write(bytes)?;
        Ok(offset)
    }

    /// Writes the directory and completes the file. The fields are in the order of their tags.
    pub(super) fn finish(self, fields: &[(u16, Values<'_>)]) -> Result<()> {
        // The directory itself is included.
        let bytes: u64 =
            fields.iter().map(|(_, values)| 28 + values.kind(Form::Big).1 * values.kind(Form::Big).2).sum();
        let form = match self.out.len() + bytes + 64 > u64::from(u32::MAX) {
            true => Form::Big,
            false => Form::Classic,
        };
        self.finish_as(form, fields)
    }

    fn finish_as(mut self, form: Form, fields: &[(u16, Values<'_>)]) -> Result<()> {
        let mut directory = Vec::new();
        match form {
            Form::Big => directory.extend((fields.len() as u64).to_le_bytes()),
            Form::Classic => directory.extend((fields.len() as u16).to_le_bytes()),
        }
        for (tag, values) in fields {
            let (kind, count, bytes) = values.kind(form);
            directory.extend(tag.to_le_bytes());
            directory.extend(kind.to_le_bytes());
            form.put_offset(&mut directory, count);
            let end = directory.len() + form.offset_bytes();
            if count * bytes <= form.offset_bytes() as u64 {
                values.for_each_chunk(form, |chunk| {
                    directory.extend(chunk);
                    Ok(())
                })?;
                directory.resize(end, 0);
                continue;
            }
            self.align()?;
            form.put_offset(&mut directory, self.out.len());
            values.for_each_chunk(form, |chunk| self.out.write(chunk))?;
        }
        // There is no further directory.
        form.put_offset(&mut directory, 0);
        self.align()?;
        let at = self.out.len();
        self.out.write(&directory)?;
        let mut header = b"II".to_vec();
        match form {
            Form::Classic => header.extend(42_u16.to_le_bytes()),
            Form::Big => header.extend([43_u16, 8, 0].iter().flat_map(|value| value.to_le_bytes())),
        }
        form.put_offset(&mut header, at);
        let path = self.out.path().to_owned();
        self.out.seek(SeekFrom::Start(0)).map_err(|error| Error::io(&path, "write", error))?;
        self.out.write(&header)?;
        self.out.finish()
    }

    /// Offsets are even, in BigTIFF multiples of eight.
    fn align(&mut self) -> Result<()> {
        let excess = (self.out.len() % 8) as usize;
        if excess == 0 { Ok(()) } else { self.out.write(&[0; 8][excess..]) }
    }
}

/// Reader of the directory, for tests.
#[cfg(test)]
pub(super) mod reader {
    use std::collections::BTreeMap;

    /// Returns the values of each field, by tag; doubles as their bits.
    pub(in crate::write) fn fields_of(bytes: &[u8]) -> BTreeMap<u64, Vec<u64>> {
        let number = |at: usize, of: usize| {
            bytes[at..at + of].iter().rev().fold(0, |all, &byte| all << 8 | u64::from(byte))
        };
        let is_big = match &bytes[..4] {
            b"II\x2a\0" => false,
            b"II\x2b\0" => true,
            other => panic!("{other:?}"),
        };
        let (size, count_bytes) = if is_big { (8, 8) } else { (4, 2) };
        let directory = number(size, size) as usize;
        let field = |field: usize| {
            let at = directory + count_bytes + field * (4 + 2 * size);
            let (tag, kind, count) = (number(at, 2), number(at + 2, 2), number(at + 4, size));
            let bytes = match kind {
                2 => 1,
                3 => 2,
                4 => 4,
                12 | 16 => 8,
                other => panic!("type {other} of tag {tag}"),
            };
            let values = at + 4 + size;
            let is_inside = count as usize * bytes <= size;
            let values = if is_inside { values } else { number(values, size) as usize };
            (tag, (0..count as usize).map(|k| number(values + k * bytes, bytes)).collect())
        };
        let fields: Vec<(u64, Vec<u64>)> = (0..number(directory, count_bytes) as usize).map(field).collect();
        assert!(fields.is_sorted_by_key(|(tag, _)| *tag));
        fields.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::reader::fields_of;
    use super::*;

    #[test]
    fn both_forms_hold_the_same_fields() {
        let folder = tempfile::tempdir().unwrap();
        for form in [Form::Classic, Form::Big] {
            let path = folder.path().join(format!("{form:?}.tif"));
            let mut file = TiffFile::create(&path).unwrap();
            assert_eq!((file.append(b"some").unwrap(), file.append(b"more!").unwrap()), (16, 20));
            let place = |at: u64| 16 + 4 * at;
            let fields = [
                (256, Values::Longs(vec![3])),
                (258, Values::Shorts(vec![32, 32, 32])),
                (305, Values::Text("voxtile".to_owned())),
                (324, Values::Places(2, &place)),
                (33550, Values::Doubles(vec![0.5, 0.25])),
            ];
            file.finish_as(form, &fields).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(&bytes[16..25], b"somemore!");
            assert_eq!(bytes[2], if form == Form::Big { 43 } else { 42 });
            let expected = [
                (256, vec![3]),
                (258, vec![32; 3]),
                (305, b"voxtile\0".iter().map(|&byte| u64::from(byte)).collect()),
                (324, vec![16, 20]),
                (33550, vec![0.5_f64.to_bits(), 0.25_f64.to_bits()]),
            ];
            assert_eq!(fields_of(&bytes), expected.into_iter().collect(), "{form:?}");
        }
    }
}

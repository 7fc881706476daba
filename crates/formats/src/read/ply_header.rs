use super::scalar::Scalar;
use std::io::{BufRead, Read};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// How the numbers of a PLY file are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Scalar,
    /// Type of the length, if this is a list.
    pub(super) list: Option<Scalar>,
}

/// Elements of one kind: vertices, faces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Bytes of one, if all are alike.
    pub(super) fn bytes(&self) -> Option<u64> {
        let one = |property: &Property| property.list.is_none().then(|| property.kind.bytes() as u64);
        self.properties.iter().map(one).sum()
    }
}

/// What a PLY file says before its numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) lines: u64,
    pub(super) bytes: u64,
}

/// A longer header is an error.
const MAX_HEADER_BYTES: u64 = 1 << 20;

impl Header {
    pub(super) fn read(path: &Path, input: &mut impl BufRead) -> Result<Self> {
        let mut header = Self { encoding: Encoding::Ascii, elements: Vec::new(), lines: 0, bytes: 0 };
        let mut encoding = None;
        let mut line = Vec::new();
        loop {
            line.clear();
            let left = MAX_HEADER_BYTES - header.bytes;
            let read = (&mut *input).take(left).read_until(b'\n', &mut line);
            header.bytes += read.map_err(|error| Error::io(path, "read", error))? as u64;
            header.lines += 1;
            let wrong = |reason: String| FormatError::at_line(header.lines, reason).in_input(path);
            if line.last() != Some(&b'\n') {
                return Err(wrong("the header has no end_header".into()));
            }
            let text = String::from_utf8_lossy(&line).trim().to_owned();
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            match words.as_slice() {
                ["ply"] | [] | ["comment" | "obj_info", ..] => {}
                ["format", name, ..] => {
                    encoding = Some(match *name {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        other => return Err(wrong(format!("format `{other}` is not known"))),
                    });
                }
                ["element", name, count] => {
                    let count =
                        count.parse().map_err(|_| wrong(format!("`{count}` is no number of elements")))?;
                    header.elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                ["property", rest @ ..] => {
                    let property = property(rest).map_err(&wrong)?;
                    let element = header.elements.last_mut();
                    element
                        .ok_or_else(|| wrong("a property without an element".into()))?
                        .properties
                        .push(property);
                }
                ["end_header"] => break,
                _ => return Err(wrong(format!("`{text:.60}` is no line of a header of PLY"))),
            }
        }
        header.encoding = encoding
            .ok_or_else(|| FormatError::at_line(header.lines, "the header has no format").in_input(path))?;
        Ok(header)
    }
}

fn property(words: &[&str]) -> std::result::Result<Property, String> {
    match words {
        ["list", count, kind, name] => {
            let count = scalar(count)?;
            if !count.is_integer() {
                return Err("the length of a list must be an integer".into());
            }
            Ok(Property { name: (*name).to_owned(), kind: scalar(kind)?, list: Some(count) })
        }
        [kind, name] => Ok(Property { name: (*name).to_owned(), kind: scalar(kind)?, list: None }),
        _ => Err(format!("`property {}` is not a type and a name", words.join(" "))),
    }
}

fn scalar(name: &str) -> std::result::Result<Scalar, String> {
    Ok(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "int64" | "long" => Scalar::I64,
        "uint64" | "ulong" => Scalar::U64,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        other => return Err(format!("type `{other}` is not known")),
    })
}

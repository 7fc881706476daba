use super::foreign::BYTE_ORDER_MARK;
use super::scalar::Scalar;
use super::text_header::unit_of_comment;
use std::io::{BufRead, Read};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Encoding of the numbers in a PLY file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Scalar,
    /// Type of the list length, if the property is a list.
    pub(super) list: Option<Scalar>,
}

/// Element type, such as vertices or faces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Returns the size of one element, if it is fixed.
    pub(super) fn bytes(&self) -> Option<u64> {
        let one = |property: &Property| property.list.is_none().then(|| property.kind.bytes() as u64);
        self.properties.iter().map(one).sum()
    }
}

/// Header of a PLY file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) lines: u64,
    pub(super) bytes: u64,
    /// A comment that mentions a unit other than metres, with its line number.
    pub(super) unit: Option<(u64, String)>,
}

/// Limit for the size of the header.
const MAX_HEADER_BYTES: u64 = 1 << 20;

/// Returns whether a file starts with a line `ply`, possibly followed by blanks.
pub(crate) fn is_start(start: &[u8]) -> bool {
    let end = start.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
    let line = end.and_then(|end| start.get(..end)).unwrap_or_default();
    line.trim_ascii().eq_ignore_ascii_case(b"ply")
}

impl Header {
    pub(super) fn read(path: &Path, input: &mut impl BufRead) -> Result<Self> {
        let mut header =
            Self { encoding: Encoding::Ascii, elements: Vec::new(), lines: 0, bytes: 0, unit: None };
        let (mut encoding, mut line, mut end) = (None, Vec::new(), b'\n');
        loop {
            line.clear();
            let left = MAX_HEADER_BYTES - header.bytes;
            let mut limited = (&mut *input).take(left);
            let read = if header.lines == 0 {
                end = first_line(&mut limited, &mut line).map_err(|error| Error::io(path, "read", error))?;
                line.len()
            } else {
                limited.read_until(end, &mut line).map_err(|error| Error::io(path, "read", error))?
            };
            header.bytes += read as u64;
            header.lines += 1;
            let wrong = |reason: String| FormatError::at_line(header.lines, reason).in_input(path);
            if line.last() != Some(&end) {
                let is_empty = header.bytes == 0;
                let reason = if is_empty { "the file is empty" } else { "the header has no end_header" };
                return Err(wrong(reason.into()));
            }
            let line = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&line);
            let text = String::from_utf8_lossy(line).trim().to_owned();
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            let Some((key, rest)) = words.split_first() else { continue };
            match (key.to_ascii_lowercase().as_str(), rest) {
                ("ply", []) => {}
                ("comment" | "obj_info", _) => {
                    if unit_of_comment(&text).is_some() {
                        header.unit.get_or_insert((header.lines, text));
                    }
                }
                ("format", [name, ..]) => {
                    encoding = Some(match name.to_ascii_lowercase().as_str() {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        other => return Err(wrong(format!("format `{other:.40}` is unknown"))),
                    });
                }
                ("element", [name, count]) => {
                    let count = count
                        .parse()
                        .map_err(|_| wrong(format!("`{count:.40}` is not a number of elements")))?;
                    header.elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                ("property", rest) => {
                    let property = property(rest).map_err(&wrong)?;
                    let element = header.elements.last_mut();
                    element
                        .ok_or_else(|| wrong("the property has no element".into()))?
                        .properties
                        .push(property);
                }
                ("end_header", []) => break,
                _ => return Err(wrong(format!("`{text:.60}` is not a line of a PLY header"))),
            }
        }
        header.encoding = encoding
            .ok_or_else(|| FormatError::at_line(header.lines, "the header has no format").in_input(path))?;
        Ok(header)
    }
}

/// Reads the first line and returns the last byte of line ends: CR if the line ends with CR alone, else LF.
fn first_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> std::io::Result<u8> {
    loop {
        let Some(&byte) = input.fill_buf()?.first() else { return Ok(b'\n') };
        input.consume(1);
        line.push(byte);
        if byte == b'\n' {
            return Ok(byte);
        }
        if byte == b'\r' {
            let has_more = input.fill_buf()?.first() == Some(&b'\n');
            if has_more {
                input.consume(1);
                line.push(b'\n');
            }
            return Ok(if has_more { b'\n' } else { byte });
        }
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
    Scalar::named(name).ok_or_else(|| format!("type `{name:.40}` is unknown"))
}

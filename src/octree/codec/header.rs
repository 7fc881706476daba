use super::OctreeFormat;
use super::input::Input;
use super::number::to_six_digits;
use crate::error::{DecodeError, FormatError};
use std::io::{self, BufRead, ErrorKind, Write};

#[derive(Debug)]
pub(super) struct Header {
    pub format: OctreeFormat,
    /// Class name of the tree; `OcTree` if the file has OctoMap's earlier `1` or none (legacy).
    pub id: String,
    pub nodes: u64,
    pub resolution_m: f64,
}

const SECOND_LINES: &str =
    "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n";

/// Far longer than any real header; bounds the search for `data` in other files.
const MAX_HEADER_BYTES: u64 = 1 << 16;

/// First field of the format before text headers.
const LEGACY_TREE_TYPE: [u8; 4] = 3_i32.to_le_bytes();

impl OctreeFormat {
    /// Start of the first line.
    const fn magic(self) -> &'static str {
        match self {
            Self::Bt => "# Octomap OcTree binary file",
            Self::Ot | Self::ColorOt => "# Octomap OcTree file",
        }
    }

    /// OctoMap's class name of the tree that is written.
    const fn class(self) -> &'static str {
        match self {
            Self::Bt | Self::Ot => "OcTree",
            Self::ColorOt => "ColorOcTree",
        }
    }

    /// Detects the format of a file with a text header from its first bytes.
    pub(crate) fn of_first_bytes(bytes: &[u8]) -> Option<Self> {
        [Self::Bt, Self::Ot].into_iter().find(|format| bytes.starts_with(format.magic().as_bytes()))
    }
}

/// Writes the header that OctoMap writes.
pub(super) fn write_header(
    out: &mut impl Write,
    format: OctreeFormat,
    nodes: u64,
    resolution_m: f64,
) -> io::Result<()> {
    if !is_resolution(resolution_m) {
        let reason = format!("resolution {resolution_m} m is not a positive, finite length");
        return Err(io::Error::new(ErrorKind::InvalidInput, reason));
    }
    let (magic, class, resolution) = (format.magic(), format.class(), to_six_digits(resolution_m));
    let header = format!("{magic}{SECOND_LINES}id {class}\nsize {nodes}\nres {resolution}\ndata\n");
    out.write_all(header.as_bytes())
}

/// Reads the header of either format; the nodes follow.
pub(super) fn read_header(input: &mut Input<impl BufRead>) -> Result<Header, DecodeError> {
    let first_bytes = input.take("the header")?;
    if first_bytes == LEGACY_TREE_TYPE {
        return read_legacy_header(input);
    }
    let mut first_line = first_bytes.to_vec();
    while let Some(byte) = next_header_byte(input)?.filter(|&byte| byte != b'\n') {
        first_line.push(byte);
    }
    let format = OctreeFormat::of_first_bytes(&first_line).ok_or_else(|| {
        FormatError::at_offset(0, "the first line is not that of an OctoMap .bt or .ot file")
    })?;
    read_fields(input, format)
}

/// Reads the words of a text header up to the `data` line. The last of duplicates is used.
fn read_fields(input: &mut Input<impl BufRead>, format: OctreeFormat) -> Result<Header, DecodeError> {
    let (mut id, mut nodes, mut resolution_m) = (None, 0, None);
    loop {
        match next_word(input)?.as_str() {
            "id" => id = Some(next_word(input)?),
            "size" => nodes = next_value(input, "size", "a whole number")?,
            "res" => resolution_m = Some(next_value(input, "res", "a number")?),
            "data" => break,
            // A comment, or a word of a later OctoMap version.
            _ => skip_line(input)?,
        }
    }
    skip_line(input)?;
    let id = match id.ok_or_else(|| input.error("the header has no id"))? {
        id if id == "1" => "OcTree".to_owned(),
        id => id,
    };
    let resolution_m = resolution_m.ok_or_else(|| input.error("the header has no res"))?;
    checked(Header { format, id, nodes, resolution_m }, input)
}

/// Reads the rest of a binary header: resolution and number of nodes.
fn read_legacy_header(input: &mut Input<impl BufRead>) -> Result<Header, DecodeError> {
    let resolution_m = f64::from_le_bytes(input.take("the resolution")?);
    let nodes = u32::from_le_bytes(input.take("the number of nodes")?).into();
    checked(Header { format: OctreeFormat::Bt, id: "OcTree".to_owned(), nodes, resolution_m }, input)
}

fn checked(header: Header, input: &Input<impl BufRead>) -> Result<Header, DecodeError> {
    if is_resolution(header.resolution_m) {
        Ok(header)
    } else {
        let reason = format!("resolution {} m is not a positive, finite length", header.resolution_m);
        Err(input.error(reason).into())
    }
}

fn is_resolution(length_m: f64) -> bool {
    length_m.is_finite() && length_m > 0.0
}

/// Reads the next word of a header, without the character that ends it.
fn next_word(input: &mut Input<impl BufRead>) -> Result<String, DecodeError> {
    while input.peek()?.is_some_and(is_space) {
        next_header_byte(input)?;
    }
    let mut word = Vec::new();
    while input.peek()?.is_some_and(|byte| !is_space(byte)) {
        word.extend(next_header_byte(input)?);
    }
    if word.is_empty() {
        return Err(input.error("the file ends before the line `data` of its header").into());
    }
    Ok(String::from_utf8_lossy(&word).into_owned())
}

fn next_value<T: std::str::FromStr>(
    input: &mut Input<impl BufRead>,
    name: &str,
    kind: &str,
) -> Result<T, DecodeError> {
    let word = next_word(input)?;
    let value =
        word.parse().map_err(|_| input.error(format!("{name} {word:?} in the header is not {kind}")))?;
    Ok(value)
}

fn skip_line(input: &mut Input<impl BufRead>) -> Result<(), DecodeError> {
    while next_header_byte(input)?.is_some_and(|byte| byte != b'\n') {}
    Ok(())
}

fn next_header_byte(input: &mut Input<impl BufRead>) -> Result<Option<u8>, DecodeError> {
    if input.offset() >= MAX_HEADER_BYTES {
        return Err(input.error("no line `data` in the first 64 KiB").into());
    }
    input.next()
}

/// Returns whether C++ streams treat a byte as white space.
fn is_space(byte: u8) -> bool {
    byte == b' ' || (b'\t'..=b'\r').contains(&byte)
}

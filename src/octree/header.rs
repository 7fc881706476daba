use crate::error::{DecodeError, FormatError};
use std::io::{BufRead, Read, Write};

/// First line of a `.bt` file.
pub(super) const BT_MAGIC: &str = "# Octomap OcTree binary file";
/// First line of an `.ot` file.
pub(super) const OT_MAGIC: &str = "# Octomap OcTree file";
/// A text header longer than this is none.
const MAX_BYTES: u64 = 1 << 16;

/// What the text header says.
#[derive(Debug, Default)]
pub(super) struct Header {
    pub id: String,
    pub nodes: u64,
    pub resolution_m: f64,
}

/// A stream that knows how far it was read.
pub(super) struct Counted<R> {
    input: R,
    pub offset: u64,
}

impl<R: BufRead> Counted<R> {
    pub(super) fn new(input: R) -> Self {
        Self { input, offset: 0 }
    }

    /// Reads exactly so many bytes; what is missing is an error of the format.
    pub(super) fn bytes<const N: usize>(&mut self, what: &str) -> Result<[u8; N], DecodeError> {
        let mut bytes = [0; N];
        match self.input.read_exact(&mut bytes) {
            Ok(()) => {
                self.offset += N as u64;
                Ok(bytes)
            }
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
                Err(FormatError::at_offset(self.offset, format!("the file ends in {what}")).into())
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The next byte; `None` at the end.
    fn byte(&mut self) -> Result<Option<u8>, DecodeError> {
        let byte = self.input.by_ref().bytes().next().transpose()?;
        self.offset += u64::from(byte.is_some());
        Ok(byte)
    }

    fn rest_of_line(&mut self) -> Result<String, DecodeError> {
        let mut line = Vec::new();
        while let Some(byte) = self.byte()?.filter(|&byte| byte != b'\n') {
            line.push(byte);
            self.check_length()?;
        }
        Ok(String::from_utf8_lossy(&line).into_owned())
    }

    /// The next word and the white space that ended it.
    fn word(&mut self) -> Result<(String, Option<u8>), DecodeError> {
        let mut word = Vec::new();
        loop {
            match self.byte()? {
                Some(byte) if !byte.is_ascii_whitespace() => word.push(byte),
                end if end.is_none() || !word.is_empty() => {
                    return Ok((String::from_utf8_lossy(&word).into_owned(), end));
                }
                _ => {}
            }
            self.check_length()?;
        }
    }

    fn check_length(&self) -> Result<(), DecodeError> {
        if self.offset <= MAX_BYTES {
            return Ok(());
        }
        Err(FormatError::at_offset(self.offset, "no end of the text header; this is no octree file").into())
    }
}

/// Writes the header as OctoMap does.
pub(super) fn write_header(
    magic: &str,
    id: &str,
    nodes: usize,
    resolution_m: f64,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let resolution = six_digits(resolution_m);
    write!(
        out,
        "{magic}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid {id}\nsize \
         {nodes}\nres {resolution}\ndata\n"
    )
}

/// Reads the lines after the first: keys in any order, comments and unknown keys skipped to the end of their line.
pub(super) fn read_header<R: BufRead>(input: &mut Counted<R>) -> Result<Header, DecodeError> {
    let mut header = Header::default();
    loop {
        let at = input.offset;
        let (word, end) = input.word()?;
        if end.is_none() {
            return Err(FormatError::at_offset(at, "the header ends without the line `data`").into());
        }
        match word.as_str() {
            "data" => {
                if end != Some(b'\n') {
                    input.rest_of_line()?;
                }
                break;
            }
            "id" => header.id = input.word()?.0,
            "size" => header.nodes = number(input, "size")?,
            "res" => header.resolution_m = number(input, "res")?,
            _ if end != Some(b'\n') => drop(input.rest_of_line()?),
            _ => {}
        }
    }
    check_resolution(header.resolution_m, input.offset)?;
    Ok(header)
}

pub(super) fn check_resolution(resolution_m: f64, offset: u64) -> Result<(), FormatError> {
    if resolution_m > 0.0 && resolution_m.is_finite() {
        return Ok(());
    }
    Err(FormatError::at_offset(offset, format!("the resolution {resolution_m} m is not a positive length")))
}

fn number<R: BufRead, N: std::str::FromStr>(input: &mut Counted<R>, key: &str) -> Result<N, DecodeError> {
    let at = input.offset;
    let (word, _) = input.word()?;
    word.parse().map_err(|_| FormatError::at_offset(at, format!("`{key} {word}` is not a number")).into())
}

/// A number as C++ streams print it by default: six significant digits, trailing zeros dropped, an exponent below
/// 1e-4 and from 1e6 on.
fn six_digits(value: f64) -> String {
    let scientific = format!("{value:.5e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let without_zeros = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if (-4..6).contains(&exponent) {
        return without_zeros(&format!("{value:.*}", (5 - exponent) as usize));
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", without_zeros(digits), exponent.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_printed_as_cpp_streams_do() {
        let printed = [
            (0.1, "0.1"),
            (0.05, "0.05"),
            (0.123456789, "0.123457"),
            (1.0, "1"),
            (1e-5, "1e-05"),
            (0.0001, "0.0001"),
            (123456.7, "123457"),
            (1234567.0, "1.23457e+06"),
            (999999.9, "1e+06"),
            (12345678.9, "1.23457e+07"),
            (1e100, "1e+100"),
            (0.2, "0.2"),
            (100.0, "100"),
        ];
        for (value, text) in printed {
            assert_eq!(six_digits(value), text);
        }
    }
}

use std::io::{self, Read, Write};

/// Maximum distance of a copy, in bytes.
const WINDOW_BYTES: usize = 1 << 13;
/// Size of output writes.
const OUT_BYTES: usize = 1 << 16;

/// Decompresses LZF, the compression of PCD's `binary_compressed`, to exactly `len` bytes. Returns `false` if the input
/// is damaged.
///
/// The format: a control byte below 32 is followed by that many literal bytes plus one. Any other control byte has a
/// length in its upper three bits (7: another byte of length follows) and, in its lower five bits and the next byte,
/// the distance to copy from.
///
/// # Errors
///
/// The input cannot be read, or the output cannot be written.
pub(super) fn decompress(input: &mut impl Read, len: u64, out: impl Write) -> io::Result<bool> {
    let mut output = Output { tail: Vec::with_capacity(WINDOW_BYTES + OUT_BYTES + 512), done: 0, out };
    let mut literal = [0; 32];
    while let Some(control) = next(input)? {
        if control < 32 {
            let literal = &mut literal[..usize::from(control) + 1];
            match input.read_exact(literal) {
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(false),
                read => read?,
            }
            output.tail.extend_from_slice(literal);
        } else {
            let more = if control >> 5 == 7 { next(input)? } else { Some(0) };
            let (Some(more), Some(low)) = (more, next(input)?) else { return Ok(false) };
            let length = 2 + usize::from(control >> 5) + usize::from(more);
            let back = 1 + (usize::from(control & 31) << 8 | usize::from(low));
            let Some(start) = output.tail.len().checked_sub(back) else { return Ok(false) };
            // Byte by byte, because the copy may overlap its output.
            (start..start + length).for_each(|at| output.tail.push(output.tail[at]));
        }
        if output.len() > len {
            return Ok(false);
        }
        if output.tail.len() >= WINDOW_BYTES + OUT_BYTES {
            output.write(OUT_BYTES)?;
        }
    }
    let is_whole = output.len() == len;
    output.write(output.tail.len())?;
    Ok(is_whole)
}

/// Returns whether the compressed size is sufficient for the uncompressed size: LZF compresses at most 264 bytes into
/// 3. Rejects false sizes before they cause an allocation.
pub(super) fn is_possible(packed: u64, unpacked: u64) -> bool {
    unpacked / 128 <= packed
}

fn next(input: &mut impl Read) -> io::Result<Option<u8>> {
    let mut byte = [0];
    match input.read_exact(&mut byte) {
        Ok(()) => Ok(Some(byte[0])),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
        Err(error) => Err(error),
    }
}

/// Output with a tail that serves as the window for copies.
struct Output<W> {
    tail: Vec<u8>,
    done: u64,
    out: W,
}

impl<W: Write> Output<W> {
    fn len(&self) -> u64 {
        self.done + self.tail.len() as u64
    }

    fn write(&mut self, bytes: usize) -> io::Result<()> {
        self.out.write_all(&self.tail[..bytes])?;
        self.tail.drain(..bytes);
        self.done += bytes as u64;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(packed: &[u8], len: u64) -> Option<Vec<u8>> {
        let mut out = Vec::new();
        decompress(&mut &*packed, len, &mut out).unwrap().then_some(out)
    }

    #[test]
    fn literals_and_copies() {
        // "abc", then a copy of 9 bytes from 3 back, then of 10 bytes from 1 back.
        let packed = [2, b'a', b'b', b'c', 7 << 5, 0, 2, 7 << 5, 1, 0];
        assert_eq!(unpacked(&packed, 22).unwrap(), b"abcabcabcabccccccccccc");
        for wrong in [&packed[..9], &[2, b'a'], &[0x20, 0]] {
            assert_eq!(unpacked(wrong, 22), None);
        }
        assert_eq!(unpacked(&packed, 21), None);
        assert_eq!(unpacked(&[], u64::MAX), None);
        assert!(!is_possible(10, u64::MAX) && is_possible(10, 880));
    }

    #[test]
    fn copies_reach_across_the_window() {
        // The bytes 0 to 31, then repeated copies at the maximum distance.
        let mut packed: Vec<u8> = Vec::new();
        let mut expected: Vec<u8> = Vec::new();
        for k in 0..256 {
            packed.push(31);
            packed.extend((0..32).map(|byte| (byte * 7) ^ k as u8));
            expected.extend((0..32).map(|byte| (byte * 7) ^ k as u8));
        }
        for _ in 0..1000 {
            packed.extend([7 << 5 | 31, 255, 255]);
            let start = expected.len() - 8192;
            (start..start + 264).for_each(|at| expected.push(expected[at]));
        }
        assert_eq!(unpacked(&packed, expected.len() as u64).unwrap(), expected);
    }
}

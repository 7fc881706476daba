/// Unpacks LZF, the compression of PCD's `binary_compressed`, to exactly `len` bytes; `None` if the input does not
/// give that.
///
/// The format: a control byte below 32 is followed by that many bytes plus one to copy; any other holds a length in
/// its upper three bits (7: one more byte of length follows) and, in its lower five bits and the next byte, how far
/// back to copy from.
pub(super) fn unpack(mut input: &[u8], len: usize) -> Option<Vec<u8>> {
    // LZF packs at most 264 bytes into 3: a claim beyond that would only size an allocation.
    if len / 128 > input.len() {
        return None;
    }
    let mut output = Vec::with_capacity(len);
    while let Some((&control, rest)) = input.split_first() {
        input = rest;
        if control < 32 {
            let (literal, rest) = input.split_at_checked(usize::from(control) + 1)?;
            output.extend_from_slice(literal);
            input = rest;
        } else {
            let mut next = || {
                let (&byte, rest) = input.split_first()?;
                input = rest;
                Some(usize::from(byte))
            };
            let length = 2 + match control >> 5 {
                7 => 7 + next()?,
                short => usize::from(short),
            };
            let back = 1 + (usize::from(control & 31) << 8 | next()?);
            let start = output.len().checked_sub(back)?;
            if output.len() + length > len {
                return None;
            }
            // Byte by byte: the copy may reach into what it writes.
            (start..start + length).for_each(|at| output.push(output[at]));
        }
        if output.len() > len {
            return None;
        }
    }
    (output.len() == len).then_some(output)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_copies() {
        // "abc", then 9 bytes from 3 back, then 10 bytes from 1 back.
        let packed = [2, b'a', b'b', b'c', 7 << 5, 0, 2, 7 << 5, 1, 0];
        assert_eq!(unpack(&packed, 22).unwrap(), b"abcabcabcabccccccccccc");
        for wrong in [&packed[..9], &[2, b'a'], &[0x20, 0]] {
            assert_eq!(unpack(wrong, 22), None);
        }
        assert_eq!(unpack(&packed, 21), None);
        assert_eq!(unpack(&[], usize::MAX), None);
    }
}

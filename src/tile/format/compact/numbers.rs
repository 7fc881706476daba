/// Appends a number, seven bits per byte, the lowest first; all bytes but the last have their highest bit set.
pub(super) fn put_number(mut number: u64, out: &mut Vec<u8>) {
    while number >= 0x80 {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

/// Reads the output of [`put_number`] byte by byte. Returns `None` if the bytes end, the number exceeds 64 bits, or its
/// encoding is not the shortest.
pub(super) fn take_number(mut next: impl FnMut() -> Option<u8>) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let byte = next()?;
        let bits = u64::from(byte & 0x7f);
        number |= bits << shift;
        if number >> shift != bits || (byte == 0 && shift > 0) {
            return None;
        }
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn take(bytes: &[u8]) -> Option<u64> {
        let mut bytes = bytes.iter().copied();
        take_number(|| bytes.next()).filter(|_| bytes.next().is_none())
    }

    #[test]
    fn numbers_round_trip_and_have_one_encoding() {
        for number in (0..64).flat_map(|bit| [(1_u64 << bit) - 1, 1 << bit, u64::MAX - (1 << bit)]) {
            let mut bytes = Vec::new();
            put_number(number, &mut bytes);
            assert_eq!(take(&bytes), Some(number));
            assert_eq!(take(&bytes[..bytes.len() - 1]), None);
            *bytes.last_mut().unwrap() |= 0x80;
            assert_eq!(take(&[&bytes[..], &[0]].concat()), None);
        }
        assert_eq!(take(&[0xff; 10]), None);
        assert_eq!(take(&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x02]), None);
    }
}

use anyhow::{anyhow, bail};
use byteorder::{BigEndian, LittleEndian};
use serde::{Serialize, de::DeserializeOwned};

/// Encoding header of each message: little-endian CDR, and two bytes of options.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// Encodes a message.
///
/// # Errors
///
/// A string or sequence that is too long for CDR.
pub fn encode<M: Serialize>(message: &M) -> anyhow::Result<Vec<u8>> {
    let mut bytes = LITTLE_ENDIAN.to_vec();
    bytes.extend(cdr_encoding::to_vec::<M, LittleEndian>(message).map_err(|error| anyhow!("{error}"))?);
    Ok(bytes)
}

/// Decodes a message.
///
/// # Errors
///
/// A message that is malformed or has wrong lengths.
pub fn decode<M: DeserializeOwned>(bytes: &[u8]) -> anyhow::Result<M> {
    let decoded = match bytes {
        [0, 1, _, _, body @ ..] => cdr_encoding::from_bytes::<M, LittleEndian>(body),
        [0, 0, _, _, body @ ..] => cdr_encoding::from_bytes::<M, BigEndian>(body),
        _ => bail!("not CDR: unknown encoding in the first four of {} bytes", bytes.len()),
    };
    Ok(decoded.map_err(|error| anyhow!("{error}"))?.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_byte_orders_are_read_and_invalid_bytes_refused() {
        let bytes = encode(&("ab".to_owned(), 5_u32)).unwrap();
        assert_eq!(bytes, [0, 1, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0, 5, 0, 0, 0]);
        assert_eq!(decode::<(String, u32)>(&bytes).unwrap(), ("ab".to_owned(), 5));
        let big = [0, 0, 0, 0, 0, 0, 0, 3, b'a', b'b', 0, 0, 0, 0, 0, 5];
        assert_eq!(decode::<(String, u32)>(&big).unwrap(), ("ab".to_owned(), 5));
        for wrong in
            [&[][..], &[0, 1], &[0, 3, 0, 0, 1, 0, 0, 0], &[0, 1, 0, 0, 255, 255, 255, 255], &bytes[..13]]
        {
            assert!(decode::<(String, u32)>(wrong).is_err(), "{wrong:?}");
        }
        assert!(decode::<Vec<u64>>(&[0, 1, 0, 0, 255, 255, 255, 255]).is_err());
    }
}

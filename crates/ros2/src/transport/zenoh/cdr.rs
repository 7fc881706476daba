use anyhow::{anyhow, bail};
use byteorder::{BigEndian, LittleEndian};
use serde::{Serialize, de::DeserializeOwned};

/// In front of each message: its encoding, and two octets of options.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// A message as bytes.
///
/// # Errors
///
/// A text or a sequence that CDR has no length for.
pub fn encode<M: Serialize>(message: &M) -> anyhow::Result<Vec<u8>> {
    let mut bytes = LITTLE_ENDIAN.to_vec();
    bytes.extend(cdr_encoding::to_vec::<M, LittleEndian>(message).map_err(|error| anyhow!("{error}"))?);
    Ok(bytes)
}

/// A message of these bytes.
///
/// # Errors
///
/// Bytes that are none, or lie about lengths.
pub fn decode<M: DeserializeOwned>(bytes: &[u8]) -> anyhow::Result<M> {
    let decoded = match bytes {
        [0, 1, _, _, body @ ..] => cdr_encoding::from_bytes::<M, LittleEndian>(body),
        [0, 0, _, _, body @ ..] => cdr_encoding::from_bytes::<M, BigEndian>(body),
        _ => bail!("no CDR: the first four of {} bytes say another encoding", bytes.len()),
    };
    Ok(decoded.map_err(|error| anyhow!("{error}"))?.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_orders_of_bytes_are_read_and_lies_refused() {
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

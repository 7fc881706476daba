use super::bytes::put_number;
use super::packet::{VERSION, put_range, read_range, seal, unseal};
use crate::set_range::SetRange;
use voxtile::FormatError;

/// A request of a receiver to a sender.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Its status. Only an answer to this request repeats the nonce.
    Status {
        /// Any number but 0.
        nonce: u64,
    },
    /// The present voxels of lost packets.
    Missing {
        /// The sender's epoch.
        epoch: u32,
        /// Their numbers, ascending.
        sequences: Vec<u64>,
    },
    /// Digests of tiles.
    Digests {
        /// Of whose set.
        epoch: u32,
        /// Of whole tiles.
        range: SetRange,
    },
    /// The voxels of parts of the set.
    Content {
        /// Of whose set.
        epoch: u32,
        /// Which parts.
        ranges: Vec<SetRange>,
    },
}

const STATUS: u8 = 17;
const MISSING: u8 = 18;
const DIGESTS: u8 = 19;
const CONTENT: u8 = 20;

/// Most packets or ranges in one request.
pub const MAX_LISTED: usize = 64;

impl Request {
    /// The bytes of the request, at most 1200.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = vec![VERSION];
        match self {
            Self::Status { nonce } => {
                bytes.push(STATUS);
                bytes.extend(nonce.to_le_bytes());
            }
            Self::Missing { epoch, sequences } => {
                bytes.push(MISSING);
                bytes.extend(epoch.to_le_bytes());
                let mut before = 0;
                for &sequence in sequences {
                    put_number(&mut bytes, sequence.saturating_sub(before));
                    before = sequence;
                }
            }
            Self::Digests { epoch, range } => {
                bytes.push(DIGESTS);
                bytes.extend(epoch.to_le_bytes());
                put_range(&mut bytes, *range);
            }
            Self::Content { epoch, ranges } => {
                bytes.push(CONTENT);
                bytes.extend(epoch.to_le_bytes());
                ranges.iter().for_each(|range| put_range(&mut bytes, *range));
            }
        }
        seal(&mut bytes);
        bytes
    }

    /// Decodes a request.
    ///
    /// # Errors
    ///
    /// Another version, damage, and what no receiver writes.
    pub fn decode(bytes: &[u8]) -> Result<Self, FormatError> {
        let mut reader = unseal(bytes)?;
        let kind = reader.byte()?;
        if kind == STATUS {
            let nonce = u64::from_le_bytes(reader.array()?);
            reader.end()?;
            return Ok(Self::Status { nonce });
        }
        let epoch = u32::from_le_bytes(reader.array()?);
        let request = match kind {
            MISSING => {
                let (mut before, mut sequences) = (0_u64, Vec::new());
                while !reader.rest().is_empty() && sequences.len() < MAX_LISTED {
                    before = before.saturating_add(reader.number()?);
                    sequences.push(before);
                }
                Self::Missing { epoch, sequences }
            }
            DIGESTS => Self::Digests { epoch, range: read_range(&mut reader)? },
            CONTENT => {
                let mut ranges = Vec::new();
                while !reader.rest().is_empty() && ranges.len() < MAX_LISTED {
                    ranges.push(read_range(&mut reader)?);
                }
                Self::Content { epoch, ranges }
            }
            other => return Err(reader.error(format!("there are no asks of kind {other}"))),
        };
        reader.end()?;
        Ok(request)
    }
}

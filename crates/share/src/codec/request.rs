use super::bytes::put_number;
use super::packet::{VERSION, put_range, read_range, seal, unseal};
use crate::set_range::SetRange;
use voxtile::FormatError;

/// A request from a receiver to a sender.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Request for the sender's status. Only the answer to this request repeats the nonce.
    Status {
        /// Any number but 0.
        nonce: u64,
    },
    /// Request for the current state of the voxels of lost packets.
    Missing {
        /// The sender's epoch.
        epoch: u32,
        /// Numbers of the lost packets, ascending.
        sequences: Vec<u64>,
    },
    /// Request for digests of tiles.
    Digests {
        /// The sender's epoch.
        epoch: u32,
        /// Range of whole tiles.
        range: SetRange,
    },
    /// Request for the voxels of ranges of the set.
    Content {
        /// The sender's epoch.
        epoch: u32,
        /// Ranges of the set.
        ranges: Vec<SetRange>,
    },
}

const STATUS: u8 = 17;
const MISSING: u8 = 18;
const DIGESTS: u8 = 19;
const CONTENT: u8 = 20;

/// Maximum number of packets or ranges in one request.
pub const MAX_LISTED: usize = 64;

impl Request {
    /// Encodes the request, in at most 1200 bytes.
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
    /// Another version, or bytes that are damaged or not a valid request.
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
            other => return Err(reader.error(format!("unknown request kind {other}"))),
        };
        reader.end()?;
        Ok(request)
    }
}

use std::time::{SystemTime, UNIX_EPOCH};

/// Attachment of each message, request and response: sender and sequence number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Sequence number of the sender, starting at 1.
    pub number: i64,
    pub sent_at_ns: i64,
    /// GID of the sender.
    pub gid: [u8; GID_BYTES],
}

pub const GID_BYTES: usize = 16;
/// Size of an encoded attachment.
pub const BYTES: usize = 8 + 8 + 1 + GID_BYTES;

impl Attachment {
    pub fn now(number: i64, gid: [u8; GID_BYTES]) -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { number, sent_at_ns: i64::try_from(since.as_nanos()).unwrap_or(i64::MAX), gid }
    }

    pub fn to_bytes(self) -> [u8; BYTES] {
        let mut bytes = [0; BYTES];
        bytes[..8].copy_from_slice(&self.number.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.sent_at_ns.to_le_bytes());
        bytes[16] = GID_BYTES as u8;
        bytes[17..].copy_from_slice(&self.gid);
        bytes
    }

    /// Returns `None` for bytes that are not an attachment.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; BYTES] = bytes.try_into().ok()?;
        let number = i64::from_le_bytes(bytes[..8].try_into().ok()?);
        let sent_at_ns = i64::from_le_bytes(bytes[8..16].try_into().ok()?);
        let gid = bytes[17..].try_into().ok()?;
        (usize::from(bytes[16]) == GID_BYTES).then_some(Self { number, sent_at_ns, gid })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_attachments_are_refused() {
        let attachment = Attachment { number: 7, sent_at_ns: -2, gid: [9; GID_BYTES] };
        let bytes = attachment.to_bytes();
        assert_eq!(Attachment::from_bytes(&bytes), Some(attachment));
        let mut longer = bytes.to_vec();
        longer.push(0);
        let mut invalid = bytes;
        invalid[16] = 255;
        for wrong in [&[][..], &bytes[..32], &longer, &invalid] {
            assert_eq!(Attachment::from_bytes(wrong), None);
        }
    }
}

use std::time::{SystemTime, UNIX_EPOCH};

/// What goes with each sample, request and response: whose it is, and its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Of its sender, from 1 on.
    pub number: i64,
    pub sent_at_ns: i64,
    /// Of its sender.
    pub gid: [u8; GID_BYTES],
}

pub const GID_BYTES: usize = 16;
/// Of every attachment.
pub const BYTES: usize = 8 + 8 + 1 + GID_BYTES;

impl Attachment {
    /// One of this moment.
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

    /// None if these are not its bytes.
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
    fn other_bytes_are_no_attachment() {
        let attachment = Attachment { number: 7, sent_at_ns: -2, gid: [9; GID_BYTES] };
        let bytes = attachment.to_bytes();
        assert_eq!(Attachment::from_bytes(&bytes), Some(attachment));
        let mut longer = bytes.to_vec();
        longer.push(0);
        let mut lying = bytes;
        lying[16] = 255;
        for wrong in [&[][..], &bytes[..32], &longer, &lying] {
            assert_eq!(Attachment::from_bytes(wrong), None);
        }
    }
}

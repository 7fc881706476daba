use std::fmt;

#[derive(Clone, Debug)]
pub struct Message {
    /// CDR bytes with the four-byte encoding header.
    pub cdr: Vec<u8>,
    /// Publisher of the message, if the transport provides it.
    pub publisher: Option<Gid>,
}

/// Identifier of a publisher, as printed by `ros2 topic info --verbose`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Gid(pub [u8; 16]);

impl fmt::Display for Gid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes: Vec<String> = self.0.iter().map(|byte| format!("{byte:02x}")).collect();
        f.write_str(&bytes.join("."))
    }
}

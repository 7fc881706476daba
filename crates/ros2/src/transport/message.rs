use std::fmt;

/// What a topic brought.
#[derive(Clone, Debug)]
pub struct Message {
    /// Its bytes, with the four bytes in front that say their encoding.
    pub cdr: Vec<u8>,
    /// Who sent it, where the transport knows that.
    pub publisher: Option<Gid>,
}

/// The number of a publisher, as `ros2 topic info --verbose` prints it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Gid(pub [u8; 16]);

impl fmt::Display for Gid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes: Vec<String> = self.0.iter().map(|byte| format!("{byte:02x}")).collect();
        f.write_str(&bytes.join("."))
    }
}

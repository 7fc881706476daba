use indicatif::HumanCount;
use std::fmt;

/// A count and its noun, such as "1 tile" or "1,200 tiles".
pub struct Counted(pub u64, pub &'static str);

impl fmt::Display for Counted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(count, noun) = *self;
        write!(f, "{} {noun}{}", HumanCount(count), if count == 1 { "" } else { "s" })
    }
}

use std::fmt;
use std::str::FromStr;

/// Name of a robot: 1 to 32 of `[A-Za-z0-9_-]`, valid in a key and in a file name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RobotName(String);

impl FromStr for RobotName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-');
        if is_plain && (1..=32).contains(&text.len()) {
            Ok(Self(text.to_string()))
        } else {
            Err("a robot's name is 1 to 32 of A-Z a-z 0-9 _ -".to_string())
        }
    }
}

impl fmt::Display for RobotName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain_and_short() {
        for good in ["a", "Spot-2_b", &"x".repeat(32)] {
            assert!(good.parse::<RobotName>().is_ok());
        }
        for bad in ["", "a/b", "..", "a b", "*", "ä", &"x".repeat(33)] {
            assert!(bad.parse::<RobotName>().is_err(), "{bad}");
        }
    }
}

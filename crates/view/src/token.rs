use voxtile::{Error, Result};

/// Secret first component of every path; grants access.
pub struct Token(String);

impl Token {
    pub fn new(token: &str) -> Result<Self> {
        let is_letter = |letter: u8| letter.is_ascii_alphanumeric() || b"_-".contains(&letter);
        if (8..=128).contains(&token.len()) && token.bytes().all(is_letter) {
            return Ok(Self(token.to_owned()));
        }
        Err(Error::argument("token", "must be 8 to 128 characters of A-Z a-z 0-9 _ -"))
    }

    /// Returns 128 random bits as text.
    pub fn random() -> Result<Self> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(|error| {
            Error::argument("token", format!("cannot create a random token ({error}); pass one"))
        })?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Compares in constant time, so that response times reveal nothing about the token.
    pub fn is(&self, text: &str) -> bool {
        blake3::hash(text.as_bytes()) == blake3::hash(self.0.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_long_and_plain() {
        for token in ["", "short", "eight/88", "eight.88", "with space", &"x".repeat(129)] {
            assert!(Token::new(token).is_err(), "{token}");
        }
        let token = Token::new("eight_88").unwrap();
        assert!(token.is("eight_88") && !token.is("eight_8") && !token.is(""));
        let (one, other) = (Token::random().unwrap(), Token::random().unwrap());
        assert!(one.as_str().len() == 32 && !one.is(other.as_str()));
    }
}

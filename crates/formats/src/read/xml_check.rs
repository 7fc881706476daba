/// Incremental check of an XML text. It counts constructs that take much memory or time in the XML parser, which
/// compares each attribute of a tag with the previous ones and keeps the namespaces of a tag for all tags within it.
#[derive(Debug, Default)]
pub(super) struct XmlCheck {
    state: State,
    /// Bytes since the last `<`, up to those that identify the construct.
    start: Vec<u8>,
    /// Last two bytes within the current construct, without its opening bytes.
    last: [u8; 2],
    /// Number of attributes of the current tag.
    attributes: usize,
    name_spaces: usize,
    /// Number of tags and attributes.
    pub(super) nodes: u64,
}

/// Lexical state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Text,
    Tag,
    /// An attribute value, up to this quote.
    Value(u8),
    Comment,
    Data,
    Instruction,
}

/// Limit well above the attributes used by E57.
const MAX_ATTRIBUTES: usize = 256;
/// Limit for namespaces. A file declares one for each of its extensions.
const MAX_NAME_SPACES: usize = 1000;
const COMMENT: &[u8] = b"!--";
const DATA: &[u8] = b"![CDATA[";

impl XmlCheck {
    /// Checks the next bytes.
    ///
    /// # Errors
    ///
    /// A limit is exceeded.
    pub(super) fn take(&mut self, bytes: &[u8]) -> Result<(), String> {
        bytes.iter().try_for_each(|&byte| {
            let before = self.state;
            let taken = self.step(byte);
            self.last = if self.state == before { [self.last[1], byte] } else { [0; 2] };
            taken
        })
    }

    fn step(&mut self, byte: u8) -> Result<(), String> {
        let [before, last] = self.last;
        match (self.state, byte) {
            (State::Text, b'<') => {
                self.state = State::Tag;
                self.start.clear();
                self.attributes = 0;
                self.nodes += 1;
            }
            (State::Tag, b'>') => self.state = State::Text,
            (State::Tag, b'"' | b'\'') => self.state = State::Value(byte),
            (State::Tag, b'=') => {
                self.nodes += 1;
                self.attributes += 1;
                return at_most(self.attributes, MAX_ATTRIBUTES, "attributes in one tag");
            }
            (State::Tag, _) => return self.name(byte),
            (State::Value(quote), _) if byte == quote => self.state = State::Tag,
            (State::Comment, b'>') if (before, last) == (b'-', b'-') => self.state = State::Text,
            (State::Data, b'>') if (before, last) == (b']', b']') => self.state = State::Text,
            (State::Instruction, b'>') if last == b'?' => self.state = State::Text,
            _ => {}
        }
        Ok(())
    }

    /// Processes a byte of a tag outside of attribute values.
    fn name(&mut self, byte: u8) -> Result<(), String> {
        if self.start.len() < DATA.len() {
            self.start.push(byte);
            self.state = match self.start.as_slice() {
                COMMENT => State::Comment,
                DATA => State::Data,
                b"?" => State::Instruction,
                _ => State::Tag,
            };
        }
        // `xmlns`, or `xmlns:` before a name.
        if byte == b'n' && self.last == *b"ml" {
            self.name_spaces += 1;
        }
        at_most(self.name_spaces, MAX_NAME_SPACES, "namespace declarations")
    }
}

fn at_most(count: usize, most: usize, what: &str) -> Result<(), String> {
    match count <= most {
        true => Ok(()),
        false => Err(format!("its XML section has more than {most} {what}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) -> Result<u64, String> {
        let mut check = XmlCheck::default();
        text.as_bytes().chunks(7).try_for_each(|bytes| check.take(bytes))?;
        Ok(check.nodes)
    }

    #[test]
    fn only_tags_and_attributes_are_counted() {
        assert_eq!(check("<?xml version=\"1.0\"?><a b='<c d=\"1\">' e=\"2\"><f/></a>"), Ok(6));
        assert_eq!(check("<a>x = y, \"<!-- <b c='1'> -- --><![CDATA[<d e=\"1\">]] >]]></a>"), Ok(4));
    }

    #[test]
    fn exceeded_limits_are_errors() {
        let many = |count: usize| (0..count).map(|k| format!(" a{k}='='")).collect::<String>();
        assert!(check(&format!("<a{}/>", many(256)).repeat(3)).is_ok());
        assert!(check(&format!("<a{}/>", many(257))).unwrap_err().contains("256 attributes in one tag"));
        // The opening bytes of a comment do not also close it.
        for start in ["<!-->", "<!--->", "<![CDATA[]>", "<?>"] {
            let end =
                ["-->", "]]>", "?>"][usize::from(start.contains('[')) + 2 * usize::from(start.contains('?'))];
            let text = format!("<b>{start} <x \" {end}<a{}/></b>", many(257));
            assert!(check(&text).is_err(), "{start}");
        }
        let spaces = |count: usize| (0..count).map(|k| format!("<a xmlns:b{k}='c'/>")).collect::<String>();
        assert!(check(&spaces(1000)).is_ok());
        assert!(check(&spaces(1001)).unwrap_err().contains("1000 namespace declarations"));
    }
}

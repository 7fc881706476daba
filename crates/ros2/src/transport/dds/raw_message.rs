use rustdds::RepresentationIdentifier;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter};
use std::convert::Infallible;

/// Message as CDR bytes with the four-byte encoding header, as in recordings. The same decoder reads both.
#[derive(Clone, Debug)]
pub struct RawMessage {
    pub cdr: Vec<u8>,
}

/// Adapter that copies the bytes. Lengths in them are validated by the decoder.
#[derive(Clone, Copy, Debug)]
pub struct RawAdapter;

const ENCODINGS: [RepresentationIdentifier; 2] =
    [RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE];

impl DeserializerAdapter<RawMessage> for RawAdapter {
    type Error = Infallible;
    type Decoded = RawMessage;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &ENCODINGS
    }

    fn transform_decoded(decoded: RawMessage) -> RawMessage {
        decoded
    }
}

impl DefaultDecoder<RawMessage> for RawAdapter {
    type Decoder = Self;
    const DECODER: Self = Self;
}

impl Decode<'_, RawMessage> for RawAdapter {
    type Error = Infallible;

    fn decode_bytes(
        self,
        bytes: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<RawMessage, Infallible> {
        let is_little_endian = encoding == RepresentationIdentifier::CDR_LE;
        let mut cdr = Vec::with_capacity(bytes.len() + 4);
        cdr.extend_from_slice(&[0, u8::from(is_little_endian), 0, 0]);
        cdr.extend_from_slice(bytes);
        Ok(RawMessage { cdr })
    }
}

//! PNG depth images: 16-bit grey.

use std::io::{BufRead, Seek};

/// Memory limit of the decoder, which holds a few rows. Images may be a million pixels wide.
pub(super) const MAX_DECODER_BYTES: usize = 8 << 20;

/// Byte offset of an error and its reason.
type Wrong = (u64, String);
/// Offset of the pixel format in the header.
const KIND_AT: u64 = 16;

pub(crate) fn open<R: BufRead + Seek>(input: R) -> Result<png::Reader<R>, Wrong> {
    let limits = png::Limits { bytes: MAX_DECODER_BYTES };
    let mut decoder = png::Decoder::new_with_limits(input, limits);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    decoder.set_transformations(png::Transformations::IDENTITY);
    let reader = decoder.read_info().map_err(|error| (0, error.to_string()))?;
    let info = reader.info();
    if (info.bit_depth, info.color_type) != (png::BitDepth::Sixteen, png::ColorType::Grayscale) {
        let (color, bits) = (info.color_type, info.bit_depth);
        let reason = format!(
            "is not a depth image: depth images are 16-bit grey, this one is {color:?} with {bits:?}"
        );
        return Err((KIND_AT, reason));
    }
    if info.interlaced {
        return Err((KIND_AT, "is interlaced: save it without interlacing".into()));
    }
    Ok(reader)
}

/// Returns the numbers of columns and rows.
pub(crate) fn size<R: BufRead + Seek>(reader: &png::Reader<R>) -> (u32, u32) {
    (reader.info().width, reader.info().height)
}

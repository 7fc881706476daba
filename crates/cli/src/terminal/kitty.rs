use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::io::{self, Write};
use voxtile_render::Image;

/// Most bytes of text in one escape sequence.
const CHUNK: usize = 4096;

/// Kitty's graphics protocol: a PNG as base64, in pieces; `q=2` asks for no answer.
pub fn write(image: &Image, out: &mut impl Write) -> io::Result<()> {
    let mut png = Vec::new();
    image.write_png(&mut png)?;
    let text = STANDARD.encode(png);
    let mut pieces = text.as_bytes().chunks(CHUNK).enumerate().peekable();
    while let Some((number, piece)) = pieces.next() {
        let more = u8::from(pieces.peek().is_some());
        let keys = if number == 0 { "a=T,f=100,q=2," } else { "" };
        write!(out, "\x1b_G{keys}m={more};")?;
        out.write_all(piece)?;
        out.write_all(b"\x1b\\")?;
    }
    writeln!(out)
}

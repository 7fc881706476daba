use super::Text;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::io::{self, Write};
use voxtile_render::{Drawn, colors};

/// Writes a picture with its caption, in the width of the page.
pub fn write_picture(out: &mut impl Write, drawn: &Drawn, caption: &str) -> io::Result<()> {
    write_figure(out, drawn, caption, caption)
}

/// Writes a picture with a caption, and a description for those who do not see it.
pub fn write_figure(out: &mut impl Write, drawn: &Drawn, caption: &str, description: &str) -> io::Result<()> {
    let mut png = Vec::new();
    drawn.image.write_png(&mut png)?;
    let (width, height) = (drawn.image.width_px(), drawn.image.height_px());
    let data = STANDARD.encode(png);
    let (caption, description) = (Text(caption), Text(description));
    writeln!(
        out,
        "<figure><img width=\"{width}\" height=\"{height}\" alt=\"{description}\" \
         src=\"data:image/png;base64,{data}\"/><figcaption>{caption}</figcaption></figure>"
    )
}

/// Returns a square of a color.
pub fn swatch([red, green, blue]: colors::Rgb) -> String {
    format!("<span class=\"swatch\" style=\"background:rgb({red},{green},{blue})\"></span>")
}

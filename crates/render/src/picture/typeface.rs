use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont, point};
use std::sync::LazyLock;

/// Inter Medium with Latin, Greek and Cyrillic letters. Characters that it lacks are drawn as a box.
static FONT: LazyLock<Option<FontRef>> =
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("../../assets/Inter-Medium.otf")).ok());

/// Height of capitals as a share of the size.
pub const CAPITALS: f64 = 0.727;

/// Returns the width of a text in pixels, for a size in pixels.
pub fn width_of(text: &str, size_px: f64) -> f64 {
    let mut end = 0.0;
    for_each_glyph(text, size_px, |_, _, advance| end += f64::from(advance));
    end
}

/// Calls `draw` with the position of each covered pixel relative to the start of the base line, right and down, and its
/// coverage from 0 to 1.
pub fn rasterize(text: &str, size_px: f64, mut draw: impl FnMut([i32; 2], f64)) {
    let Some(font) = FONT.as_ref() else { return };
    let (scale, mut left) = (scale_of(font, size_px), 0.0);
    for_each_glyph(text, size_px, |id, _, advance| {
        let glyph = id.with_scale_and_position(scale, point(left, 0.0));
        if let Some(outline) = font.outline_glyph(glyph) {
            let bounds = outline.px_bounds();
            let corner = [bounds.min.x, bounds.min.y].map(|k| k as i32);
            outline.draw(|x, y, cover| {
                draw(
                    [corner[0].saturating_add_unsigned(x), corner[1].saturating_add_unsigned(y)],
                    f64::from(cover),
                );
            });
        }
        left += advance;
    });
}

/// Calls `visit` with each glyph, its start and its advance, in pixels.
fn for_each_glyph(text: &str, size_px: f64, mut visit: impl FnMut(GlyphId, f32, f32)) {
    let Some(font) = FONT.as_ref() else { return };
    let (scaled, mut left) = (font.as_scaled(scale_of(font, size_px)), 0.0);
    for letter in text.chars().filter(|letter| !letter.is_control()) {
        let id = font.glyph_id(letter);
        let advance = scaled.h_advance(id);
        visit(id, left, advance);
        left += advance;
    }
}

/// `ab_glyph` scales by the height of lines, sizes count by em.
fn scale_of(font: &FontRef, size_px: f64) -> PxScale {
    let per_em = font.units_per_em().unwrap_or(1000.0);
    PxScale::from((size_px * f64::from(font.height_unscaled() / per_em)) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the bounds of the covered pixels: left, top, right, bottom.
    fn bounds(text: &str, size_px: f64) -> Option<[i32; 4]> {
        let mut bounds: Option<[i32; 4]> = None;
        rasterize(text, size_px, |[x, y], cover| {
            if cover > 0.5 {
                let [left, top, right, bottom] = bounds.unwrap_or([x, y, x, y]);
                bounds = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
            }
        });
        bounds
    }

    #[test]
    fn text_has_the_size_of_its_metrics() {
        for size_px in [12.0, 37.5, 400.0] {
            let [left, top, right, bottom] = bounds("HH", size_px).unwrap();
            let high = f64::from(bottom - top + 1);
            assert!((high - CAPITALS * size_px).abs() <= 1.5, "{high} at {size_px}");
            let (wide, advance) = (f64::from(right - left + 1), width_of("HH", size_px));
            assert!(wide < advance && wide > 0.8 * advance, "{wide} of {advance}");
            assert!((advance - 2.0 * width_of("H", size_px)).abs() < 1e-3);
        }
        assert!(width_of("iii", 20.0) < width_of("mmm", 20.0));
        assert_eq!(width_of("", 20.0), 0.0);
    }

    #[test]
    fn letters_of_other_languages_are_drawn_and_the_rest_is_a_box() {
        let drawn = |text: &str| {
            let mut pixels = Vec::new();
            rasterize(text, 30.0, |at, cover| pixels.push((at, (cover * 255.0) as u8)));
            pixels
        };
        let missing = drawn("\u{6f22}");
        assert!(!missing.is_empty());
        for text in ["é", "ß", "ł", "Ω", "µ", "ж", "²", "°", "…", "−"] {
            assert!(!drawn(text).is_empty() && drawn(text) != missing, "{text}");
        }
        assert_ne!(drawn("é"), drawn("e"));
        for text in ["\u{1f600}", "\u{5d0}", "\u{fffd}", "\u{10ffff}"] {
            assert_eq!(drawn(text), missing, "{text:?}");
        }
        assert_eq!(drawn("a\n\u{0}\u{7f}b"), drawn("ab"));
    }
}

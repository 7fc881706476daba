use crate::html::Text;
use indicatif::HumanCount;
use std::fmt::{self, Write};

/// Bar of a histogram.
pub struct Bar {
    pub from: String,
    pub to: String,
    pub count: u64,
    /// Red, green and blue.
    pub color: [u8; 3],
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 180.0;
/// Height below the bars, for their labels.
const FOOT: f64 = 24.0;
/// Height above the highest bar, for its count.
const HEAD: f64 = 20.0;
/// Approximate number of labels under the bars.
const LABELS: usize = 8;

/// Returns a histogram as inline SVG. Each bar has a tooltip with its numbers.
pub fn histogram(bars: &[Bar], what: &str) -> Result<String, fmt::Error> {
    let mut svg = String::new();
    let most = bars.iter().map(|bar| bar.count).max().unwrap_or_default().max(1);
    let pitch = WIDTH / bars.len().max(1) as f64;
    let ground = HEAD + HEIGHT;
    let all = HEAD + HEIGHT + FOOT;
    write!(svg, r#"<svg viewBox="0 0 {WIDTH} {all}" role="img" aria-label="{}">"#, Text(what))?;
    let every = bars.len().div_ceil(LABELS).max(1);
    for (number, bar) in bars.iter().enumerate() {
        let left = pitch * number as f64;
        let height = HEIGHT * bar.count as f64 / most as f64;
        let [red, green, blue] = bar.color;
        write!(
            svg,
            r#"<rect x="{:.2}" y="{:.2}" width="{:.2}" height="{height:.2}" fill="rgb({red},{green},{blue})">"#,
            left + 0.05 * pitch,
            ground - height,
            0.9 * pitch
        )?;
        write!(
            svg,
            "<title>{} to {}: {}</title></rect>",
            Text(&bar.from),
            Text(&bar.to),
            HumanCount(bar.count)
        )?;
        if number % every == 0 {
            write!(svg, r#"<text x="{left:.2}" y="{:.0}">{}</text>"#, ground + 17.0, Text(&bar.from))?;
        }
    }
    if let Some(last) = bars.last() {
        let to = Text(&last.to);
        write!(svg, r#"<text x="{WIDTH}" y="{:.0}" text-anchor="end">{to}</text>"#, ground + 17.0)?;
    }
    write!(svg, r#"<text x="0" y="13">{} in the highest bar</text>"#, HumanCount(most))?;
    write!(svg, r#"<line x1="0" y1="{ground}" x2="{WIDTH}" y2="{ground}"/></svg>"#)?;
    Ok(svg)
}

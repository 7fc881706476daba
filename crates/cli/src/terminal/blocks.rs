use std::fmt::Write as _;
use std::io::{self, Write};
use voxtile_render::Image;

/// Colors that a terminal has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 24 bits.
    Full,
    /// The cube of 6 x 6 x 6 and 24 greys.
    Indexed,
}

impl Depth {
    /// What the environment tells.
    pub fn of(variable: &dyn Fn(&str) -> Option<String>) -> Self {
        match variable("COLORTERM").as_deref() {
            Some("truecolor" | "24bit") => Self::Full,
            _ => Self::Indexed,
        }
    }

    fn code(self, [red, green, blue]: [u8; 3]) -> String {
        match self {
            Self::Full => format!("2;{red};{green};{blue}"),
            Self::Indexed => format!("5;{}", nearest([red, green, blue])),
        }
    }
}

/// Two pixels a character: the upper half block in the color of the upper, on the color of the lower.
pub fn write(image: &Image, depth: Depth, out: &mut impl Write) -> io::Result<()> {
    for top in (0..image.height_px()).step_by(2) {
        let mut line = String::new();
        let mut last = None;
        for x in 0..image.width_px() {
            let upper = image.pixel(x, top).unwrap_or_default();
            let lower = image.pixel(x, top + 1);
            // A sequence only where a color changes: a tenth of the bytes.
            if last != Some((upper, lower)) {
                let under = lower.map_or("49".to_owned(), |lower| format!("48;{}", depth.code(lower)));
                // A string takes all that is written to it.
                let _ = write!(line, "\x1b[38;{};{under}m", depth.code(upper));
                last = Some((upper, lower));
            }
            line.push('▀');
        }
        writeln!(out, "{line}\x1b[0m")?;
    }
    Ok(())
}

/// The levels of the cube.
const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];

/// The number of the nearest of the 256 colors that all terminals share.
fn nearest(color: [u8; 3]) -> u8 {
    let distance =
        |other: [u8; 3]| -> u32 { (0..3).map(|k| u32::from(color[k].abs_diff(other[k])).pow(2)).sum() };
    let level = |value: u8| (0..6).min_by_key(|&k| LEVELS[k].abs_diff(value)).unwrap_or_default();
    let cube = color.map(level);
    let in_cube = distance(cube.map(|k| LEVELS[k]));
    let grey = |step: u8| [8 + 10 * step; 3];
    let step = (0..24).min_by_key(|&step| distance(grey(step))).unwrap_or_default();
    if distance(grey(step)) < in_cube {
        232 + step
    } else {
        16 + 36 * cube[0] as u8 + 6 * cube[1] as u8 + cube[2] as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_color_is_itself_where_the_terminal_has_it() {
        assert_eq!(nearest([0; 3]), 16);
        assert_eq!(nearest([255; 3]), 231);
        assert_eq!(nearest([95, 135, 175]), 16 + 36 + 12 + 3);
        assert_eq!(nearest([38; 3]), 235);
    }
}

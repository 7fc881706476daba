//! Pictures in a terminal. What it can do is told by its environment alone: asking it would need an answer, which not
//! every terminal gives.

mod blocks;
mod kitty;
mod sixel;

use crate::args::TerminalArgs;
use blocks::Depth;
use std::io::Write;
use voxtile_render::Image;

/// How a picture gets into a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    Kitty,
    Sixel,
    Blocks(Depth),
}

/// How large a picture may be.
pub struct Room {
    pub map_px: [usize; 2],
    /// Whether there are pixels enough for a legend.
    pub has_legend: bool,
}

/// Columns and rows where the terminal does not tell.
const USUAL_CHARACTERS: [usize; 2] = [80, 24];
/// Pixels of a character where the terminal does not tell.
const CHARACTER_PX: [usize; 2] = [9, 18];
/// A map narrower than this is drawn without a legend.
const MIN_LEGEND_PX: usize = 700;

impl Protocol {
    /// What the command line forces.
    pub fn asked_for(args: &TerminalArgs) -> Option<Self> {
        match args {
            TerminalArgs { kitty: true, .. } => Some(Self::Kitty),
            TerminalArgs { sixel: true, .. } => Some(Self::Sixel),
            TerminalArgs { blocks: true, .. } => Some(Self::blocks_of_environment()),
            _ => None,
        }
    }

    /// What the environment tells.
    pub fn of_environment() -> Self {
        Self::of(|name| std::env::var(name).ok())
    }

    /// Blocks in as many colors as the environment tells.
    pub fn blocks_of_environment() -> Self {
        Self::Blocks(Depth::of(&|name| std::env::var(name).ok()))
    }

    fn of(variable: impl Fn(&str) -> Option<String>) -> Self {
        let [term, program] = ["TERM", "TERM_PROGRAM"].map(|name| variable(name).unwrap_or_default());
        let is_term = |names: &[&str]| names.iter().any(|name| term.contains(name));
        // A multiplexer hands neither protocol on by itself.
        if variable("TMUX").is_some() || is_term(&["screen", "tmux"]) {
            return Self::Blocks(Depth::of(&variable));
        }
        if variable("KITTY_WINDOW_ID").is_some() || is_term(&["kitty", "ghostty"]) || program == "ghostty" {
            return Self::Kitty;
        }
        if is_term(&["foot", "mlterm", "contour", "sixel"])
            || ["WezTerm", "iTerm.app", "mintty"].contains(&program.as_str())
        {
            return Self::Sixel;
        }
        Self::Blocks(Depth::of(&variable))
    }

    /// What the terminal has room for, with a few lines left for the prompt.
    pub fn room(self) -> Room {
        let size = rustix::termios::tcgetwinsize(std::io::stdout()).ok();
        let [columns, rows] = size
            .map(|size| [usize::from(size.ws_col), usize::from(size.ws_row)])
            .filter(|characters| characters.iter().all(|&count| count > 0))
            .unwrap_or(USUAL_CHARACTERS);
        let lines = rows.saturating_sub(4).max(4);
        if let Self::Blocks(_) = self {
            return Room { map_px: [columns, 2 * lines], has_legend: false };
        }
        let pixels = size
            .map(|size| [usize::from(size.ws_xpixel), usize::from(size.ws_ypixel)])
            .filter(|pixels| pixels.iter().all(|&count| count > 0))
            .unwrap_or([columns * CHARACTER_PX[0], rows * CHARACTER_PX[1]]);
        let high = pixels[1] * lines / rows.max(1);
        let has_legend = pixels[0] >= MIN_LEGEND_PX + 100 && high >= 400;
        // Title, legend and margins take so much.
        let [across, up] = if has_legend { [40, 120] } else { [0; 2] };
        Room { map_px: [pixels[0] - across, high - up], has_legend }
    }
}

/// Writes a picture, and ends the line below it.
pub fn write(image: &Image, protocol: Protocol, out: &mut impl Write) -> anyhow::Result<()> {
    match protocol {
        Protocol::Kitty => kitty::write(image, out)?,
        Protocol::Sixel => sixel::write(image, out)?,
        Protocol::Blocks(depth) => blocks::write(image, depth, out)?,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told_by(variables: &[(&str, &str)]) -> Protocol {
        Protocol::of(|wanted| {
            let found = variables.iter().find(|(name, _)| *name == wanted);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn the_environment_tells_what_a_terminal_can_do() {
        let (indexed, full) = (Protocol::Blocks(Depth::Indexed), Protocol::Blocks(Depth::Full));
        for (variables, protocol) in [
            (&[][..], indexed),
            (&[("TERM", "xterm-256color")], indexed),
            (&[("TERM", "xterm-256color"), ("COLORTERM", "truecolor")], full),
            (&[("TERM", "xterm-kitty")], Protocol::Kitty),
            (&[("TERM", "xterm-256color"), ("KITTY_WINDOW_ID", "1")], Protocol::Kitty),
            (&[("TERM", "foot")], Protocol::Sixel),
            (&[("TERM_PROGRAM", "WezTerm")], Protocol::Sixel),
            (&[("TERM", "tmux-256color"), ("KITTY_WINDOW_ID", "1"), ("COLORTERM", "24bit")], full),
        ] {
            assert_eq!(told_by(variables), protocol, "{variables:?}");
        }
    }
}

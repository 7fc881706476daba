use super::palette::{self, Rgb};

/// Background of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Background {
    /// Nearly black, for screens.
    #[default]
    Dark,
    /// Black, for screens.
    Black,
    /// White, for print.
    White,
    /// Transparent, with the dark type of a white background.
    Transparent,
}

/// Colors that depend on the background.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Theme {
    /// Unknown space and margins.
    pub ground: Rgb,
    /// Whether pixels that nothing covers are transparent.
    pub is_transparent: bool,
    /// Free space.
    pub free: Rgb,
    /// Letters, bars and rims.
    pub ink: Rgb,
    /// Secondary text.
    pub faint_ink: Rgb,
    /// Grid lines, blended over the map.
    pub line: Rgb,
    /// Trajectory.
    pub path: Rgb,
}

impl Theme {
    pub fn of(background: Background) -> Self {
        let dark = Self {
            ground: palette::UNKNOWN,
            is_transparent: false,
            free: palette::FREE,
            ink: palette::INK,
            faint_ink: palette::FAINT_INK,
            line: palette::TILE_LINE,
            path: palette::PATH,
        };
        let light = Self {
            ground: [255; 3],
            is_transparent: false,
            free: [222, 226, 232],
            ink: [24, 28, 36],
            faint_ink: [88, 96, 110],
            line: [70, 84, 108],
            path: [214, 62, 20],
        };
        match background {
            Background::Dark => dark,
            Background::Black => Self { ground: [0; 3], free: [30, 34, 42], ..dark },
            Background::White => light,
            Background::Transparent => Self { is_transparent: true, ..light },
        }
    }
}

use std::fmt;
use std::str::FromStr;
use voxtile::{Error, Layers, Result};

/// A layer of a map that pictures and viewers can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layer {
    /// Mean colour of the points that hit a voxel.
    Colour,
    /// Mean intensity of these points.
    Intensity,
    /// Class of most of these points.
    Class,
    /// Time of the last scan that hit the voxel.
    Time,
}

impl Layer {
    /// All layers, in the order of [`Layers::names`].
    pub const ALL: [Self; 4] = [Self::Colour, Self::Intensity, Self::Class, Self::Time];

    /// Name of the layer, as in `build --layers`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::Intensity => "intensity",
            Self::Class => "class",
            Self::Time => "time",
        }
    }

    /// Returns whether a map with these layers has this one.
    pub fn is_in(self, layers: &Layers) -> bool {
        match self {
            Self::Colour => layers.colour,
            Self::Intensity => layers.intensity_max.is_some(),
            Self::Class => layers.class,
            Self::Time => layers.time,
        }
    }

    /// Checks that a map has the layer.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] with a hint if it does not.
    pub fn check(self, layers: &Layers) -> Result<()> {
        if self.is_in(layers) {
            return Ok(());
        }
        let has = if layers.is_none() { "no layers".to_owned() } else { format!("only {layers}") };
        let reason = format!("needs the layer {self}, but the map has {has}; build one with `layers` {self}");
        Err(Error::argument("color", reason))
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Layer {
    type Err = ();

    fn from_str(text: &str) -> std::result::Result<Self, ()> {
        Self::ALL.into_iter().find(|layer| layer.name() == text).ok_or(())
    }
}

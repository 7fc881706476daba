use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Largest intensity of lidars that measure it with eight bits.
const DEFAULT_INTENSITY_MAX: f32 = 255.0;

/// Layers of a map: what it stores of the points that hit a voxel, besides their evidence. A map has the same layers
/// from its creation on.
///
/// All layers are sums of integers, so they do not depend on the order of points, scans and merged maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layers {
    /// Sums of red, green and blue.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub colour: bool,
    /// Sums of intensities and of their squares; the value is the largest intensity. An intensity is stored as an
    /// integer from 0 to 65535, which represents this value; larger ones count as 65535.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intensity_max: Option<f32>,
    /// Votes for each class, 0 to 255.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub class: bool,
    /// Time stamps of the first and last scan with a hit.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub time: bool,
    /// Sums of the points' offsets from the center of the voxel, and of the products of these: mean and covariance.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub shape: bool,
}

impl Layers {
    /// No layer: a map of evidence alone.
    pub const NONE: Self =
        Self { colour: false, intensity_max: None, class: false, time: false, shape: false };

    /// Returns whether there is no layer.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Names of the layers, in a fixed order: colour, intensity, class, time, shape.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        let layers = [
            ("colour", self.colour),
            ("intensity", self.intensity_max.is_some()),
            ("class", self.class),
            ("time", self.time),
            ("shape", self.shape),
        ];
        layers.into_iter().filter(|(_, is_there)| *is_there).map(|(name, _)| name)
    }

    pub(crate) fn validated(self) -> Result<Self> {
        match self.intensity_max {
            Some(max) if !(max.is_finite() && max > 0.0) => {
                let reason = format!("the largest intensity must be above 0, not {max}");
                Err(Error::argument("layers", reason))
            }
            _ => Ok(self),
        }
    }

    /// Returns an intensity as it is stored; `None` for NaN and without this layer.
    #[inline]
    pub(crate) fn stored_intensity(&self, intensity: f32) -> Option<u16> {
        let max = self.intensity_max.filter(|_| !intensity.is_nan())?;
        let share = f64::from(intensity) / f64::from(max);
        // Saturates: a negative intensity counts as 0.
        Some((share * f64::from(u16::MAX)).round() as u16)
    }
}

/// Reads a list such as `colour,intensity=65535,class,time,shape`, in any order; `none` is no layer. `intensity` without
/// a largest value means 255.
impl FromStr for Layers {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut layers = Self::NONE;
        for name in text.split(',').map(str::trim).filter(|name| *name != "none") {
            let (name, value) =
                name.split_once('=').map_or((name, None), |(name, value)| (name, Some(value)));
            match (name, value) {
                ("colour" | "color", None) => layers.colour = true,
                ("intensity", value) => {
                    let max = value.map_or(Ok(DEFAULT_INTENSITY_MAX), str::parse).map_err(|_| {
                        let reason = format!("`{text}`: the largest intensity must be a number");
                        Error::argument("layers", reason)
                    })?;
                    layers.intensity_max = Some(max);
                }
                ("class", None) => layers.class = true,
                ("time", None) => layers.time = true,
                ("shape", None) => layers.shape = true,
                _ => {
                    let known = "colour, intensity, intensity=MAX, class, time, shape";
                    return Err(Error::argument("layers", format!("`{name}` is no layer; known: {known}")));
                }
            }
        }
        layers.validated()
    }
}

impl fmt::Display for Layers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_none() {
            return f.write_str("none");
        }
        for (k, name) in self.names().enumerate() {
            let separator = if k > 0 { ", " } else { "" };
            write!(f, "{separator}{name}")?;
            if let Some(max) = self.intensity_max.filter(|_| name == "intensity") {
                write!(f, " up to {max}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intensities_are_stored_as_shares_of_the_largest() {
        let layers = Layers { intensity_max: Some(255.0), ..Layers::NONE };
        let stored = |intensity| layers.stored_intensity(intensity);
        assert_eq!([stored(0.0), stored(1.0), stored(255.0)], [Some(0), Some(257), Some(65535)]);
        assert_eq!([stored(1e9), stored(-3.0), stored(f32::INFINITY)], [Some(65535), Some(0), Some(65535)]);
        assert_eq!([stored(f32::NAN), Layers::NONE.stored_intensity(1.0)], [None, None]);
    }

    #[test]
    fn layers_are_read_from_lists() {
        let parsed = |text: &str| text.parse::<Layers>();
        assert_eq!(parsed("none").unwrap(), Layers::NONE);
        let colour_and_class = Layers { colour: true, class: true, ..Layers::NONE };
        assert_eq!(parsed("class, color").unwrap(), colour_and_class);
        let max = |text: &str| parsed(text).unwrap().intensity_max;
        assert_eq!((max("intensity"), max("time,intensity=65535")), (Some(255.0), Some(65535.0)));
        for wrong in ["", "rgb", "intensity=", "intensity=0", "intensity=nan", "class=3", "colour;class"] {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn layers_have_names() {
        let all = Layers { colour: true, intensity_max: Some(1.0), class: true, time: true, shape: true };
        assert_eq!(all.to_string(), "colour, intensity up to 1, class, time, shape");
        assert_eq!(Layers::NONE.to_string(), "none");
        for max in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(Layers { intensity_max: Some(max), ..all }.validated().is_err());
        }
    }
}

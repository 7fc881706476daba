use super::las_layout::Layout;
use super::las_points::LasPoints;
use super::las_units::Units;
use super::laz_chunks::Chunks;
use crate::read_options::ReadOptions;
use std::path::Path;
use voxtile::Result;

/// Scale of the colours of a LAS file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LasColours {
    /// Colours are not read, or there are none.
    None,
    /// All colours are black: the file has fields for colours, but its writer had none.
    Black,
    /// 0 to 255. The specification requires 16 bits, but some programs store 8.
    Bytes,
    /// 0 to 65535.
    Words,
}

impl LasColours {
    /// Determines the scale from all points of a file. A file with 16 bits is read up to its first value above 255.
    pub(super) fn find(
        path: &Path,
        layout: &Layout,
        chunks: Option<Chunks>,
        units: &Units,
        options: &ReadOptions,
    ) -> Result<Self> {
        let mut points = LasPoints::open(path, layout, chunks, units, options)?;
        let mut largest = 0;
        let read = points.visit_colours(|colour| {
            largest = colour.into_iter().fold(largest, u16::max);
            largest <= u16::from(u8::MAX)
        });
        if let Err(error) = read {
            // Reading the points reports it.
            log::debug!("{}: colours: {error}", path.display());
        }
        Ok(match largest {
            0 => Self::Black,
            1..=255 => Self::Bytes,
            _ => Self::Words,
        })
    }

    /// Returns whether points have colours.
    pub(super) fn are_there(self) -> bool {
        matches!(self, Self::Bytes | Self::Words)
    }

    /// Returns a colour with 8 bits.
    pub(super) fn of(self, colour: [u16; 3]) -> [u8; 3] {
        colour.map(|value| {
            let [high, low] = value.to_be_bytes();
            if self == Self::Words { high } else { low }
        })
    }

    /// Returns a remark for the user about a guess.
    pub(super) fn remark(self) -> Option<String> {
        let remark = match self {
            Self::None | Self::Words => return None,
            Self::Black => "all points are black: they count as without colour",
            Self::Bytes => {
                "colours are read as numbers from 0 to 255, because none is larger; LAS files should have 0 to 65535"
            }
        };
        Some(remark.to_owned())
    }
}

use super::compared::CLASSES;
use super::layer_cells::LayerCells;
use super::view::Change;
use crate::Layer;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// Cells of a picture, written by any number of threads. Each cell keeps its highest rank, the highest value of this
/// rank, and the nearest distance. The order of writes does not matter.
pub(super) struct Cells {
    best: Vec<AtomicU64>,
    near: Vec<AtomicU32>,
    /// Values of the layer that the picture shows.
    pub layer: Option<LayerCells>,
}

/// Content of a cell after all writes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub rank: Rank,
    pub value: f32,
    /// Distance towards the viewer in voxels; only of occupied voxels.
    pub near: i32,
}

/// State of a cell; a higher rank hides a lower one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Rank {
    Unknown,
    Free,
    Occupied,
    Changed(Change),
    /// Class of a comparison, by its position in [`CLASSES`](super::compared::CLASSES).
    Compared(u8),
    /// The same, of a voxel that hides all others.
    InFront(u8),
}

/// Numbers of the first class.
const COMPARED: u64 = 6;
const IN_FRONT: u64 = COMPARED + CLASSES.len() as u64;

impl Rank {
    fn number(self) -> u64 {
        match self {
            Self::Unknown => 0,
            Self::Free => 1,
            Self::Occupied => 2,
            Self::Changed(Change::Same) => 3,
            Self::Changed(Change::Vanished) => 4,
            Self::Changed(Change::Appeared) => 5,
            Self::Compared(class) => COMPARED + u64::from(class),
            Self::InFront(class) => IN_FRONT + u64::from(class),
        }
    }

    fn of(number: u64) -> Self {
        match number {
            0 => Self::Unknown,
            1 => Self::Free,
            2 => Self::Occupied,
            3 => Self::Changed(Change::Same),
            4 => Self::Changed(Change::Vanished),
            5 => Self::Changed(Change::Appeared),
            COMPARED..IN_FRONT => Self::Compared((number - COMPARED) as u8),
            _ => Self::InFront((number - IN_FRONT) as u8),
        }
    }

    /// Returns whether relief shading applies. Classes of a comparison but the first have the colors of the legend.
    pub fn is_shaded(self) -> bool {
        self.is_solid() && self <= Self::Compared(0)
    }

    /// Returns whether the cell is or was occupied.
    pub fn is_solid(self) -> bool {
        self > Self::Free
    }
}

impl Cells {
    pub fn new(count: usize, layer: Option<Layer>) -> Self {
        let layer = layer.map(|layer| LayerCells::new(layer, count));
        let mut cells = Self { best: Vec::new(), near: Vec::new(), layer };
        cells.best.resize_with(count, Default::default);
        cells.near.resize_with(count, Default::default);
        cells
    }

    /// Adds an observation of the cell at an index.
    #[inline]
    pub fn add(&self, place: usize, cell: Cell) {
        let (Some(best), Some(near)) = (self.best.get(place), self.near.get(place)) else { return };
        let packed = cell.rank.number() << 32 | u64::from(ordered(cell.value));
        // Most observations change nothing, so read before writing.
        if best.load(Ordering::Relaxed) < packed {
            best.fetch_max(packed, Ordering::Relaxed);
        }
        if cell.rank.is_solid() {
            let nearness = cell.near as u32 ^ SIGN;
            if near.load(Ordering::Relaxed) < nearness {
                near.fetch_max(nearness, Ordering::Relaxed);
            }
        }
    }

    pub fn at(&self, place: usize) -> Cell {
        let best = self.best[place].load(Ordering::Relaxed);
        let near = (self.near[place].load(Ordering::Relaxed) ^ SIGN) as i32;
        Cell { rank: Rank::of(best >> 32), value: unordered(best as u32), near }
    }

    pub fn iter(&self) -> impl Iterator<Item = Cell> {
        (0..self.best.len()).map(|place| self.at(place))
    }
}

const SIGN: u32 = 1 << 31;

/// Maps a float to an integer of the same order.
pub(super) fn ordered(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

pub(super) fn unordered(bits: u32) -> f32 {
    f32::from_bits(if bits & SIGN == 0 { !bits } else { bits & !SIGN })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_rank_counts_and_then_the_highest_value() {
        let cells = Cells::new(2, None);
        let cell = |rank, value, near| Cell { rank, value, near };
        for added in [
            cell(Rank::Occupied, -3.5, -7),
            cell(Rank::Free, 9.0, 100),
            cell(Rank::Occupied, -1.25, -9),
            cell(Rank::Occupied, -2.0, -8),
        ] {
            cells.add(1, added);
        }
        cells.add(77, cell(Rank::Free, 0.0, 0));
        assert_eq!(cells.at(1), cell(Rank::Occupied, -1.25, -7));
        assert_eq!(cells.at(0).rank, Rank::Unknown);
        cells.add(1, cell(Rank::Changed(Change::Same), 0.0, 0));
        assert_eq!(cells.at(1).rank, Rank::Changed(Change::Same));
        let last = CLASSES.len() as u8 - 1;
        for rank in [Rank::Compared(0), Rank::Compared(last), Rank::InFront(0), Rank::InFront(last)] {
            cells.add(1, cell(rank, 0.0, 0));
            assert_eq!(cells.at(1).rank, rank);
        }
    }

    #[test]
    fn numbers_keep_their_order_as_integers() {
        let numbers = [f32::NEG_INFINITY, -2.5, -0.1, 0.0, 1e-9, 3.0, f32::INFINITY];
        assert!(numbers.windows(2).all(|pair| ordered(pair[0]) < ordered(pair[1])));
        assert!(numbers.iter().all(|&number| unordered(ordered(number)) == number));
    }
}

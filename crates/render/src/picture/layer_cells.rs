use crate::Layer;
use parking_lot::Mutex;
use voxtile::VoxelLayers;

/// Values of a layer, written by any number of threads. Each cell keeps those of the voxels that are nearest to the
/// viewer: a cell of several voxels along its edge may have several. The order of writes does not matter.
pub(super) struct LayerCells {
    layer: Layer,
    blocks: Vec<Mutex<Vec<Nearest>>>,
}

/// Cells per lock.
const BLOCK: usize = 64;

/// The nearest voxels of a cell.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    /// Distance towards the viewer in voxels; `None` before the first voxel.
    near: Option<i32>,
    sum: Sum,
}

/// Values of voxels.
#[derive(Clone, Copy, Debug)]
enum Sum {
    None,
    Colour { sums: [u32; 3], voxels: u32 },
    Intensity { sum: u64, voxels: u32 },
    Class { class: u8, votes: u64 },
    Time { last_ns: i64 },
}

/// Value of a layer in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LayerValue {
    /// Mean color.
    Colour([u8; 3]),
    /// Mean intensity as a share of the largest.
    Intensity(f64),
    /// Class of the voxel with most votes for its class, the lowest of several.
    Class(u8),
    /// Latest time of a hit in nanoseconds.
    Time(i64),
}

impl LayerCells {
    pub fn new(layer: Layer, count: usize) -> Self {
        let none = Nearest { near: None, sum: Sum::None };
        let block = || Mutex::new(vec![none; BLOCK]);
        Self { layer, blocks: (0..count.div_ceil(BLOCK)).map(|_| block()).collect() }
    }

    /// Adds an occupied voxel to the cell at an index. `layers` is only called for a voxel that may be seen.
    pub fn add(&self, place: usize, near: i32, layers: impl FnOnce() -> Option<VoxelLayers>) {
        let Some(block) = self.blocks.get(place / BLOCK) else { return };
        let mut block = block.lock();
        let cell = &mut block[place % BLOCK];
        if cell.near > Some(near) {
            return;
        }
        if cell.near < Some(near) {
            *cell = Nearest { near: Some(near), sum: Sum::None };
        }
        cell.sum = cell.sum.plus(layers().map_or(Sum::None, |layers| Sum::of(self.layer, &layers)));
    }

    /// Returns the value of a cell; `None` if its nearest voxels have none.
    pub fn at(&self, place: usize) -> Option<LayerValue> {
        self.blocks.get(place / BLOCK)?.lock()[place % BLOCK].sum.value()
    }
}

impl LayerValue {
    /// Returns the value of a voxel; `None` if it has none.
    pub fn of(layer: Layer, layers: &VoxelLayers) -> Option<Self> {
        Sum::of(layer, layers).value()
    }
}

impl Sum {
    /// Returns the value of a voxel.
    fn of(layer: Layer, layers: &VoxelLayers) -> Self {
        match layer {
            Layer::Colour => layers.mean_colour().map_or(Self::None, |colour| {
                let sums = colour.map(u32::from);
                Self::Colour { sums, voxels: 1 }
            }),
            Layer::Intensity => match layers.intensity.points {
                0 => Self::None,
                points => Self::Intensity { sum: (layers.intensity.sum + points / 2) / points, voxels: 1 },
            },
            Layer::Class => {
                let class = layers.class();
                let votes = layers.classes.iter().find(|votes| Some(votes.class) == class);
                votes.map_or(Self::None, |votes| Self::Class { class: votes.class, votes: votes.votes })
            }
            Layer::Time => layers.time.map_or(Self::None, |time| Self::Time { last_ns: time.last_ns }),
        }
    }

    fn value(self) -> Option<LayerValue> {
        Some(match self {
            Self::None => return None,
            Self::Colour { sums, voxels } => {
                LayerValue::Colour(sums.map(|sum| (sum.saturating_add(voxels / 2) / voxels).min(255) as u8))
            }
            Self::Intensity { sum, voxels } => {
                LayerValue::Intensity(sum as f64 / f64::from(voxels) / f64::from(u16::MAX))
            }
            Self::Class { class, .. } => LayerValue::Class(class),
            Self::Time { last_ns } => LayerValue::Time(last_ns),
        })
    }

    fn plus(self, other: Self) -> Self {
        match (self, other) {
            (Self::Colour { sums, voxels }, Self::Colour { sums: more, voxels: count }) => Self::Colour {
                sums: std::array::from_fn(|k| sums[k].saturating_add(more[k])),
                voxels: voxels.saturating_add(count),
            },
            (Self::Intensity { sum, voxels }, Self::Intensity { sum: more, voxels: count }) => {
                Self::Intensity { sum: sum + more, voxels: voxels.saturating_add(count) }
            }
            (Self::Class { class: a, votes }, Self::Class { class: b, votes: others }) => {
                let is_first = (votes, b) >= (others, a);
                if is_first { self } else { other }
            }
            (Self::Time { last_ns: a }, Self::Time { last_ns: b }) => Self::Time { last_ns: a.max(b) },
            (Self::None, sum) | (sum, _) => sum,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{ClassVotes, ColourSums, TimeSpan};

    fn voxel(colour: [u64; 3], class: u8, votes: u64, last_ns: i64) -> VoxelLayers {
        let [red, green, blue] = colour;
        let mut layers = VoxelLayers::default();
        layers.colour = ColourSums { points: 1, red, green, blue };
        layers.classes = vec![ClassVotes { class, votes }];
        layers.time = Some(TimeSpan { first_ns: 0, last_ns });
        layers
    }

    #[test]
    fn the_nearest_voxels_count_in_any_order() {
        let voxels = [
            (3, Some(voxel([10, 20, 31], 6, 2, 50))),
            (3, Some(voxel([20, 40, 60], 2, 2, 70))),
            (1, Some(voxel([200, 0, 0], 9, 99, 900))),
            (3, None),
        ];
        let orders = [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1], [1, 3, 0, 2]];
        let of = |layer: Layer| {
            let values = orders.map(|order| {
                let cells = LayerCells::new(layer, 100);
                for (near, layers) in order.map(|number| voxels[number].clone()) {
                    cells.add(70, near, || layers);
                }
                cells.add(1000, 9, || None);
                (cells.at(70), cells.at(0), cells.at(1000))
            });
            assert!(values.iter().all(|found| *found == values[0]), "{values:?}");
            assert_eq!((values[0].1, values[0].2), (None, None));
            values[0].0
        };
        assert_eq!(of(Layer::Colour), Some(LayerValue::Colour([15, 30, 46])));
        assert_eq!(of(Layer::Class), Some(LayerValue::Class(2)));
        assert_eq!(of(Layer::Time), Some(LayerValue::Time(70)));
        assert_eq!(of(Layer::Intensity), None);
    }

    #[test]
    fn a_voxel_without_a_value_hides_those_behind_it() {
        let cells = LayerCells::new(Layer::Colour, 1);
        cells.add(0, -5, || Some(voxel([1, 2, 3], 0, 1, 0)));
        cells.add(0, -4, || None);
        assert_eq!(cells.at(0), None);
    }
}

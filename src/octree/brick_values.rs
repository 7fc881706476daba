use super::node_colour::NodeColour;
use crate::space::{BRICK_VOXELS, BrickCode, BrickMask, add_to_mask};
use std::ops::Range;

/// Values of many voxels, in parts of bricks: the input of an encoded block of an octree.
///
/// Takes four bytes per voxel, seven with colours, and 80 per part. A brick may have several parts: one on the border
/// of two tiles has voxels of both.
#[derive(Debug, Default)]
pub struct BrickValues {
    parts: Vec<Part>,
    values: Vec<f32>,
    /// One per value; `None` in a tree without colours.
    colours: Option<Vec<NodeColour>>,
}

#[derive(Clone, Copy, Debug)]
struct Part {
    brick: BrickCode,
    known: BrickMask,
    /// Index of its first value. The values are those of the known voxels in Morton order.
    first: u64,
}

/// All voxels of one brick.
#[derive(Debug)]
pub(super) struct BrickContent {
    pub(super) known: BrickMask,
    /// Negative infinity for unknown voxels.
    pub(super) values: [f32; BRICK_VOXELS],
    /// Empty in a tree without colours.
    pub(super) colours: Vec<NodeColour>,
}

impl BrickValues {
    /// Creates values of voxels that have colours.
    pub fn with_colours() -> Self {
        Self { colours: Some(Vec::new()), ..Self::default() }
    }

    /// Returns whether the voxels have colours.
    pub fn has_colours(&self) -> bool {
        self.colours.is_some()
    }

    /// Bytes in use.
    pub fn bytes(&self) -> usize {
        self.parts.len() * size_of::<Part>() + self.values.len() * self.voxel_bytes()
    }

    /// Bytes per voxel, without those of its part.
    pub fn voxel_bytes(&self) -> usize {
        size_of::<f32>() + if self.has_colours() { size_of::<NodeColour>() } else { 0 }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns whether there is no voxel.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Removes the voxels and keeps the memory.
    pub fn clear(&mut self) {
        self.parts.clear();
        self.values.clear();
        if let Some(colours) = &mut self.colours {
            colours.clear();
        }
    }

    /// Begins the next part; [`BrickValues::add`] adds its voxels, and [`BrickValues::end`] ends it.
    pub fn begin(&mut self, brick: BrickCode) {
        self.parts.push(Part { brick, known: [0; 8], first: self.values.len() as u64 });
    }

    /// Adds a voxel without a colour to the current part. Positions (0 to 511) must ascend.
    #[inline]
    pub fn add(&mut self, place: usize, value: f32) {
        self.add_coloured(place, value, NodeColour::NONE);
    }

    /// Adds a voxel to the current part. The colour counts only if the voxels have colours.
    #[inline]
    pub fn add_coloured(&mut self, place: usize, value: f32, colour: NodeColour) {
        if let Some(part) = self.parts.last_mut() {
            add_to_mask(&mut part.known, place);
            self.values.push(value);
            if let Some(colours) = &mut self.colours {
                colours.push(colour);
            }
        }
    }

    /// Ends a part; an empty one is dropped.
    pub fn end(&mut self) {
        if self.parts.last().is_some_and(|part| part.known == [0; 8]) {
            self.parts.pop();
        }
    }

    /// Sorts the parts in Morton order of their bricks, and returns the brick of each part.
    pub(super) fn sorted(&mut self) -> Vec<BrickCode> {
        // Stable, and fast for a few ascending runs.
        self.parts.sort_by_key(|part| part.brick);
        self.parts.iter().map(|part| part.brick).collect()
    }

    /// All voxels with their values, part by part.
    #[cfg(test)]
    pub(crate) fn voxels(&self) -> impl Iterator<Item = (crate::space::MortonCode, f32)> {
        let codes = self
            .parts
            .iter()
            .flat_map(|part| crate::space::places(part.known).map(|place| part.brick.voxel(place)));
        codes.zip(self.values.iter().copied())
    }

    /// Writes the voxels of the parts of one brick to `content`.
    pub(super) fn gather(&self, parts: Range<usize>, content: &mut BrickContent) {
        content.clear(self.has_colours());
        for part in &self.parts[parts] {
            let mut values = self.values[part.first as usize..].iter();
            let mut colours = self.colours.iter().flat_map(|colours| &colours[part.first as usize..]);
            for (word, &known) in part.known.iter().enumerate() {
                content.known[word] |= known;
                let mut bits = known;
                while bits != 0 {
                    let place = 64 * word + bits.trailing_zeros() as usize;
                    content.values[place] = values.next().copied().unwrap_or(f32::NEG_INFINITY);
                    if let Some(colour) = colours.next() {
                        content.colours[place] = *colour;
                    }
                    bits &= bits - 1;
                }
            }
        }
    }
}

impl BrickContent {
    pub(super) fn new() -> Self {
        Self { known: [0; 8], values: [f32::NEG_INFINITY; BRICK_VOXELS], colours: Vec::new() }
    }

    fn clear(&mut self, has_colours: bool) {
        self.known = [0; 8];
        self.values.fill(f32::NEG_INFINITY);
        self.colours.clear();
        if has_colours {
            self.colours.resize(BRICK_VOXELS, NodeColour::NONE);
        }
    }

    pub(super) fn word(&self, word: usize) -> [f32; 64] {
        std::array::from_fn(|bit| self.values[64 * word + bit])
    }
}

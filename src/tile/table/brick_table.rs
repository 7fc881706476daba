use super::brick::Brick;
use super::brick_directory::{Address, BLOCK_EDGE, BrickDirectory};
use super::brick_view::BrickView;
use super::marked_block::MarkedBlock;
use super::palette::Palette;
use super::summary::{Summary, larger};
use crate::octree::write_bt_of_bricks;
use crate::scan::LayerHits;
use crate::sensor::Evidence;
use crate::space::{BRICK_EDGE, BrickCode, BrickMask, MortonCode, VoxelBox, VoxelIndex, VoxelKey, places};
use crate::tile::layers::{LayerTable, VoxelLayers};
use std::io::{self, Write};
use std::ops::Range;

/// Exact evidence of each observed voxel of a tile. All other data of a tile are derived from it.
///
/// The table consists of bricks of 8 x 8 x 8 voxels, in which a voxel is the number of its state in the tile's palette:
/// four to five bytes per observed voxel in total. If there are too many states for a palette (intensities that never
/// repeat), bricks contain the evidence itself.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// In the order of their first update.
    pub(crate) bricks: Vec<Brick>,
    pub(crate) directory: BrickDirectory,
    /// Numbers of the bricks in Morton order, as of the last [`Table::sum_up`].
    order: Vec<u32>,
    pub(crate) palette: Palette,
    pub(crate) len: usize,
    /// Bytes of the bricks' cells; [`Table::bytes`] adds the rest.
    pub(crate) cell_bytes: usize,
    /// Number of bricks that stopped using the palette since its last clean-up.
    pub(crate) made_plain: usize,
    /// What the map stores of the points that hit voxels; `None` without a hit or without layers.
    layers: Option<Box<LayerTable>>,
}

impl Table {
    /// Number of observed voxels.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether no voxel was observed.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        self.bricks.capacity() * size_of::<Brick>()
            + self.directory.bytes()
            + self.order.capacity() * size_of::<u32>()
            + self.palette.bytes()
            + self.cell_bytes
            + self.layer_bytes()
    }

    /// Bytes of memory on the heap of the layers.
    pub fn layer_bytes(&self) -> usize {
        self.layers.as_ref().map_or(0, |layers| size_of::<LayerTable>() + layers.bytes())
    }

    /// What the map stores of the points that hit voxels; `None` without a hit or without layers.
    pub fn layers(&self) -> Option<&LayerTable> {
        self.layers.as_deref()
    }

    /// What the map stores of the points that hit a voxel; `None` without a hit or without layers.
    pub fn layers_of(&self, voxel: MortonCode) -> Option<VoxelLayers> {
        self.layers.as_ref()?.get(voxel)
    }

    /// Replaces the layers.
    pub fn set_layers(&mut self, layers: Option<LayerTable>) {
        self.layers = layers.filter(|layers| !layers.is_empty()).map(Box::new);
    }

    /// Adds points that hit voxels to the layers; `first` is the tile's lowest voxel.
    pub(crate) fn add_hits(&mut self, first: VoxelIndex, hits: &LayerHits) {
        if !hits.is_empty() {
            self.layers.get_or_insert_with(|| Box::new(LayerTable::new(hits.layers))).add(first, hits);
        }
    }

    /// The evidence of a voxel; `None` if it was never observed.
    #[inline]
    pub fn get(&self, code: MortonCode) -> Option<Evidence> {
        self.at(Address::of_code(code))
    }

    /// The evidence of the voxel with a key; `None` if it was never observed.
    #[inline]
    pub fn get_key(&self, key: VoxelKey) -> Option<Evidence> {
        self.at(Address::of_key(key))
    }

    pub(crate) fn brick_count(&self) -> usize {
        self.bricks.len()
    }

    /// Returns whether any voxel of a brick was observed.
    pub fn has_brick(&self, brick: BrickCode) -> bool {
        self.brick(brick).is_some()
    }

    /// Number of a brick with an observed voxel. It is valid until the table changes.
    #[inline]
    pub(crate) fn number_of_brick(&self, brick: BrickCode) -> Option<u32> {
        self.directory.get(Address::of_brick(brick)).checked_sub(1)
    }

    /// View of the brick with a number, for reading many of its voxels.
    #[inline]
    pub(crate) fn numbered(&self, number: u32) -> Option<BrickView<'_>> {
        Some(BrickView { brick: self.bricks.get(number as usize)?, palette: &self.palette })
    }

    /// Returns a cube of 8, 16 or 32 voxels around a voxel in which all log-odds are below a threshold; `None` if the
    /// voxel's brick may reach the threshold. The cube may extend beyond the tile.
    #[inline]
    pub(crate) fn below_around(&self, voxel: VoxelIndex, threshold: f64) -> Option<VoxelBox> {
        if !Summary::are_marks_for(threshold) {
            return None;
        }
        let at = Address::of_key(VoxelKey::from_index(voxel));
        let marks = self.directory.marks(at);
        // Eight consecutive bricks in Morton order form a cube.
        let octant = marks >> (at.brick & !7) & 0xff;
        let edge = match (marks, octant, octant >> (at.brick & 7) & 1) {
            (0, ..) => BLOCK_EDGE,
            (_, 0, _) => BLOCK_EDGE / 2,
            (.., 0) => BRICK_EDGE,
            _ => return None,
        };
        let min = voxel.map(|k| k & !(edge - 1));
        Some(VoxelBox { min, end: min.map(|k| k.saturating_add(edge)) })
    }

    /// Visits the blocks of bricks that intersect a box and may contain log-odds of at least a threshold. Returns
    /// `false`, without visiting any, if the table does not track the bricks for this threshold.
    pub(crate) fn visit_marked(
        &self,
        voxels: &VoxelBox,
        threshold: f64,
        mut visit: impl FnMut(MarkedBlock),
    ) -> bool {
        if !Summary::are_marks_for(threshold) {
            return false;
        }
        let low = voxels.min.map(|k| k & !(BLOCK_EDGE - 1));
        let along = |k: usize| (low[k]..voxels.end[k]).step_by(BLOCK_EDGE as usize);
        for x in along(0) {
            for y in along(1) {
                for z in along(2) {
                    let min = [x, y, z];
                    let (number, marks) = self.directory.marked(Address::of_key(VoxelKey::from_index(min)));
                    if marks != 0 {
                        visit(MarkedBlock { min, marks, number });
                    }
                }
            }
        }
        true
    }

    /// Number of the brick at a position of a block; `None` if it is absent.
    #[inline]
    pub(crate) fn number_in_block(&self, block: &MarkedBlock, place: usize) -> Option<u32> {
        self.directory.at_place(block.number, place).checked_sub(1)
    }

    /// Marks a brick if a change may have made voxels occupied; `before` is the bound of its log-odds before the
    /// change.
    #[inline]
    pub(crate) fn note_raised(&mut self, number: usize, before: f32) {
        let brick = &self.bricks[number];
        if before <= Summary::MARKED_ABOVE && brick.bound() > Summary::MARKED_ABOVE {
            self.directory.mark(Address::of_brick(brick.code()));
        }
    }

    /// The bricks with observed voxels, in Morton order.
    pub fn bricks(&self) -> impl Iterator<Item = BrickCode> {
        self.bricks_in_order().map(Brick::code)
    }

    /// The observed voxels of one brick, in Morton order.
    pub fn voxels_of_brick(&self, brick: BrickCode) -> impl Iterator<Item = (MortonCode, Evidence)> {
        self.brick(brick).into_iter().flat_map(|brick| self.voxels_in(brick))
    }

    /// Visits the observed voxels of one brick in Morton order, as position and evidence.
    pub fn for_each_in(&self, brick: BrickCode, visit: impl FnMut(usize, Evidence)) {
        if let Some(brick) = self.brick(brick) {
            brick.for_each(&self.palette, visit);
        }
    }

    /// The observed voxels among those of a mask, in Morton order.
    pub fn voxels_of_mask(
        &self,
        brick: BrickCode,
        mask: BrickMask,
    ) -> impl Iterator<Item = (MortonCode, Evidence)> {
        let found = self.brick(brick).into_iter();
        found.flat_map(move |found| {
            places(mask).filter_map(move |place| Some((brick.voxel(place), found.get(place, &self.palette)?)))
        })
    }

    /// The observed voxels in Morton order.
    pub fn iter(&self) -> impl Iterator<Item = (MortonCode, Evidence)> {
        self.bricks_in_order().flat_map(|brick| self.voxels_in(brick))
    }

    /// The observed voxels whose log-odds are at least a threshold, in Morton order. Bricks of free space are skipped
    /// as a whole.
    pub fn iter_from(&self, threshold: f64) -> impl Iterator<Item = (MortonCode, Evidence)> {
        self.bricks_in_order().filter(move |brick| !brick.is_below(threshold)).flat_map(move |brick| {
            let found = places(brick.mask_from(threshold, &self.palette));
            found.filter_map(move |place| Some((brick.code().voxel(place), brick.get(place, &self.palette)?)))
        })
    }

    /// Views of the bricks with observed voxels, in no particular order.
    pub(crate) fn brick_views(&self) -> impl Iterator<Item = BrickView<'_>> {
        self.bricks.iter().map(|brick| BrickView { brick, palette: &self.palette })
    }

    /// Number of observed voxels whose log-odds are at least a threshold.
    pub fn count_from(&self, threshold: f64) -> usize {
        let holds = |evidence: Evidence| evidence.log_odds >= threshold;
        let states = self.palette.states_with(holds);
        self.bricks.iter().map(|brick| brick.count(&states, holds)).sum()
    }

    /// Writes the `.bt` file that OctoMap's `writeBinary` would write for the octree of the table. A voxel is occupied
    /// if its log-odds as `f32` are at least the threshold.
    ///
    /// # Errors
    ///
    /// Same errors as [`write_bt`](crate::octree::write_bt).
    pub fn write_bt(&self, resolution_m: f64, threshold: f32, out: &mut impl Write) -> io::Result<()> {
        let bricks: Vec<&Brick> = self.bricks_in_order().collect();
        let codes: Vec<BrickCode> = bricks.iter().map(|brick| brick.code()).collect();
        let nodes_of = |position: usize| bricks[position].nodes(Some(threshold), &self.palette).0;
        write_bt_of_bricks(&codes, nodes_of, resolution_m, out)
    }

    /// Largest log-odds under the octree node at `depth` (13, a brick, to 16) that contains a voxel; `None` if all are
    /// unknown.
    pub(crate) fn max_under(&self, code: MortonCode, depth: u8) -> Option<f32> {
        let brick = self.brick(code.brick())?;
        let span = MortonCode::span(depth) as usize;
        match span {
            512 => brick.max(&self.palette),
            _ => brick.max_of(code.ancestor(depth).place_in_brick(), span, &self.palette),
        }
    }

    /// Largest log-odds in a range of bricks; `None` if all are unknown.
    pub(crate) fn max_of_bricks(&self, range: Range<BrickCode>) -> Option<f32> {
        if range.end.0 - range.start.0 <= self.bricks.len() as u64 {
            let bricks = (range.start.0..range.end.0).filter_map(|code| self.brick(BrickCode(code)));
            return bricks.filter_map(|brick| brick.max(&self.palette)).reduce(larger);
        }
        let bricks = self.bricks.iter().filter(|brick| range.contains(&brick.code()));
        bricks.filter_map(|brick| brick.max(&self.palette)).reduce(larger)
    }

    /// Updates the bricks' summaries and their order.
    pub(crate) fn sum_up(&mut self) {
        self.bricks.iter_mut().for_each(|brick| brick.sum_up(&self.palette));
        if !self.is_in_order() {
            self.order = self.sorted_numbers();
        }
    }

    /// The bricks' summaries in Morton order, as of the last [`Table::sum_up`].
    pub(crate) fn summaries(&self) -> impl Iterator<Item = (BrickCode, Summary)> {
        self.bricks_in_order().map(|brick| (brick.code(), brick.summary()))
    }

    fn voxels_in<'a>(&'a self, brick: &'a Brick) -> impl Iterator<Item = (MortonCode, Evidence)> {
        brick.iter(&self.palette).map(|(place, evidence)| (brick.code().voxel(place), evidence))
    }

    pub(crate) fn bricks_in_order(&self) -> impl Iterator<Item = &Brick> {
        let in_order = if self.is_in_order() { Vec::new() } else { self.sorted_numbers() };
        let order = if self.is_in_order() { self.order.iter() } else { [].iter() };
        order.copied().chain(in_order).map(|number| &self.bricks[number as usize])
    }

    fn is_in_order(&self) -> bool {
        self.order.len() == self.bricks.len()
    }

    fn sorted_numbers(&self) -> Vec<u32> {
        let mut numbers: Vec<u32> = (0..self.bricks.len() as u32).collect();
        numbers.sort_unstable_by_key(|&number| self.bricks[number as usize].code());
        numbers
    }

    #[inline]
    fn at(&self, at: Address) -> Option<Evidence> {
        self.brick_at(at).unwrap_or(Brick::ABSENT_BRICK).get(at.place, &self.palette)
    }

    #[inline]
    fn brick(&self, code: BrickCode) -> Option<&Brick> {
        self.brick_at(Address::of_brick(code))
    }

    #[inline]
    fn brick_at(&self, at: Address) -> Option<&Brick> {
        self.bricks.get((self.directory.get(at) as usize).wrapping_sub(1))
    }

    pub(crate) fn with_palette(palette: Palette) -> Self {
        Self { palette, ..Self::default() }
    }

    /// Value of [`Table::bytes`], recomputed.
    #[cfg(test)]
    pub(crate) fn counted_bytes(&self) -> usize {
        self.bytes() - self.cell_bytes + self.bricks.iter().map(Brick::heap_bytes).sum::<usize>()
    }
}

use super::bricks::{Intensities, intensities_of};
use crate::scan::pages::{MarkedPage, PAGE_EDGE, PageMap, brick_in_page};
use crate::scan::updates::{BrickUpdate, MappedTiles, brick_code, part_in_tile};
use crate::space::{
    BRICK_EDGE, BrickCode, BrickMask, Grid, TileBox, TileIndex, VoxelIndex, mask_of_box, places,
};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Returns the updates of the marks in pages by mapped tile, in Morton order. Bricks across a tile border are split.
/// `weak` returns the weak misses of a brick by its index.
///
/// Tiles are looked up once per page, not per brick, and only pages are sorted.
pub(crate) fn updates_of_pages(
    mapped: MappedTiles<'_>,
    pages: &PageMap<MarkedPage>,
    intensities: &Intensities,
    weak: impl Fn(VoxelIndex) -> BrickMask + Sync,
) -> Vec<(TileIndex, Vec<BrickUpdate>)> {
    let mut in_order: Vec<Page<'_>> = pages
        .pages()
        .iter()
        .zip(pages.indices())
        .map(|(page, &index)| Page { page, index, code: brick_code(index.map(|k| k * PAGE_BRICKS_EDGE)) })
        .collect();
    in_order.sort_unstable_by_key(|page| page.code);
    let updates = pages_by_tile(mapped, &in_order).into_par_iter().map(|(tile, numbers)| {
        let of_tile = numbers.iter().map(|&number| &in_order[number as usize]);
        (tile, updates_of_tile(mapped.grid, tile, of_tile, intensities, &weak))
    });
    let mut tiles: Vec<(TileIndex, Vec<BrickUpdate>)> = updates.collect();
    tiles.retain(|(_, bricks)| !bricks.is_empty());
    tiles
}

const PAGE_BRICKS_EDGE: i32 = PAGE_EDGE as i32 / BRICK_EDGE;

#[derive(Clone, Copy)]
struct Page<'a> {
    page: &'a MarkedPage,
    /// The indices of its voxels divided by 64.
    index: VoxelIndex,
    /// Morton code of its lowest brick.
    code: BrickCode,
}

impl Page<'_> {
    /// Lowest voxel of the page.
    fn min(&self) -> VoxelIndex {
        self.index.map(|k| k * PAGE_EDGE as i32)
    }
}

/// Returns, for each mapped tile, the numbers of the pages that overlap it, in order.
fn pages_by_tile(mapped: MappedTiles<'_>, pages: &[Page<'_>]) -> Vec<(TileIndex, Vec<u32>)> {
    let mut tiles: FxHashMap<TileIndex, Vec<u32>> = FxHashMap::default();
    for (number, page) in pages.iter().enumerate() {
        let last = page.min().map(|k| k.saturating_add(PAGE_EDGE as i32 - 1));
        let around = TileBox::new(mapped.grid.tile_of_voxel(page.min()), mapped.grid.tile_of_voxel(last));
        for tile in around.tiles().filter(|tile| mapped.has(*tile)) {
            tiles.entry(tile).or_default().push(number as u32);
        }
    }
    tiles.into_iter().collect()
}

fn updates_of_tile<'a>(
    grid: &Grid,
    tile: TileIndex,
    pages: impl Iterator<Item = &'a Page<'a>> + Clone,
    intensities: &Intensities,
    weak: impl Fn(VoxelIndex) -> BrickMask,
) -> Vec<BrickUpdate> {
    let parts = pages.map(|page| (page, PagePart::new(grid, tile, page)));
    let most = parts
        .clone()
        .map(|(_, part)| part.bricks.iter().map(|word| word.count_ones()).sum::<u32>())
        .sum::<u32>();
    let mut updates = Vec::with_capacity(most as usize);
    for (page, part) in parts {
        for place in places(part.bricks) {
            let (mut hits, mut misses) = page.page.brick(place);
            let index = brick_in_page(page.index, place as u32);
            if part.whole[place / 64] >> (place % 64) & 1 == 0 {
                let part = part_in_tile(grid, tile, index);
                (0..8).for_each(|word| {
                    (hits[word], misses[word]) = (hits[word] & part[word], misses[word] & part[word])
                });
            }
            (0..8).for_each(|word| misses[word] &= !hits[word]);
            if (0..8).fold(0, |all, word| all | hits[word] | misses[word]) != 0 {
                let mut weak = weak(index);
                (0..8).for_each(|word| weak[word] &= misses[word]);
                updates.push(BrickUpdate {
                    brick: BrickCode(page.code.0 | place as u64),
                    hits,
                    misses,
                    weak,
                    intensities: intensities_of(index, &hits, intensities),
                });
            }
        }
    }
    updates
}

/// Bricks of a page that are in a tile, as masks.
struct PagePart {
    /// Bricks with marks that overlap the tile.
    bricks: BrickMask,
    /// Bricks that are completely in the tile.
    whole: BrickMask,
}

impl PagePart {
    fn new(grid: &Grid, tile: TileIndex, page: &Page<'_>) -> Self {
        let (voxels, min) = (grid.voxels_of_tile(tile), page.min());
        let from = |k: usize| i64::from(voxels.min[k]) - i64::from(min[k]);
        let end = |k: usize| i64::from(voxels.end[k]) - i64::from(min[k]);
        let edge = i64::from(BRICK_EDGE);
        // The bricks of a page have the same Morton positions as the voxels of a brick.
        let bricks = |voxels: i64| voxels.div_euclid(edge).clamp(0, edge) as i32;
        let up = edge - 1;
        let overlap = mask_of_box(
            std::array::from_fn(|k| bricks(from(k))),
            std::array::from_fn(|k| bricks(end(k) + up)),
        );
        let whole = mask_of_box(
            std::array::from_fn(|k| bricks(from(k) + up)),
            std::array::from_fn(|k| bricks(end(k))),
        );
        let found = page.page.found();
        Self { bricks: std::array::from_fn(|word| overlap[word] & found[word]), whole }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bricks::updates_by_tile;
    use super::*;
    use crate::scan::pages::Footprint;
    use crate::space::TileSelection;
    use proptest::prelude::*;

    fn pages(marks: &[(VoxelIndex, bool)]) -> PageMap<MarkedPage> {
        let mut pages = PageMap::default();
        pages.clear(Default::default(), 2);
        for &(voxel, is_hit) in marks {
            let number = pages.number_of(voxel);
            let page: &mut MarkedPage = &mut pages.pages_mut()[number];
            let [x, y, z] = voxel.map(|k| k as u32);
            match is_hit {
                true => page.hit(voxel),
                false => page.pass::<0>(x, MarkedPage::cell::<1, 2>(y, z)),
            }
        }
        pages
    }

    proptest! {
        #[test]
        fn updates_of_pages_equal_those_of_their_bricks(
            base in prop::sample::select(vec![[0; 3], [32_700, -90, 32_760], [i32::MAX - 201; 3], [i32::MIN; 3]]),
            marks in prop::collection::vec((prop::array::uniform3(0..200_i32), any::<bool>()), 0..60),
            edge in prop::sample::select(vec![32, 50, 64, 100, 1024]),
            some in any::<bool>(),
        ) {
            let marks: Vec<(VoxelIndex, bool)> = marks
                .into_iter()
                .map(|(offset, is_hit)| (std::array::from_fn(|k| base[k] + offset[k]), is_hit))
                .collect();
            let grid = &Grid::new(1.0, f64::from(edge)).unwrap();
            let first = marks.first().map_or(base, |mark| mark.0);
            let tile = grid.tile_of_voxel(first);
            let selection = &TileSelection::from(TileBox::new(tile, tile));
            let mapped = MappedTiles { grid, selection: some.then_some(selection) };
            let mut pages = pages(&marks);
            let bricks: Vec<_> =
                pages.pages().iter().zip(pages.indices()).flat_map(|(page, index)| page.bricks(*index)).collect();
            let none = Intensities::default();
            let mut expected = updates_by_tile(mapped, &bricks, &none, |_| [0; 8]);
            let mut updates = updates_of_pages(mapped, &pages, &none, |_| [0; 8]);
            pages.pages_mut().iter_mut().for_each(MarkedPage::find_bricks);
            let mut found = updates_of_pages(mapped, &pages, &none, |_| [0; 8]);
            for tiles in [&mut expected, &mut updates, &mut found] {
                tiles.sort_by_key(|(tile, _)| *tile);
            }
            prop_assert_eq!(&updates, &expected);
            prop_assert_eq!(&found, &expected);
            // Pages that are kept for reuse are empty.
            pages.clear(Default::default(), 2);
            for index in [[0; 3], [64; 3], [128; 3]] {
                let number = pages.number_of(index);
                prop_assert_eq!(pages.pages()[number].count_bricks(), 0);
            }
        }
    }
}

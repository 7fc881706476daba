use crate::cap::Cap;
use crate::options::DistanceOptions;
use crate::solve::Solver;
use std::collections::BTreeMap;
use voxtile::TileIndex;
use voxtile::space::TileBox;

/// Most tiles along an axis that are computed together.
const MAX_EDGE: usize = 16;

/// Groups tiles into boxes that are computed together: as large as the memory allows, because the surroundings of a box
/// are computed in addition to it.
pub(super) fn boxes_of(
    tiles: &[TileIndex],
    edge: usize,
    cap: Cap,
    options: &DistanceOptions,
    memory_bytes: usize,
) -> Vec<Vec<TileIndex>> {
    let Some(bounds) = TileBox::of(tiles.iter().copied()) else { return Vec::new() };
    let box_edges = largest_box(bounds, edge, cap, options, memory_bytes);
    let mut boxes: BTreeMap<[i32; 3], Vec<TileIndex>> = BTreeMap::new();
    for &tile in tiles {
        let index = tile.to_array();
        let number = std::array::from_fn(|k| index[k].div_euclid(box_edges[k]));
        boxes.entry(number).or_default().push(tile);
    }
    boxes.into_values().collect()
}

/// Returns the numbers of tiles along the edges of the box with the least share of surroundings.
fn largest_box(
    bounds: TileBox,
    edge: usize,
    cap: Cap,
    options: &DistanceOptions,
    memory_bytes: usize,
) -> [i32; 3] {
    let (low, high) = (bounds.min().to_array(), bounds.max().to_array());
    let most: [usize; 3] = std::array::from_fn(|k| (low[k].abs_diff(high[k]) as usize).min(MAX_EDGE - 1) + 1);
    let fits = |tiles: &[usize; 3]| Solver::bytes_of(tiles.map(|k| k * edge), cap, options) <= memory_bytes;
    let share = |tiles: &[usize; 3]| -> f64 {
        tiles.iter().map(|&k| ((k * edge + 2 * cap.reach) as f64) / ((k * edge) as f64)).product()
    };
    let mut tiles = [1; 3];
    loop {
        let larger = (0..3).filter_map(|axis| {
            let mut larger = tiles;
            larger[axis] += 1;
            (larger[axis] <= most[axis] && fits(&larger)).then_some(larger)
        });
        match larger.min_by(|a, b| share(a).total_cmp(&share(b))) {
            Some(larger) => tiles = larger,
            None => return tiles.map(|k| k as i32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_partition_the_tiles_and_fit_in_memory() {
        let cap = Cap { squared: 2500, reach: 50 };
        let options = DistanceOptions::default();
        let tiles: Vec<_> = TileBox::new([-7, -3, -1].into(), [9, 20, 1].into()).tiles().collect();
        let mut counts = Vec::new();
        for memory_bytes in [0, 100 << 20, 1 << 30] {
            let boxes = boxes_of(&tiles, 100, cap, &options, memory_bytes);
            let mut all = boxes.concat();
            all.sort_unstable();
            assert_eq!(all, tiles);
            counts.push(boxes.len());
            for tiles in boxes.iter().filter(|tiles| tiles.len() > 1) {
                let bounds = TileBox::of(tiles.iter().copied()).unwrap();
                let (low, high) = (bounds.min().to_array(), bounds.max().to_array());
                let size = [0, 1, 2].map(|k| 100 * (high[k] - low[k] + 1) as usize);
                assert!(Solver::bytes_of(size, cap, &options) <= memory_bytes);
            }
        }
        assert!(counts[0] == tiles.len() && counts[1] < counts[0] / 2 && counts[2] < counts[1], "{counts:?}");
        assert!(boxes_of(&[], 100, cap, &options, 0).is_empty());
    }
}

//! Detects maps that are regions of one build.

use crate::error::Result;
use crate::mapper::{MapReader, MapView};
use crate::space::{Grid, LAST_VOXEL_INDEX, TileBox};
use crate::store::{Extension, InputContent, ScanRecord};
use rustc_hash::FxHashMap;

/// Build that maps are regions of, with the united region; `None` for all of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OneBuild {
    pub(super) region: Option<TileBox>,
}

impl OneBuild {
    /// Returns the build that these maps are regions of, if there is one: the same scans of the same inputs with the
    /// same settings, in disjoint boxes of tiles that together form a box.
    ///
    /// # Errors
    ///
    /// A damaged or unreadable list of scans.
    pub(super) fn of(maps: &[MapReader]) -> Result<Option<Self>> {
        let Some(first) = maps.first() else { return Ok(None) };
        let mut regions = Regions::of(first)?;
        maps.iter().try_for_each(|map| regions.add(map))?;
        Ok(regions.one_build())
    }
}

/// Collector of the regions of maps, for [`OneBuild`].
#[derive(Debug)]
pub(super) struct Regions {
    /// Metadata of the first map, and its list of scans. `None` after a map that is not from the same build.
    scans: Option<(Extension, Vec<ScanRecord>)>,
    /// Number of points of the kept scans.
    points: FxHashMap<u64, u64>,
    grid: Grid,
    regions: Vec<TileBox>,
}

impl Regions {
    /// Starts without regions. Maps of the same build as `first` can be added, including `first`.
    ///
    /// # Errors
    ///
    /// A damaged or unreadable list of scans.
    pub(super) fn of(first: &MapReader) -> Result<Self> {
        let scans = first.metadata().ext.clone().filter(|ext| !ext.inputs.is_empty() && are_known(ext));
        let scans = match scans {
            Some(ext) => Some((ext, first.scans()?)),
            None => None,
        };
        Ok(Self { scans, points: FxHashMap::default(), grid: first.config().grid, regions: Vec::new() })
    }

    /// # Errors
    ///
    /// As for [`Regions::of`].
    pub(super) fn add(&mut self, map: &MapReader) -> Result<()> {
        let Some((ext, list)) = &self.scans else { return Ok(()) };
        let are_same = map.metadata().ext.as_ref().is_some_and(|other| are_same_scans(other, ext));
        // The scans of the inputs may be the same, but the lists still differ if scans were removed from one of the
        // maps.
        match own_region(map).filter(|_| are_same) {
            Some(region) if map.scans()? == *list && self.has_same_points(map)? => self.regions.push(region),
            _ => self.scans = None,
        }
        Ok(())
    }

    /// Returns whether the kept scans of a map have as many points as in the maps before, and no moving points: nothing
    /// was removed or marked after the build.
    fn has_same_points(&mut self, map: &MapReader) -> Result<bool> {
        if !map.keeps_scans() {
            return Ok(true);
        }
        let mut scans = map.kept_scans()?;
        while let Some(record) = scans.next_record()? {
            let before = self.points.insert(record.number, record.points);
            if record.moving.is_some() || before.is_some_and(|points| points != record.points) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    pub(super) fn one_build(self) -> Option<OneBuild> {
        self.scans?;
        let region = united(&self.regions)?;
        Some(OneBuild { region: (!is_all_of_space(region, &self.grid)).then_some(region) })
    }
}

/// Returns the region of a map, if all its tiles are in it.
fn own_region(map: &MapReader) -> Option<TileBox> {
    let region = map.config().rays.region?;
    map.tile_indices().into_iter().all(|tile| region.contains(tile)).then_some(region)
}

/// Returns whether the inputs and poses of all scans are known. False after a remap.
fn are_known(scans: &Extension) -> bool {
    let is_known = |content: &InputContent| !content.pose_chain.is_empty();
    scans.inputs.iter().all(|input| input.content.as_ref().is_some_and(is_known))
}

fn are_same_scans(a: &Extension, b: &Extension) -> bool {
    let rays = |ext: &Extension| crate::config::RayConfig { region: None, ..ext.rays };
    let inputs = |ext: &Extension| ext.inputs.clone().into_iter().map(|input| input.with_region(None));
    rays(a) == rays(b)
        && inputs(a).eq(inputs(b))
        && a.scan_number == b.scan_number
        && a.decayed_scan == b.decayed_scan
        && a.sensor_model == b.sensor_model
        && a.occupancy_threshold == b.occupancy_threshold
        && a.crs == b.crs
}

/// Returns the box that these boxes form together, if they are disjoint and form one.
fn united(regions: &[TileBox]) -> Option<TileBox> {
    let are_apart =
        regions.iter().enumerate().all(|(k, a)| regions[..k].iter().all(|b| a.intersection(*b).is_none()));
    let hull = regions.iter().copied().reduce(TileBox::union)?;
    let tiles = |region: TileBox| {
        let (min, max) = (region.min().to_array(), region.max().to_array());
        (0..3).map(|k| u128::from(min[k].abs_diff(max[k])) + 1).product::<u128>()
    };
    // Disjoint boxes fill their bounding box if the numbers of tiles are equal.
    (are_apart && regions.iter().map(|region| tiles(*region)).sum::<u128>() == tiles(hull)).then_some(hull)
}

fn is_all_of_space(region: TileBox, grid: &Grid) -> bool {
    region.contains(grid.tile_of_voxel([i32::MIN; 3]))
        && region.contains(grid.tile_of_voxel([LAST_VOXEL_INDEX; 3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disjoint_boxes_that_fill_a_box_are_united() {
        let tiles = |min: [i32; 3], max: [i32; 3]| TileBox::new(min.into(), max.into());
        let (low, high) = (i32::MIN, i32::MAX - 1);
        let west = tiles([low; 3], [-1, high, high]);
        let east = tiles([0, low, low], [high; 3]);
        let all = united(&[east, west]).unwrap();
        let grid = Grid::new(0.1, 10.0).unwrap();
        assert!(is_all_of_space(all, &grid) && !is_all_of_space(east, &grid));
        let (a, b) = (tiles([0; 3], [1, 0, 0]), tiles([2, 0, 0], [2, 0, 0]));
        assert_eq!(united(&[a, b]), Some(tiles([0; 3], [2, 0, 0])));
        // A duplicate box, and a hole between two boxes.
        assert_eq!(united(&[a, b, a]), None);
        assert_eq!(united(&[a, tiles([3, 0, 0], [3, 0, 0])]), None);
        assert_eq!(united(&[a, tiles([1, 0, 0], [2, 0, 0])]), None);
    }
}

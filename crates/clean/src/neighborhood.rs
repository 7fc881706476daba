use rayon::prelude::*;
use rustc_hash::FxHashMap;
use voxtile::space::VoxelIndex;

/// Largest distance of a neighbor in voxels along each axis.
pub(crate) const MAX_RADIUS: i32 = 8;

/// Voxels that a scan hits, in rows of 64 along x.
#[derive(Clone, Debug, Default)]
pub(crate) struct HitVoxels {
    rows: FxHashMap<RowIndex, Row>,
}

/// Index of a row: the voxel index along x divided by 64, and the voxel indices along y and z.
type RowIndex = [i32; 3];

#[derive(Clone, Copy, Debug, Default)]
struct Row {
    hit: u64,
    /// The hit voxels that were seen through.
    seen_through: u64,
}

fn row_of([x, y, z]: VoxelIndex) -> (RowIndex, u32) {
    ([x >> 6, y, z], (x & 63) as u32)
}

impl HitVoxels {
    pub(crate) fn insert(&mut self, voxel: VoxelIndex) {
        let (row, bit) = row_of(voxel);
        self.rows.entry(row).or_default().hit |= 1 << bit;
    }

    /// Returns the hit voxels in no particular order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = VoxelIndex> + '_ {
        self.rows.iter().flat_map(|(row, bits)| voxels_of(*row, bits.hit))
    }

    /// Returns the hit voxels that were seen through, in no particular order.
    pub(crate) fn iter_seen_through(&self) -> impl Iterator<Item = VoxelIndex> + '_ {
        self.rows.iter().flat_map(|(row, bits)| voxels_of(*row, bits.seen_through))
    }

    /// Removes a voxel that the map does not know.
    pub(crate) fn remove(&mut self, voxel: VoxelIndex) {
        let (row, bit) = row_of(voxel);
        if let Some(row) = self.rows.get_mut(&row) {
            row.hit &= !(1 << bit);
        }
    }

    /// Records that a hit voxel was seen through.
    pub(crate) fn set_seen_through(&mut self, voxel: VoxelIndex) {
        let (row, bit) = row_of(voxel);
        if let Some(row) = self.rows.get_mut(&row) {
            row.seen_through |= 1 << bit;
        }
    }

    /// Records that a hit voxel was not seen through.
    pub(crate) fn clear_seen_through(&mut self, voxel: VoxelIndex) {
        let (row, bit) = row_of(voxel);
        if let Some(row) = self.rows.get_mut(&row) {
            row.seen_through &= !(1 << bit);
        }
    }

    /// Returns the voxels whose neighborhood was seen through: of the hit voxels within `radius` voxels along each axis,
    /// itself included, at least three fifths.
    pub(crate) fn moving(&self, radius: i32) -> MovingVoxels {
        let radius = radius.clamp(0, MAX_RADIUS);
        let rows: Vec<_> = self.rows.iter().filter(|(_, row)| row.hit != 0).collect();
        let moving = rows.into_par_iter().filter_map(|(&index, row)| {
            let moving = self.moving_in(index, row, radius);
            (moving != 0).then_some((index, moving))
        });
        MovingVoxels { rows: moving.collect() }
    }

    /// Returns the bits of the moving voxels of a row.
    fn moving_in(&self, [x, y, z]: RowIndex, row: &Row, radius: i32) -> u64 {
        let mut counts = [(0_u32, 0_u32); 64];
        let window = (1_u128 << (2 * radius + 1)) - 1;
        for dz in -radius..=radius {
            for dy in -radius..=radius {
                let at = |dx: i32| {
                    let index = [x.checked_add(dx)?, y.checked_add(dy)?, z.checked_add(dz)?];
                    self.rows.get(&index).copied()
                };
                let [before, own, after] = [-1, 0, 1].map(|dx| at(dx).unwrap_or_default());
                let joined = |of: fn(&Row) -> u64| {
                    // Bit 0 is the voxel `radius` before the row.
                    let middle = u128::from(of(&own)) << radius;
                    let low = u128::from(of(&before)) >> (64 - radius as u32).min(127);
                    middle | low | u128::from(of(&after)) << (64 + radius)
                };
                let (hit, seen_through) = (joined(|row| row.hit), joined(|row| row.seen_through));
                if hit == 0 {
                    continue;
                }
                for bit in ones(row.hit) {
                    let count = &mut counts[bit as usize];
                    count.0 += (hit >> bit & window).count_ones();
                    count.1 += (seen_through >> bit & window).count_ones();
                }
            }
        }
        let is_moving = |bit: &u32| {
            let (hit, seen_through) = counts[*bit as usize];
            5 * seen_through >= 3 * hit
        };
        ones(row.hit).filter(is_moving).fold(0, |bits, bit| bits | 1 << bit)
    }
}

/// Voxels in which a scan hit something that moved.
#[derive(Clone, Debug, Default)]
pub(crate) struct MovingVoxels {
    rows: FxHashMap<RowIndex, u64>,
}

impl MovingVoxels {
    pub(crate) fn contains(&self, voxel: VoxelIndex) -> bool {
        let (row, bit) = row_of(voxel);
        self.rows.get(&row).is_some_and(|bits| bits >> bit & 1 == 1)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

/// Returns the voxels of the bits of a row.
fn voxels_of([x, y, z]: RowIndex, bits: u64) -> impl Iterator<Item = VoxelIndex> {
    ones(bits).map(move |bit| [(x << 6) + bit as i32, y, z])
}

fn ones(mut bits: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (bit < 64).then_some(bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn neighborhoods_equal_naive_counts(
            hits in prop::collection::btree_map(
                (-70..70_i32, -4..4_i32, -3..3_i32).prop_map(|(x, y, z)| [x, y, z]), any::<bool>(), 0..400),
            radius in 0..=MAX_RADIUS,
            offset in prop::sample::select(vec![0, 1000, i32::MAX - 70, i32::MIN + 70]),
        ) {
            let hits: BTreeMap<VoxelIndex, bool> =
                hits.into_iter().map(|([x, y, z], seen)| ([x + offset, y, z], seen)).collect();
            let mut voxels = HitVoxels::default();
            for (&voxel, &seen_through) in &hits {
                voxels.insert(voxel);
                if seen_through {
                    voxels.set_seen_through(voxel);
                }
            }
            let mut found: Vec<_> = voxels.iter().collect();
            found.sort_unstable();
            prop_assert!(found.iter().eq(hits.keys()));
            let moving = voxels.moving(radius);
            for &voxel in hits.keys() {
                let near = hits.iter().filter(|(other, _)| {
                    (0..3).all(|k| i64::from(other[k]).abs_diff(i64::from(voxel[k])) <= radius as u64)
                });
                let (all, seen) = near.fold((0, 0), |(all, seen), (_, is)| (all + 1, seen + u32::from(*is)));
                prop_assert_eq!(moving.contains(voxel), 5 * seen >= 3 * all, "{:?}", voxel);
            }
        }
    }
}

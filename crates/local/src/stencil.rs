use super::place::{cell_at, place_of};
use voxtile::space::VoxelIndex;

/// The voxels that an occupied voxel inflates: a ball of voxel centers, as masks of blocks of 4 x 4 x 4.
///
/// All voxels share one stencil; it replaces the paper's look-up table per voxel.
#[derive(Clone, Debug)]
pub(super) struct Stencil {
    radius_m: f64,
    /// Number of blocks by which the stencil extends beyond the voxel's own block, to each side of each axis.
    pub(super) reach: i32,
    /// For each position of the voxel in its block: the affected blocks, numbered by [`Stencil::number_of`], and the
    /// masks of their voxels.
    parts: Vec<Vec<(u32, u64)>>,
    /// Offsets of the blocks, by number, from the voxel's own block.
    offsets: Vec<VoxelIndex>,
}

impl Stencil {
    /// Creates the ball of a radius in metres for voxels of `resolution_m`: all offsets `d` in voxels with `|d| <=
    /// radius / resolution`, with a relative tolerance of 1e-9.
    pub(super) fn new(radius_m: f64, resolution_m: f64) -> Self {
        let radius = radius_m / resolution_m * (1.0 + 1e-9);
        let r = radius.floor() as i32;
        let reach = (r + 3) / 4;
        let mut stencil = Self { radius_m, reach, parts: vec![Vec::new(); 64], offsets: offsets(reach) };
        let mut masks = vec![0_u64; stencil.blocks()];
        for place in 0..64 {
            let from = cell_at([0; 3], place);
            for offset in ball(radius) {
                let voxel: VoxelIndex = std::array::from_fn(|k| from[k] + offset[k]);
                masks[stencil.number_of(voxel.map(|k| k >> 2))] |= 1 << place_of(voxel);
            }
            let part = masks.iter().enumerate().filter(|(_, mask)| **mask != 0);
            stencil.parts[place] = part.map(|(number, mask)| (number as u32, *mask)).collect();
            masks.fill(0);
        }
        stencil
    }

    pub(super) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Returns the number of blocks in the cube around the stencil.
    pub(super) fn blocks(&self) -> usize {
        self.offsets.len()
    }

    /// Returns the blocks with voxels that the voxel at a position of its block inflates, and the masks of these
    /// voxels.
    #[inline]
    pub(super) fn of_place(&self, place: usize) -> &[(u32, u64)] {
        &self.parts[place]
    }

    /// Returns the number of a block, given by its offset from the voxel's own block.
    fn number_of(&self, offset: VoxelIndex) -> usize {
        let [x, y, z] = offset.map(|k| k + self.reach);
        ((x * (2 * self.reach + 1) + y) * (2 * self.reach + 1) + z) as usize
    }

    /// Returns the offset of a block from the voxel's own block.
    #[inline]
    pub(super) fn offset_of(&self, number: u32) -> VoxelIndex {
        self.offsets[number as usize]
    }
}

/// Returns the offsets up to `reach` along each axis, in the order of [`Stencil::number_of`].
fn offsets(reach: i32) -> Vec<VoxelIndex> {
    let along = move || -reach..=reach;
    along().flat_map(|x| along().flat_map(move |y| along().map(move |z| [x, y, z]))).collect()
}

/// Returns all offsets of at most this length in voxels.
fn ball(radius: f64) -> impl Iterator<Item = VoxelIndex> {
    let r = radius.floor() as i32;
    let along = move || -r..=r;
    let cube = along().flat_map(move |x| along().flat_map(move |y| along().map(move |z| [x, y, z])));
    cube.filter(move |d| f64::from(d.iter().map(|k| k * k).sum::<i32>()) <= radius * radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_have_the_expected_number_of_voxels() {
        // 0.3 m, for example, is slightly less than three voxels of 0.1 m in `f64`, but must give three voxels.
        let sizes = [(0.0, 1), (0.1, 7), (0.2, 33), (0.3, 123), (0.25, 81), (0.4, 257), (2.4, 57_777)];
        for (radius_m, size) in sizes {
            let stencil = Stencil::new(radius_m, 0.1);
            for place in [0, 21, 63] {
                let voxels: u32 = stencil.of_place(place).iter().map(|(_, mask)| mask.count_ones()).sum();
                assert_eq!(voxels, size, "{radius_m} m");
            }
        }
    }
}

use super::place::{cell_at, place_of};
use voxtile::space::VoxelIndex;

/// The voxels that an occupied voxel inflates: a ball on voxel centers, as masks of blocks of 4 x 4 x 4.
///
/// One for all voxels; it replaces the paper's look-up table in every voxel.
#[derive(Clone, Debug)]
pub(super) struct Stencil {
    radius_m: f64,
    /// How many blocks it extends beyond the voxel's own, along each axis and to both sides.
    pub(super) reach: i32,
    /// For each place of the voxel in its block: the blocks, numbered by [`Stencil::number_of`], and their voxels.
    parts: Vec<Vec<(u32, u64)>>,
    /// The blocks by number, relative to the voxel's own.
    offsets: Vec<VoxelIndex>,
}

impl Stencil {
    /// The ball of a radius in metres, for voxels of `resolution_m`: all offsets `d` in voxels with
    /// `|d| <= radius / resolution`, where a relative error of 1e-9 does not matter.
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

    /// Blocks in the cube around the stencil.
    pub(super) fn blocks(&self) -> usize {
        self.offsets.len()
    }

    /// The blocks, and their voxels, that the voxel at a place of its block inflates.
    #[inline]
    pub(super) fn of_place(&self, place: usize) -> &[(u32, u64)] {
        &self.parts[place]
    }

    /// The number of a block, given relative to the voxel's own.
    fn number_of(&self, offset: VoxelIndex) -> usize {
        let [x, y, z] = offset.map(|k| k + self.reach);
        ((x * (2 * self.reach + 1) + y) * (2 * self.reach + 1) + z) as usize
    }

    /// The block with a number, relative to the voxel's own.
    #[inline]
    pub(super) fn offset_of(&self, number: u32) -> VoxelIndex {
        self.offsets[number as usize]
    }
}

/// The blocks up to `reach` away along each axis, in the order of [`Stencil::number_of`].
fn offsets(reach: i32) -> Vec<VoxelIndex> {
    let along = move || -reach..=reach;
    along().flat_map(|x| along().flat_map(move |y| along().map(move |z| [x, y, z]))).collect()
}

/// All offsets of at most a length in voxels.
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
    fn balls_have_as_many_voxels_as_they_should() {
        // 0.3 m is slightly less than three voxels of 0.1 m in f64.
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

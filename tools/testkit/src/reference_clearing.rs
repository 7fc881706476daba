use std::collections::BTreeSet;
use voxtile::Guard;
use voxtile::space::VoxelIndex;

/// Hit and missed voxels of one scan, for a naive implementation of guarded clearing.
pub struct ScanMarks {
    pub hit: BTreeSet<VoxelIndex>,
    /// Voxels that rays pass through and that no ray hits.
    pub missed: BTreeSet<VoxelIndex>,
    /// Voxel that contains the sensor.
    pub origin: VoxelIndex,
}

const FACES: [VoxelIndex; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

fn sum(a: VoxelIndex, b: VoxelIndex) -> VoxelIndex {
    std::array::from_fn(|k| a[k] + b[k])
}

/// All voxels from `first` on, `edge` along each axis.
fn cube(first: VoxelIndex, edge: i32) -> impl Iterator<Item = VoxelIndex> {
    (0..edge.pow(3)).map(move |k| sum(first, [k % edge, k / edge % edge, k / edge / edge]))
}

impl ScanMarks {
    /// Returns whether the miss of a missed voxel counts in full by the rule of [`Guard`].
    pub fn is_full(&self, voxel: VoxelIndex, guard: Guard) -> bool {
        self.is_open(voxel)
            || [2, 4].iter().any(|&edge| {
                let cell = voxel.map(|k| k.div_euclid(edge));
                self.is_clear(cell, edge) && FACES.iter().all(|&face| self.is_clear(sum(cell, face), edge))
            })
            || self.is_apart(voxel.map(|k| k.div_euclid(2)), guard)
    }

    fn is_open(&self, voxel: VoxelIndex) -> bool {
        FACES.iter().all(|&face| self.missed.contains(&sum(voxel, face)))
            && cube(sum(voxel, [-1; 3]), 3).all(|near| !self.hit.contains(&near))
    }

    /// Returns whether a cell with this edge in voxels has a miss and no hit.
    fn is_clear(&self, cell: VoxelIndex, edge: i32) -> bool {
        let voxels = || cube(cell.map(|k| k * edge), edge);
        voxels().any(|voxel| self.missed.contains(&voxel)) && !self.has_hit(cell, edge)
    }

    fn has_hit(&self, cell: VoxelIndex, edge: i32) -> bool {
        cube(cell.map(|k| k * edge), edge).any(|voxel| self.hit.contains(&voxel))
    }

    /// Returns whether a cell of 2 voxels is clear and far from hits, and is above a clear cell or in front of a hit.
    fn is_apart(&self, cell: VoxelIndex, guard: Guard) -> bool {
        // From the center of the sensor's voxel to the center of the cell, in half voxels.
        let way: [i64; 3] = [0, 1, 2].map(|k| 4 * i64::from(cell[k]) + 2 - 2 * i64::from(self.origin[k]) - 1);
        let longest = way.map(i64::abs).into_iter().max().unwrap();
        self.is_clear(cell, 2)
            && cube(sum(cell, [-1; 3]), 3).all(|near| !self.has_hit(near, 2))
            && (self.is_clear(sum(cell, [0, 0, -1]), 2)
                || (2..=i64::from(guard.approach_voxels) / 2).any(|step| {
                    // The quotient, rounded to the nearest integer, halves away from zero.
                    let offset = way.map(|x| {
                        let nearest = (2 * step * x.abs() + longest) / (2 * longest);
                        (nearest * x.signum()) as i32
                    });
                    self.has_hit(sum(cell, offset), 2)
                }))
    }
}

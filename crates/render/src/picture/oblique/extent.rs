use super::super::collect::first_beyond;
use super::camera::Camera;
use std::sync::atomic::{AtomicU64, Ordering};
use voxtile::space::{VoxelBox, VoxelIndex};

/// Distribution of the occupied voxels along the directions of the image and of the map, counted by any number of threads.
pub struct Extent {
    camera: Camera,
    base: VoxelIndex,
    /// Lowest and highest position in voxels: right, up, near, x, y, z.
    limits: [[f64; 2]; AXES],
    counts: Vec<AtomicU64>,
}

const AXES: usize = 6;
/// Bins along an axis.
const BINS: usize = 4096;

impl Extent {
    /// Returns the empty distribution of a box of voxels.
    pub fn new(camera: Camera, voxels: &VoxelBox) -> Self {
        let base = voxels.min;
        let end: [f64; 3] = std::array::from_fn(|k| (i64::from(voxels.end[k]) - i64::from(base[k])) as f64);
        let corners = (0..8).map(|corner| {
            camera.project(std::array::from_fn(|k| if corner >> k & 1 == 1 { end[k] } else { 0.0 }))
        });
        let mut limits = [[f64::MAX, f64::MIN]; AXES];
        for at in corners {
            for k in 0..3 {
                limits[k] = [limits[k][0].min(at[k]), limits[k][1].max(at[k])];
            }
        }
        for k in 0..3 {
            limits[3 + k] = [0.0, end[k]];
        }
        let counts = (0..AXES * BINS).map(|_| AtomicU64::new(0)).collect();
        Self { camera, base, limits, counts }
    }

    /// Counts a voxel.
    #[inline]
    pub fn add(&self, voxel: VoxelIndex) {
        let middle = Camera::middle(self.base, voxel);
        let [right, up, near] = self.camera.project(middle);
        let [x, y, z] = middle;
        for (axis, at) in [right, up, near, x, y, z].into_iter().enumerate() {
            let [low, high] = self.limits[axis];
            let bin = ((at - low) / (high - low).max(1.0) * BINS as f64) as usize;
            self.counts[axis * BINS + bin.min(BINS - 1)].fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Returns the lowest and the highest possible nearness of a voxel, in voxels.
    pub fn depth(&self) -> [f64; 2] {
        self.limits[2]
    }

    /// Returns the bounds of all voxels but a share at either end; `None` if there are none.
    pub fn bounds(&self, outside: f64) -> Option<Bounds> {
        let mut bounds = [[0.0; 2]; AXES];
        for (axis, bounds) in bounds.iter_mut().enumerate() {
            let counts: Vec<u64> = self.counts[axis * BINS..][..BINS]
                .iter()
                .map(|count| count.load(Ordering::Relaxed))
                .collect();
            let few = (counts.iter().sum::<u64>() as f64 * outside) as u64;
            let [low, high] = self.limits[axis];
            let border = |bin: usize| low + bin as f64 / BINS as f64 * (high - low).max(1.0);
            let last = BINS - first_beyond(counts.iter().rev(), few)?;
            *bounds = [border(first_beyond(counts.iter(), few)?), border(last)];
        }
        let [right, up, _, x, y, z] = bounds;
        Some(Bounds { image: [right, up], map: [x, y, z] })
    }
}

/// Bounds of voxels, in voxels from the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// To the right and up in the image.
    pub image: [[f64; 2]; 2],
    /// Along x, y and z.
    pub map: [[f64; 2]; 3],
}

impl Bounds {
    /// Returns the bounds with a position, in voxels to the right and up in the image.
    pub fn with(mut self, at: [f64; 2]) -> Self {
        for (bounds, at) in self.image.iter_mut().zip(at) {
            *bounds = [bounds[0].min(at), bounds[1].max(at)];
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_are_excluded_on_request() {
        let voxels = VoxelBox { min: [-100, 0, 0], end: [900, 100, 50] };
        let extent = Extent::new(Camera::new(-90.0, 90.0), &voxels);
        assert_eq!(extent.bounds(0.0), None);
        for x in 0..100 {
            for y in 0..10 {
                extent.add([x, y, 5]);
            }
        }
        extent.add([800, 90, 40]);
        let is_near = |found: [f64; 2], wanted: [f64; 2]| (0..2).all(|k| (found[k] - wanted[k]).abs() <= 1.0);
        let all = extent.bounds(0.0).unwrap();
        assert!(is_near(all.image[0], [100.0, 901.0]) && is_near(all.map[2], [5.0, 41.0]), "{all:?}");
        let most = extent.bounds(0.002).unwrap();
        assert!(is_near(most.image[0], [100.0, 200.0]) && is_near(most.map[1], [0.0, 10.0]), "{most:?}");
        let wider = most.with([150.0, 999.0]);
        assert_eq!(wider.image, [most.image[0], [most.image[1][0], 999.0]]);
    }
}

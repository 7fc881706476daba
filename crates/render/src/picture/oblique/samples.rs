use super::camera::Camera;
use std::sync::atomic::{AtomicU64, Ordering};
use voxtile::space::VoxelIndex;

/// Position of the image in the map. Positions in samples count from the upper left corner, right and down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    pub camera: Camera,
    /// Positions in voxels count from this voxel's lower corner.
    pub base: VoxelIndex,
    /// Left and upper border of the image, in voxels to the right and up.
    pub corner: [f64; 2],
    /// Samples per voxel.
    pub scale: f64,
    /// Width and height in samples.
    pub size: [usize; 2],
    /// Lowest and highest nearness in voxels.
    pub depth: [f64; 2],
    /// Width of the dark rims of cubes in voxels; 0 if there are none.
    pub rim: f64,
}

/// The nearest occupied voxel of each sample of an image, written by any number of threads. The order of writes does not
/// matter: the nearest surface counts, then the face and the value of the highest number.
pub struct Samples {
    pub frame: Frame,
    /// Nearness in 29 bits, 0 for none; surface in 3, value in 32.
    words: Vec<AtomicU64>,
}

/// A visible surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Surface {
    /// Axis of the visible face; 3 for voxels that are smaller than the distance of samples.
    pub face: u8,
    pub is_rim: bool,
}

/// Content of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Nearness in samples.
    pub near: f64,
    pub surface: Surface,
    /// Code of the value.
    pub code: u32,
}

const DEPTH_BITS: u32 = 29;
const MAX_DEPTH: u64 = (1 << DEPTH_BITS) - 1;
/// Face of small voxels.
const NO_FACE: u8 = 3;

impl Frame {
    /// Returns the position of a point in samples, and its nearness in samples; the point is in voxels from the base.
    pub fn position_of(&self, point: [f64; 3]) -> [f64; 3] {
        let [right, up, near] = self.camera.project(point);
        [(right - self.corner[0]) * self.scale, (self.corner[1] - up) * self.scale, near * self.scale]
    }

    fn depth_code(&self, near: f64) -> u64 {
        let [low, high] = self.depth;
        let share = (near - low) / (high - low);
        1 + (share.clamp(0.0, 1.0) * (MAX_DEPTH - 1) as f64).round() as u64
    }

    fn nearness(&self, code: u64) -> f64 {
        let [low, high] = self.depth;
        (low + (code - 1) as f64 / (MAX_DEPTH - 1) as f64 * (high - low)) * self.scale
    }
}

impl Samples {
    pub fn new(frame: Frame) -> Self {
        let mut words = Vec::new();
        words.resize_with(frame.size[0] * frame.size[1], Default::default);
        Self { frame, words }
    }

    /// Draws a voxel: the faces of its cube at the samples that it covers, or one sample if it covers none. `code` is
    /// called only for a voxel in the image.
    pub fn add(&self, voxel: VoxelIndex, code: impl FnOnce() -> u32) {
        let Frame { camera, base, scale, size, .. } = &self.frame;
        let middle = Camera::middle(*base, voxel);
        let [x, y, near] = self.frame.position_of(middle);
        let near = near / scale;
        let half = camera.half_voxel();
        // The samples whose middle is within the bounds of the cube.
        let range = |at: f64, half: f64, size: usize| {
            let first = (at - half - 0.5).ceil().max(0.0);
            let end = (at + half - 0.5).floor() + 1.0;
            (first < size as f64 && end > 0.0).then(|| first as usize..(end as usize).min(size))
        };
        let (Some(across), Some(down)) =
            (range(x, half[0] * scale, size[0]), range(y, half[1] * scale, size[1]))
        else {
            return self.add_small([x, y], near, code);
        };
        let (code, mut is_hit) = (u64::from(code()), false);
        for row in down {
            let up = (y - row as f64 - 0.5) / scale;
            for column in across.clone() {
                let right = (column as f64 + 0.5 - x) / scale;
                let Some((surface, depth)) = self.frame.hit(right, up) else { continue };
                is_hit = true;
                self.put(column + row * size[0], near + depth, surface, code);
            }
        }
        if !is_hit {
            self.add_small([x, y], near, || code as u32);
        }
    }

    /// Draws a voxel that covers the middle of no sample.
    fn add_small(&self, at: [f64; 2], near: f64, code: impl FnOnce() -> u32) {
        let size = self.frame.size;
        if (0..2).all(|k| at[k] >= 0.0 && at[k] < size[k] as f64) {
            let place = at[0] as usize + at[1] as usize * size[0];
            let surface = Surface { face: NO_FACE, is_rim: false };
            self.put(place, near + self.frame.camera.half_voxel()[2], surface, u64::from(code()));
        }
    }

    #[inline]
    fn put(&self, place: usize, near: f64, surface: Surface, code: u64) {
        let surface = u64::from(surface.face) << 1 | u64::from(surface.is_rim);
        let word = self.frame.depth_code(near) << 35 | surface << 32 | code;
        // Most surfaces are hidden, so read before writing.
        if let Some(found) = self.words.get(place)
            && found.load(Ordering::Relaxed) < word
        {
            found.fetch_max(word, Ordering::Relaxed);
        }
    }

    /// Returns a sample; `None` without an occupied voxel, or outside.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> Option<Sample> {
        if x >= self.frame.size[0] {
            return None;
        }
        let word = self.words.get(x + y * self.frame.size[0])?.load(Ordering::Relaxed);
        let depth = word >> 35;
        (depth > 0).then(|| Sample {
            near: self.frame.nearness(depth),
            surface: Surface { face: (word >> 33 & 3) as u8, is_rim: word >> 32 & 1 == 1 },
            code: word as u32,
        })
    }

    /// Returns all samples with a voxel.
    pub fn iter(&self) -> impl Iterator<Item = Sample> {
        let [width, height] = self.frame.size;
        (0..height).flat_map(move |y| (0..width).filter_map(move |x| self.at(x, y)))
    }
}

impl Frame {
    /// Returns the face of a cube that the viewer sees at an offset from the cube's middle, and how far it is in front
    /// of the middle. `None` if the cube does not cover this place. All lengths are in voxels.
    #[inline]
    fn hit(&self, right: f64, up: f64) -> Option<(Surface, f64)> {
        let camera = &self.camera;
        let offset: [f64; 3] = std::array::from_fn(|k| right * camera.right[k] + up * camera.up[k]);
        let (mut exit, mut entry, mut face) = (f64::INFINITY, f64::NEG_INFINITY, 0);
        for (k, (offset, near)) in offset.into_iter().zip(camera.near).enumerate() {
            if near == 0.0 {
                if offset.abs() > 0.5 {
                    return None;
                }
                continue;
            }
            let sides = [(-0.5 - offset) / near, (0.5 - offset) / near];
            entry = entry.max(sides[0].min(sides[1]));
            if sides[0].max(sides[1]) < exit {
                (exit, face) = (sides[0].max(sides[1]), k as u8);
            }
        }
        if entry > exit {
            return None;
        }
        let is_rim = self.rim > 0.0
            && (0..3).any(|k| {
                k != usize::from(face) && (offset[k] + exit * camera.near[k]).abs() > 0.5 - self.rim
            });
        Some((Surface { face, is_rim }, exit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustc_hash::FxHashSet;

    fn frame(azimuth_deg: f64, elevation_deg: f64, scale: f64) -> Frame {
        let camera = Camera::new(azimuth_deg, elevation_deg);
        Frame {
            camera,
            base: [0; 3],
            corner: [-20.0, 20.0],
            scale,
            size: [(40.0 * scale) as usize; 2],
            depth: [-40.0, 40.0],
            rim: 0.0,
        }
    }

    /// Returns voxels of a scene without order.
    fn scene() -> Vec<VoxelIndex> {
        (0..400_i32).map(|k| [k * 7 % 11, k * 5 % 13, k * 3 % 7]).chain([[-15, 3, 2], [2, -15, 9]]).collect()
    }

    /// Walks along the line of sight of a sample and returns the first voxel. A naive model.
    fn first_voxel(frame: &Frame, voxels: &FxHashSet<VoxelIndex>, [x, y]: [usize; 2]) -> Option<VoxelIndex> {
        let right = (x as f64 + 0.5) / frame.scale + frame.corner[0];
        let up = frame.corner[1] - (y as f64 + 0.5) / frame.scale;
        let camera = &frame.camera;
        (0..5_000).map(|step| 25.0 - f64::from(step) * 0.01).find_map(|near| {
            let voxel = std::array::from_fn(|k| {
                (right * camera.right[k] + up * camera.up[k] + near * camera.near[k]).floor() as i32
            });
            voxels.contains(&voxel).then_some(voxel)
        })
    }

    #[test]
    fn each_sample_has_the_first_voxel_of_its_line_of_sight() {
        let voxels = scene();
        let set: FxHashSet<VoxelIndex> = voxels.iter().copied().collect();
        for (azimuth, elevation) in [(-60.0, 40.0), (33.0, 8.0), (-90.0, 0.0), (140.0, 90.0)] {
            let samples = Samples::new(frame(azimuth, elevation, 1.7));
            for (number, voxel) in voxels.iter().enumerate() {
                samples.add(*voxel, || number as u32);
            }
            let (mut same, mut all) = (0, 0);
            for y in (0..samples.frame.size[1]).step_by(2) {
                for x in (0..samples.frame.size[0]).step_by(2) {
                    let found = samples.at(x, y).map(|sample| voxels[sample.code as usize]);
                    let wanted = first_voxel(&samples.frame, &set, [x, y]);
                    // A line may pass so close to an edge that the walk misses the voxel.
                    same += u32::from(found == wanted);
                    all += 1;
                }
            }
            assert!(same * 100 >= all * 99, "{same} of {all} from {azimuth}, {elevation}");
        }
    }

    #[test]
    fn the_order_of_voxels_does_not_matter() {
        let voxels = scene();
        let drawn = |order: Vec<usize>| {
            let samples = Samples::new(frame(-60.0, 40.0, 0.8));
            order.iter().for_each(|&number| samples.add(voxels[number], || number as u32));
            samples.iter().collect::<Vec<_>>()
        };
        let forth: Vec<usize> = (0..voxels.len()).collect();
        let back: Vec<usize> = forth.iter().rev().copied().collect();
        assert_eq!(drawn(forth), drawn(back));
    }

    #[test]
    fn no_voxel_is_too_small_to_be_seen() {
        for scale in [0.05, 0.1, 0.5] {
            let samples = Samples::new(frame(-60.0, 40.0, scale));
            samples.add([3, 4, 5], || 7);
            let found: Vec<Sample> = samples.iter().collect();
            assert!(!found.is_empty() && found.iter().all(|sample| sample.code == 7));
        }
        let samples = Samples::new(frame(-60.0, 40.0, 1.0));
        for voxel in [[i32::MIN; 3], [i32::MAX; 3], [1_000_000, 0, 0]] {
            samples.add(voxel, || 1);
        }
        assert_eq!(samples.iter().count(), 0);
    }

    #[test]
    fn a_cube_shows_three_faces_with_rims() {
        let samples = Samples::new(Frame { rim: 0.1, ..frame(-45.0, 35.0, 30.0) });
        samples.add([0; 3], || 0);
        for face in 0..3 {
            let of_face: Vec<Sample> = samples.iter().filter(|sample| sample.surface.face == face).collect();
            let rims = of_face.iter().filter(|sample| sample.surface.is_rim).count();
            // 0.36 of a face is less than 0.1 from its border.
            let share = rims as f64 / of_face.len() as f64;
            assert!(of_face.len() > 200 && (share - 0.36).abs() < 0.05, "{face}: {share}");
        }
        let area = samples.iter().count() as f64 / 900.0;
        let camera = samples.frame.camera;
        // The faces of a cube, foreshortened.
        assert!((area - camera.near.iter().map(|k| k.abs()).sum::<f64>()).abs() < 0.02, "{area}");
    }
}

use super::super::options::Picture;
use super::camera::Camera;
use super::extent::Bounds;
use super::samples::Frame;
use voxtile::space::VoxelIndex;

/// Size of an image and its place in the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    pub frame: Frame,
    /// Width and height in pixels.
    pub size_px: [usize; 2],
    /// Samples along the edge of a pixel.
    pub samples_per_px: usize,
}

/// Space around the voxels as a share of the longer edge.
const MARGIN: f64 = 0.03;
/// Maximum size of a voxel in pixels.
const LARGEST_ZOOM: f64 = 48.0;
/// Maximum number of samples with four per pixel: 270 MB. Larger images have one sample per pixel.
const MAX_SAMPLES: usize = 1 << 25;
/// Cubes of this many pixels have rims, of this width.
const MIN_RIM_ZOOM: f64 = 6.0;
const RIM_PX: f64 = 0.6;

impl Plan {
    /// Returns the plan of an image of voxels in these bounds.
    pub fn of(picture: &Picture, camera: Camera, base: VoxelIndex, bounds: &Bounds, depth: [f64; 2]) -> Self {
        let half = camera.half_voxel();
        let mut box_of_image: [[f64; 2]; 2] =
            std::array::from_fn(|k| [bounds.image[k][0] - half[k], bounds.image[k][1] + half[k]]);
        let longest = box_of_image.iter().map(|[low, high]| high - low).fold(1.0, f64::max);
        for [low, high] in &mut box_of_image {
            *low -= MARGIN * longest;
            *high += MARGIN * longest;
        }
        let [width, height] = box_of_image.map(|[low, high]| high - low);
        let [most_across, most_down] = picture.most_px.map(|px| px as f64);
        let zoom = (most_across / width).min(most_down / height).min(LARGEST_ZOOM);
        let size_px: [usize; 2] = std::array::from_fn(|k| {
            (([width, height][k] * zoom).floor() as usize).clamp(1, picture.most_px[k].max(1))
        });
        let samples_per_px = if 4 * size_px[0] * size_px[1] <= MAX_SAMPLES { 2 } else { 1 };
        let frame = Frame {
            camera,
            base,
            corner: [box_of_image[0][0], box_of_image[1][1]],
            scale: zoom * samples_per_px as f64,
            size: size_px.map(|px| px * samples_per_px),
            depth: [depth[0] - 1.0, depth[1] + 1.0],
            rim: if zoom >= MIN_RIM_ZOOM { RIM_PX / zoom } else { 0.0 },
        };
        Self { frame, size_px, samples_per_px }
    }

    /// Returns the size of a voxel in pixels.
    pub fn zoom(&self) -> f64 {
        self.frame.scale / self.samples_per_px as f64
    }

    /// Returns the position of a point in pixels and its nearness in samples; the point is in voxels from the base.
    pub fn position_px(&self, point: [f64; 3]) -> ([f64; 2], f64) {
        let [x, y, near] = self.frame.position_of(point);
        ([x, y].map(|k| k / self.samples_per_px as f64), near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_fit_their_size() {
        let camera = Camera::new(-60.0, 40.0);
        let of = |size: [usize; 2], edge: f64| {
            let bounds = Bounds { image: [[0.0, edge], [-3.0, edge]], map: [[0.0, edge]; 3] };
            Plan::of(&Picture::new().with_size_px(size), camera, [0; 3], &bounds, [0.0, edge])
        };
        for size in [[1, 1], [300, 200], [2048, 2048]] {
            for edge in [0.0, 10.0, 1e5, 4e9] {
                let plan = of(size, edge);
                assert!((0..2).all(|k| plan.size_px[k] >= 1 && plan.size_px[k] <= size[k]), "{plan:?}");
                assert!(plan.zoom() <= LARGEST_ZOOM);
            }
        }
        assert_eq!((of([2048; 2], 1e4).samples_per_px, of([8192; 2], 1e4).samples_per_px), (2, 1));
        // The bounds are inside, with a margin.
        let plan = of([2000; 2], 1000.0);
        assert!(plan.frame.corner[0] < -20.0 && plan.frame.corner[1] > 1020.0);
    }
}

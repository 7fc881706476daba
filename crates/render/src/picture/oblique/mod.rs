//! Views from a direction between above and the side.
//!
//! ```text
//! Camera    directions of the image in the map                camera
//! Extent    bounds of the occupied voxels in the image        extent
//! Plan      size of the image, and its place in the map       plan
//! Samples   the nearest voxel of each sample of the image     samples, code
//! Oblique   ground grid, samples, trajectory, legend          drawing, ground, shade, trajectory
//! ```
//!
//! Projection is orthographic: lengths along the screen have one scale. A map is read twice, tile by tile; memory depends
//! on the image only. The image does not depend on the order of tiles.

mod camera;
mod code;
mod drawing;
mod extent;
mod ground;
mod plan;
mod samples;
mod shade;
mod trajectory;

pub(super) use camera::Camera;
pub(super) use drawing::draw;

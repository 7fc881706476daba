//! Local map: a bounded 3D map near the robot, in memory, for planners that query it many times a second.
//!
//! It is fed with the same scans as an archive ([`Mapper`](voxtile::mapper::Mapper)) or used alone. It keeps occupied
//! voxels and the voxels around them (inflation) that are recent and near the robot; a limit on voxels bounds the
//! memory. After La, Kang and Lee, "A robust, task-agnostic and fully-scalable voxel mapping system for large scale
//! environments", sections IV and V. `docs/local_map.md` lists the differences from the paper and the speed.
//!
//! ```text
//! Scan -> hits, misses -> occupancy -> history, removal -> inflation -> LocalView
//!         frame, ray_search   frame        frame, voxels     inflation     view
//! ```
//!
//! ```
//! use voxtile_local::{LocalMap, LocalParameters, LocalState, Obstacle};
//! use voxtile::{Queries, UnknownAs};
//!
//! # fn main() -> voxtile::Result<()> {
//! let mut map = LocalMap::new(0.1, LocalParameters::local_mapping())?;
//! let reader = map.reader(); // For the planner's thread.
//! map.insert_scan(&voxtile::Scan { origin: [0.0; 3], points: vec![[4.25, 1.05, 0.35]], intensities: None })?;
//! let view = reader.view();
//! assert_eq!(view.state_at([4.25, 1.05, 0.35]), LocalState::Occupied);
//! assert_eq!(view.state_at([4.25, 1.25, 0.35]), LocalState::Inflated);
//! let obstacles = view.obstacles(Obstacle::Inflated);
//! assert!(obstacles.cast_segment([0.0; 3], [5.0, 1.3, 0.4], UnknownAs::Free)?.is_some());
//! # Ok(())
//! # }
//! ```

mod archive;
mod changes;
mod counts;
mod frame;
mod inflation;
mod map;
mod nodes_around;
mod page_table;
mod parameters;
mod place;
mod queries;
mod range;
mod ray_search;
mod reader;
mod report;
mod rules;
mod runs;
mod slab;
mod sparse;
mod stencil;
mod sweep;
mod tree;
mod view;
mod voxels;

pub use archive::{LocalAnswer, WithLocalMap};
pub use changes::VoxelChange;
pub use map::LocalMap;
pub use parameters::LocalParameters;
pub use queries::LocalObstacles;
pub use reader::LocalReader;
pub use report::{LocalReport, StageTimes};
pub use view::{LocalState, LocalView, Obstacle};

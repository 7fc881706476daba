//! A made-up world, seeded: a city or a building, a lidar, a drive. The demo, tests and benchmarks use the same.
//!
//! Everything is a function of a seed and a number, to the bit on every platform: scan `k` of a drive can be made
//! without the scans before it, and a drive of any length needs no memory.
//!
//! ```
//! use voxtile::simulation::{City, Lidar, scan_at};
//!
//! let city = City::new(7);
//! let scan = scan_at(&city, Lidar::demo(), 7, 3);
//! assert!(scan.points.len() > 1000);
//! ```

mod building;
mod city;
mod lidar;
mod random;
mod scene;

pub use building::Building;
pub use city::City;
pub use lidar::{Lidar, scan_at, scans};
pub use scene::{Echo, Scene, Solid, World};

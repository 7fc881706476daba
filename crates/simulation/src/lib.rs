//! Synthetic worlds for tests and benchmarks: seeded, unbounded, and bit-identical on all platforms.
//!
//! ```text
//! City, Building, Warehouse  (World)  boxes and a ground plane                  block, solid, scene
//! Drive, Teleport, Walk      (Route)  pose of the sensor at each step           leg, plan
//! Lidar                               scans in the world frame, from a pose
//! Survey                              world, route and lidar: a sequence of scans
//! ```
//!
//! Everything is a function of a seed and an index. Memory does not grow with the distance, and scan k does not depend
//! on whether earlier scans were generated.
//!
//! ```
//! use voxtile_simulation::Survey;
//!
//! let mut survey = Survey::demo(7);
//! let first = survey.next().expect("the demo drive has no end");
//! assert_eq!(first, survey.scan_at(0));
//! ```

mod block;
mod building;
mod city;
mod drive;
mod leg;
mod lidar;
mod plan;
mod random;
mod route;
mod scene;
mod solid;
mod survey;
mod teleport;
mod walk;
mod warehouse;
mod world;

pub use building::Building;
pub use city::City;
pub use drive::Drive;
pub use lidar::Lidar;
pub use random::Random;
pub use route::Route;
pub use scene::{Hit, Scene};
pub use solid::Solid;
pub use survey::Survey;
pub use teleport::Teleport;
pub use walk::Walk;
pub use warehouse::Warehouse;
pub use world::World;

//! A made-up world to map: seeded, endless, and the same to the last bit on every platform.
//!
//! ```text
//! City, Building, Warehouse  (World)  what there is: boxes and a ground plane   block, solid, scene
//! Drive, Teleport, Walk  (Route)  where the sensor is at step k      leg, plan
//! Lidar                    what it sees from there: a Scan in the world frame
//! Survey                   the three together: scan k, or one scan after another
//! ```
//!
//! Everything is a function of a seed and an index. Nothing is stored that grows with the distance driven, and
//! scan k comes out the same whether or not the scans before it were made.
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

//! Synthetic worlds for tests and benchmarks: seeded, unbounded, and bit-identical on all platforms.
//!
//! ```text
//! City, Building, Warehouse            (World)   boxes and a ground plane           block, solid, scene
//! Traffic, Moment                      (World)   a city with movers, at a time      body, round, vehicles, walkers
//! Drive, Stroll, Teleport, Walk        (Route)   pose of the sensor at each step    leg, plan, round
//! Lidar, SolidStateLidar, DepthCamera  (Sensor)  scans from a pose                  sweep
//! Survey                                         world, route and lidar: a sequence of scans
//! Recording                                      traffic, route and sensor: a sequence of labelled scans
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
mod body;
mod building;
mod city;
mod depth_camera;
mod drive;
mod label;
mod labelled_scan;
mod leg;
mod lidar;
mod moment;
mod plan;
mod random;
mod recording;
mod round;
mod route;
mod scene;
mod sensor;
mod solid;
mod solid_state_lidar;
mod stroll;
mod survey;
mod sweep;
mod teleport;
mod traffic;
mod vehicles;
mod walk;
mod walkers;
mod warehouse;
mod world;

pub use building::Building;
pub use city::City;
pub use depth_camera::DepthCamera;
pub use drive::Drive;
pub use label::Label;
pub use labelled_scan::LabelledScan;
pub use lidar::Lidar;
pub use moment::Moment;
pub use random::Random;
pub use recording::Recording;
pub use route::Route;
pub use scene::{Hit, Scene};
pub use sensor::Sensor;
pub use solid::Solid;
pub use solid_state_lidar::SolidStateLidar;
pub use stroll::Stroll;
pub use survey::Survey;
pub use teleport::Teleport;
pub use traffic::Traffic;
pub use walk::Walk;
pub use warehouse::Warehouse;
pub use world::World;

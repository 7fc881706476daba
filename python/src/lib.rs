//! The module `voxtile._voxtile`: voxtile's library for Python, with numpy arrays.
//!
//! ```text
//! map            Map: lifetime, inserts, queries
//! questions      queries of arrays of points, rays and boxes
//! local_map      LocalMap: obstacles around the robot
//! distance       distances to the nearest obstacle
//! compare        changes between two maps
//! frontiers      where exploration can continue
//! operations     whole maps on disk
//! remapping      replays of kept scans: new poses, other parameters, removals
//! scan_iterator  files of scans
//! calls          builds and exports in this process
//! options        options of builds and exports from keywords
//! keywords       typed access to keyword arguments
//! command        the command `voxtile`
//! watched        work without the interpreter's lock; Ctrl-C ends the work
//! ```
//!
//! The package around it is `python/voxtile/`; its documentation for users is `docs/python.md`.

mod arrays;
mod calls;
mod cleaning;
mod command;
mod compare;
mod config;
mod distance;
mod errors;
mod frontiers;
mod keywords;
mod layers;
mod local_map;
mod map;
mod operations;
mod options;
mod pose;
mod questions;
mod remapping;
mod replay_parts;
mod report;
mod scan;
mod scan_iterator;
mod source;
mod tile_iterator;
mod watched;

/// The Python module.
#[pyo3::pymodule]
mod _voxtile {
    #[pymodule_export]
    use super::calls::{call_build, call_export, call_export_scans};
    #[pymodule_export]
    use super::cleaning::{check_replay, map_for_search, search_columns, search_moving};
    #[pymodule_export]
    use super::command::run_command;
    #[pymodule_export]
    use super::compare::{Change, Comparison, compare, compare_part, join_parts};
    #[pymodule_export]
    use super::distance::{DistanceField, compute_distances};
    #[pymodule_export]
    use super::frontiers::Frontier;
    #[pymodule_export]
    use super::layers::{class_style, color_map};
    #[pymodule_export]
    use super::local_map::LocalMap;
    #[pymodule_export]
    use super::map::Map;
    #[pymodule_export]
    use super::operations::{
        clear, convert, crop, decay, default_tile_size, delete_snapshot, describe, diff, forget_old,
        import_octree, join, merge, move_shard, repair, replace_tiles, revert, scan_digest, snapshots,
        verify,
    };
    #[pymodule_export]
    use super::remapping::{clean, remap, remap_as, remove_points, remove_scans};
    #[pymodule_export]
    use super::replay_parts::{join_replay, replay_columns, replay_part, search_points};
    #[pymodule_export]
    use super::report::InsertReport;
    #[pymodule_export]
    use super::scan_iterator::{ScanIterator, count_scans, open_scans, scan_reaches};
    #[pymodule_export]
    use super::tile_iterator::TileIterator;
    #[pymodule_export]
    use super::watched::wait_for_all;
}

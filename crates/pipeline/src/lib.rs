//! Building, finding and exporting maps: the part shared by the command line program, the viewer, the Python package
//! and the ROS 2 node. Nothing here prints, parses a command line or depends on a user interface.
//!
//! ```text
//! BuildOptions -> build                                             build, build_config, flush_schedule
//!   scans of files, folders, maps, buckets or a pipe                scan_input, kept_source, fetched_source
//!   -> ScanReader, in its own thread -> ScanQueue -> Ingest         scan_reader, scan_queue, ingest
//!   -> a mapper -> Summary                                          summary
//! ExportOptions -> export -> ExportSummary                          export/, output/
//! write_distances_npz, write_distances_png                          distance_files
//! Comparison of two maps -> lists, files of voxels, warnings        changes/
//! read_moving_points: marked points of kept scans                    moving_points
//! PoseFile -> poses_for -> new poses of kept scans                   new_poses, sparse_poses
//! scan_digest: a digest of kept scans                                scan_digest
//! numbers: lists of numbers used by all front ends                  numbers
//! PolygonFile: an area of GeoJSON                                   polygon_file
//! Watch: stops work and receives its progress                       watch
//! ```

mod answer;
mod build;
mod build_config;
mod build_options;
mod changes;
mod distance_files;
mod export;
mod failed_flush;
#[cfg(feature = "bucket")]
mod fetched_source;
mod flush_schedule;
mod ingest;
mod input_chain;
mod kept_source;
mod layer_check;
mod map_at;
pub mod memory;
mod moving_points;
mod new_poses;
pub mod numbers;
pub mod octree_file;
pub mod output;
pub mod place;
mod polygon_file;
mod pose_check;
mod region_tiles;
mod scan_digest;
mod scan_input;
mod scan_place;
mod scan_queue;
mod scan_reader;
mod sparse_poses;
mod summary;
mod watch;

pub use answer::{Answer, LayersAnswer, answer_at};
pub use build::build;
pub use build_options::{BuildOptions, SensorModelKind};
pub use changes::{
    ComparedMap, ListFormat, SensorPositions, WhichChanges, change_features, changes_format, check_crs,
    class_code, common_voxels, kept_viewpoints, viewpoints_of, warnings_of, write_change_list,
    write_changed_voxels,
};
pub use distance_files::{layer_of, write_distances_npz, write_distances_png};
pub use export::{
    ExportOptions, ExportSummary, ExportedScans, POSES_NAME, WhichPoints, WhichVoxels, Written, export,
    export_scans,
};
pub use flush_schedule::FlushEvery;
pub use kept_source::is_map;
pub use map_at::{
    AnyMap, MapAt, check_is_no_file, open_any_map, read_all_maps, read_any_map, read_any_maps, read_map,
    read_maps, whole_map,
};
pub use moving_points::read_moving_points;
pub use new_poses::{PoseFile, WhichScans, poses_for};
pub use polygon_file::PolygonFile;
pub use region_tiles::tiles_of;
pub use scan_digest::scan_digest;
pub use scan_input::{ScanInput, ScanInputs, is_standard_input, open_paths};
pub use scan_place::LocalScans;
pub use scan_queue::WhenBehind;
pub use sparse_poses::interpolated_poses;
pub use summary::{OctreeWork, Summary};
pub use watch::{Gauge, Listener, MakeGauge, Unit, Watch};

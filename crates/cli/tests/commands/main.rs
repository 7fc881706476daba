//! Tests of the command with small inputs.

/// Synthetic ROS 1 recordings.
#[cfg(feature = "ros")]
#[path = "../../../formats/tests/made/bag1.rs"]
mod bag1;
/// Main commands.
mod cli;
/// Changes between two maps, frontiers.
mod cli_compare;
/// Distance fields.
mod cli_distance;
/// merge, crop, clear and decay.
mod cli_edit;
/// Exports: atomic, never over other files.
mod cli_export;
/// Files of other programs as input and output.
mod cli_formats;
/// Help, man pages and completion scripts.
mod cli_help;
/// Output of `--json`.
mod cli_json;
/// Layers in exports, and in maps of kept scans.
mod cli_layers;
/// `local`.
mod cli_local;
/// Effects of `-q`, `-v` and `RUST_LOG`.
mod cli_log;
/// Pictures and reports.
mod cli_pictures;
/// Crops by polygons of GeoJSON files.
mod cli_polygon;
/// Ambiguous poses.
mod cli_pose_guess;
/// Poses in an input, next to it, or given by an option.
mod cli_poses;
/// Maps of regions.
mod cli_region;
/// `remap` and removals.
mod cli_remap;
/// Scan streams from standard input.
mod cli_scan_stream;
/// Several inputs in one command.
mod cli_several_inputs;
/// Snapshots.
mod cli_snapshots;
/// Exports in feet and in other coordinate systems.
mod cli_units;
/// Recordings with damaged chunks.
#[cfg(feature = "ros")]
mod damaged_recordings;
/// Text and raw files of other programs.
mod foreign_texts;
/// Resumed builds, `verify` and `repair`.
mod interrupted;
/// Synthetic ROS messages.
#[cfg(feature = "ros")]
#[allow(dead_code)]
#[path = "../../../formats/tests/made/message.rs"]
mod message;
/// Recordings of odometry programs.
#[cfg(feature = "ros")]
mod registered_clouds;
/// `view`, tested through its server.
#[cfg(all(feature = "view", target_os = "linux"))]
mod view;
/// Clients of the server.
#[cfg(all(feature = "view", target_os = "linux"))]
mod view_clients;
/// `view --export-page`.
#[cfg(all(feature = "view", target_os = "linux"))]
mod view_export;
/// Flushes, snapshots and changes.
#[cfg(all(feature = "view", target_os = "linux"))]
mod view_states;
/// Runs the server.
#[cfg(all(feature = "view", target_os = "linux"))]
mod viewer;

//! The command, as a person or a program runs it.

/// Recordings of ROS 1 that tests make.
#[cfg(feature = "ros")]
#[path = "../../../formats/tests/made/bag1.rs"]
mod bag1;
/// The command as a person types it.
mod cli;
/// The commands that merge, crop, clear and fade.
mod cli_edit;
/// Exported files: written as a whole or not at all, and never over other files.
mod cli_export;
/// Files of other programs, in and out.
mod cli_formats;
/// Help, man pages and completion scripts.
mod cli_help;
/// What `--json` prints: the version, shapes of places and boxes, failures.
mod cli_json;
/// The local map, by the command.
mod cli_local;
/// What `-q`, `-v` and `RUST_LOG` say beside the answer.
mod cli_log;
/// Pictures, in files and for terminals, and reports.
mod cli_pictures;
/// Poses that may mean something else.
mod cli_pose_guess;
/// Poses that come with files, beside them or by options.
mod cli_poses;
/// Maps of a region from the command line.
mod cli_region;
/// Maps that follow new poses, by the command.
mod cli_remap;
/// The stream of scans, from standard input.
mod cli_scan_stream;
/// Snapshots from the command line.
mod cli_snapshots;
/// Recordings with damaged chunks.
#[cfg(feature = "ros")]
mod damaged_recordings;
/// Texts and raw numbers of other programs.
mod foreign_texts;
/// Builds that are resumed, maps that are verified and repaired, from the command line.
mod interrupted;
/// Messages of ROS that tests make.
#[cfg(feature = "ros")]
#[allow(dead_code)]
#[path = "../../../formats/tests/made/message.rs"]
mod message;
/// Recordings of programs for odometry.
#[cfg(feature = "ros")]
mod registered_clouds;
/// Maps in a browser, by what the server sends.
#[cfg(all(feature = "view", target_os = "linux"))]
mod view;

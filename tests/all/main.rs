//! All integration tests in one binary, a module a subject.

/// Scans as people have them: borrowed, narrow, in either frame; poses of every form.
mod borrowed_scans;
/// The command as a person types it.
#[cfg(feature = "cli")]
mod cli;
/// The commands that merge, crop, clear and fade.
#[cfg(feature = "cli")]
mod cli_edit;
/// Files that are exported: whole or not there, where they say, and no stranger's.
#[cfg(feature = "cli")]
mod cli_export;
/// Files of other programs, in and out.
#[cfg(feature = "cli")]
mod cli_formats;
/// Help, man pages and completion scripts.
#[cfg(feature = "cli")]
mod cli_help;
/// What `--json` prints: the version, shapes of places and boxes, failures.
#[cfg(feature = "cli")]
mod cli_json;
/// What `-q`, `-v` and `RUST_LOG` say beside the answer.
#[cfg(feature = "cli")]
mod cli_log;
/// Pictures, in files and for terminals, and reports.
#[cfg(feature = "cli")]
mod cli_pictures;
/// Poses that come with files, beside them or by options.
#[cfg(feature = "cli")]
mod cli_poses;
/// Maps of a region from the command line.
#[cfg(feature = "cli")]
mod cli_region;
/// Maps that follow new poses, by the command.
#[cfg(feature = "cli")]
mod cli_remap;
/// Snapshots from the command line.
#[cfg(feature = "cli")]
mod cli_snapshots;
/// Maps with another storage: the same content, and there and back the same files.
mod convert;
/// Every byte of every file of a map, damaged: found, named, repaired.
mod corruption;
/// Recordings with damaged chunks.
#[cfg(all(feature = "cli", feature = "ros"))]
mod damaged_recordings;
/// Deletions of snapshots that are killed.
mod deletions;
/// Errors: what they say, their causes, what they are about.
#[cfg(feature = "cli")]
mod errors;
/// Maps whose tiles are far from each other.
mod far_tiles;
/// Every operation of a life of a map fails once, and the power goes at every one of them.
mod faults;
/// The first voxel asked of a tile on disk.
mod first_questions;
/// Files of every kind, of every version.
mod format_fixtures;
/// One trait for everything that can be asked.
mod front_door;
/// Inputs that fuzzing found worth keeping, once more.
mod fuzz_corpus;
/// Builds that are resumed, maps that are verified and repaired, from the command line.
#[cfg(feature = "cli")]
mod interrupted;
/// Damage to the files of kept scans, of the map and of its snapshots.
mod kept_damage;
/// Files of kept scans under the hands of a writer.
mod kept_scans;
/// What each folder may know.
mod layering;
/// Files that a killed command, or one that the disk refused, leaves in a map.
mod leftovers;
/// Many queries at once beside the mapper, in threads with small stacks.
mod live_arrays;
/// Readers in other threads beside the mapper.
mod live_readers;
/// The local map against a naive one, after every update; what planners ask; archives beside it.
mod local_map;
mod low_memory;
/// Lives of maps in commands of their own, against a naive life: removed tiles, and every operation as a fault.
mod map_life;
/// The same sentences about every mapper: equal to the naive one, to the bit.
mod mapper_contract;
/// Messages of ROS that tests make.
#[cfg(all(feature = "cli", feature = "ros"))]
#[allow(dead_code)]
#[path = "../../clouds/tests/made/message.rs"]
mod message;
/// Random insert, query, eviction, flush, crash, reopen: always the naive map as of then.
mod model;
/// What the OctoCache paper says, where it can be tried.
mod octocache;
/// OctoMap's own files, to the last node and byte.
mod octomap_files;
/// Octree files of maps beyond memory: those of the whole tree, to the byte.
mod octree_export;
/// What is done with whole maps: made, merged, cropped, cleared, faded.
mod operations;
/// Maps opened and created by options.
mod options;
/// Pictures of known maps, pixel by pixel, and counts of what a map holds.
#[cfg(feature = "render")]
mod pictures;
/// Queries against brute force.
mod queries;
/// Scans from files, good and bad.
mod readers;
/// Maps that follow their scans: poses move, scans and points go.
mod remapping;
mod remapping_beside;
mod remapping_changed;
/// The list of scans that a map keeps.
mod scan_list;
/// The stream of scans, in files and from standard input.
mod scan_stream;
mod scans_together;
/// Map sharing: codec, convergence over bad links, layers.
mod sharing;
/// The names of snapshots: in their files, and in the log.
mod snapshot_names;
/// Snapshots, reverts and diffs against naive ones; their damage and repair.
mod snapshots;
/// Numbers that are large, negative or on a border.
mod space;
/// Files of a map: what a flush leaves, what damage is told, what is never overwritten.
mod store;
mod support;
/// Scans that count in some tiles only, and maps of a region.
mod tile_selection;
/// Drives that a cache of tiles likes and some that it does not.
mod trajectories;
/// Files that the medium does not give back.
mod unreadable;
/// Maps in a browser, by what the server sends.
#[cfg(all(feature = "view", target_os = "linux"))]
mod view;
/// Voxel caches in every mode: the same map and coarse answers, and counts as a naive cache has them.
mod voxel_cache;
mod wide_scans;

//! All integration tests of the engine in one binary, with one module per subject.

/// Scans as borrowed slices, in single precision, in either frame, with poses of every form.
mod borrowed_scans;
/// Guarded clearing.
mod clearing;
/// Files of OctoMap's `ColorOcTree`, compared with a naive writer.
mod color_octree;
/// Conversion between storages.
mod convert;
/// Damage to every byte of every file of a map: found and repaired.
mod corruption;
/// Interrupted deletions of snapshots.
mod deletions;
/// Errors: messages, causes, subjects.
mod errors;
/// Maps with large distances between tiles.
mod far_tiles;
/// A fault and a power cut at every operation of a build.
mod faults;
/// The first query of a tile on disk.
mod first_questions;
/// Files written by all versions.
mod format_fixtures;
/// The trait `Queries` for all kinds of maps.
mod front_door;
/// The corpus of the fuzzers.
mod fuzz_corpus;
/// A map on a faulty disk: operations, faults, and the naive map to compare with.
mod harness;
/// Damage to kept scans of the map and of its snapshots.
mod kept_damage;
/// Writes and repairs of kept scans.
mod kept_scans;
/// Dependencies between the engine's modules.
mod layering;
/// Layers.
mod layers;
/// Leftovers of killed or failed commands.
mod leftovers;
/// Concurrent queries in threads with small stacks.
mod live_arrays;
/// Readers in other threads during inserts.
mod live_readers;
mod low_memory;
/// Sequences of operations in separate processes, compared with the naive map: random ones, and with a fault at every
/// operation.
mod map_life;
/// The contract of all mappers: equal to the naive one, to the bit.
mod mapper_contract;
/// Random inserts, queries, evictions, flushes, snapshots, reverts, crashes and reopens, compared with the naive map.
mod model;
/// Claims of the OctoCache paper.
mod octocache;
/// OctoMap's own files, compared node by node and byte by byte.
mod octomap_files;
/// Octree files of maps larger than memory, compared with those of the whole tree.
mod octree_export;
/// Operations on whole maps.
mod operations;
/// Maps opened and created by options.
mod options;
/// Queries compared with brute force.
mod queries;
/// Scans from valid and invalid files.
mod readers;
/// Number of reads of the list of kept scans in a remap.
mod remap_reads;
/// Errors and reports of remaps and removals.
mod remapping;
mod remapping_beside;
mod remapping_changed;
/// Remaps that several processes share, compared with one.
mod remapping_in_parts;
/// The list of scans of a map.
mod scan_list;
/// Scan streams in files and from standard input.
mod scan_stream;
mod scans_together;
/// Names of snapshots in their files and in the log.
mod snapshot_names;
/// Snapshots, reverts and diffs compared with naive ones; damage and repair.
mod snapshots;
/// Large and negative coordinates, and coordinates on borders.
mod space;
/// Files of a map: flushes, damage, locks.
mod store;
/// Scans restricted to some tiles, and maps of a region.
mod tile_selection;
/// Trajectories that are easy or hard for a cache of tiles.
mod trajectories;
/// Unreadable files.
mod unreadable;
/// Voxel caches in every mode, compared with naive ones.
mod voxel_cache;
mod wide_scans;

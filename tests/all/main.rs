//! All integration tests of the engine in one binary, a module a subject.

/// Scans as people have them: borrowed, narrow, in either frame; poses of every form.
mod borrowed_scans;
/// Maps with another storage: the same content, and there and back the same files.
mod convert;
/// Every byte of every file of a map, damaged: found, named, repaired.
mod corruption;
/// Deletions of snapshots that are killed.
mod deletions;
/// Errors: what they say, their causes, what they are about.
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
/// One map on a disk that fails: acts, faults, and the naive map to compare with.
mod harness;
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
mod low_memory;
/// Lives of maps in processes of their own, against the naive map: at random, and with every operation as a fault.
mod map_life;
/// The same sentences about every mapper: equal to the naive one, to the bit.
mod mapper_contract;
/// Random insert, query, eviction, flush, snapshot, revert, crash, reopen: always the naive map as of then.
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
/// Queries against brute force.
mod queries;
/// Scans from files, good and bad.
mod readers;
/// How often a remap reads the list of kept scans.
mod remap_reads;
/// Maps that follow their scans: what is refused, reported and left alone.
mod remapping;
mod remapping_beside;
mod remapping_changed;
/// The list of scans that a map keeps.
mod scan_list;
/// The stream of scans, in files and from standard input.
mod scan_stream;
mod scans_together;
/// The names of snapshots: in their files, and in the log.
mod snapshot_names;
/// Snapshots, reverts and diffs against naive ones; their damage and repair.
mod snapshots;
/// Numbers that are large, negative or on a border.
mod space;
/// Files of a map: what a flush leaves, what damage is told, what is never overwritten.
mod store;
/// Scans that count in some tiles only, and maps of a region.
mod tile_selection;
/// Drives that a cache of tiles likes and some that it does not.
mod trajectories;
/// Files that the medium does not give back.
mod unreadable;
/// Voxel caches in every mode: the same map and coarse answers, and counts as a naive cache has them.
mod voxel_cache;
mod wide_scans;

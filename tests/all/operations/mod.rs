/// Crop and clear compared with filters; crops merged to the whole.
mod cut;
/// Decay compared with the rule, voxel by voxel; applied once.
mod decay;
/// Faults and power cuts at every operation: each call is atomic.
mod faults;
/// Joined shards compared with merged maps; damaged or incompatible shards are errors.
mod join;
/// Atomic creation of maps from tables.
mod map_writer;
/// Merge compared with a naive merge of random maps.
mod merge;
/// Maps of random voxels, written and read back.
mod random_maps;
/// Replacement of tiles compared with a naive map; incompatible parts are errors.
mod replace_tiles;
/// Kept scans of joined shards, merged maps and cropped maps, compared with one build.
mod scans_of_parts;

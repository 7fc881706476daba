/// Tiles of parts in a map against a naive map; what does not go together is refused.
mod adopt;
/// Crop and clear against filters, and what crop cuts apart put together again.
mod cut;
/// Decay against the rule, voxel by voxel; exactly once.
mod decay;
/// Every operation fails once and the power goes at every one: the map is as before, or as after.
mod faults;
/// Pieces joined against merged ones; what is damaged or does not fit is no map.
mod join;
/// New maps from tables: there is none, or the whole one.
mod map_writer;
/// Merge against a naive one on random maps.
mod merge;
/// Maps of any voxels, written and read back.
mod random_maps;

use crate::args::{OctreeArgs, OctreeName, VoxelCacheName};
use voxtile::{Error, OctreeConfig, VoxelCacheConfig, VoxelCacheMode};

pub fn octree_config(args: &OctreeArgs) -> voxtile::Result<OctreeConfig> {
    let shape = VoxelCacheConfig::new(args.tau.unwrap_or(VoxelCacheConfig::default().tau), args.buckets);
    let cache = match args.voxel_cache {
        Some(VoxelCacheName::Serial) => VoxelCacheMode::Serial(shape),
        Some(VoxelCacheName::Parallel) => VoxelCacheMode::Parallel(shape),
        Some(VoxelCacheName::Off) | None => VoxelCacheMode::Off,
    };
    let has_cache = cache != VoxelCacheMode::Off;
    if !has_cache && (args.tau.is_some() || args.buckets.is_some()) {
        let reason = "need a voxel cache; add --voxel-cache serial or --voxel-cache parallel";
        return Err(Error::argument("--tau, --buckets", reason));
    }
    match args.octree {
        Some(OctreeName::Bricks) if has_cache => {
            let reason = "bricks have no voxel cache; use --octree pointers, or omit --octree";
            Err(Error::argument("--voxel-cache", reason))
        }
        Some(OctreeName::Pointers) => Ok(OctreeConfig::Pointers(cache)),
        None if has_cache => Ok(OctreeConfig::Pointers(cache)),
        Some(OctreeName::Bricks) | None => Ok(OctreeConfig::Bricks),
    }
}

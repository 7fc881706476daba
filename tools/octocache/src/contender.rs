use anyhow::Result;
use report::{Elapsed, Stopwatch};
use voxtile::mapper::MapStatistics;
use voxtile::{
    InMemoryMapper, MapConfig, MapView, Mapper, OctreeConfig, Scan, VoxelCacheConfig, VoxelCacheMode,
};

/// A form of octree to compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contender {
    /// Every update is written directly to the pointer tree: OctoMap.
    Off,
    /// The pointer tree with a voxel cache: serial OctoCache.
    Serial,
    /// The same with a thread that writes the tree: parallel OctoCache.
    Parallel,
    /// A view of the table's bricks: voxtile's default.
    Bricks,
}

pub struct Build {
    /// Time to insert the scans.
    pub inserting: Elapsed,
    /// Time to update the trees after the last scan.
    pub draining: Elapsed,
    /// Statistics after the last scan was inserted.
    pub inserted: MapStatistics,
    /// Statistics at the end.
    pub statistics: MapStatistics,
}

impl Build {
    /// Time from the first scan until all updates are in the trees.
    pub fn elapsed(&self) -> Elapsed {
        self.inserting + self.draining
    }
}

impl Contender {
    /// All contenders, in the order of tables.
    pub const ALL: [Self; 4] = [Self::Off, Self::Serial, Self::Parallel, Self::Bricks];

    /// Name in tables and plots.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Serial => "serial",
            Self::Parallel => "parallel",
            Self::Bricks => "bricks",
        }
    }

    /// Returns the configuration with this form of octree; `cache` is the shape of its voxel cache, if it has one.
    pub fn configure(self, config: MapConfig, cache: VoxelCacheConfig) -> MapConfig {
        config.with_octree(match self {
            Self::Off => OctreeConfig::Pointers(VoxelCacheMode::Off),
            Self::Serial => OctreeConfig::Pointers(VoxelCacheMode::Serial(cache)),
            Self::Parallel => OctreeConfig::Pointers(VoxelCacheMode::Parallel(cache)),
            Self::Bricks => OctreeConfig::Bricks,
        })
    }

    /// Builds the map of the scans in memory.
    ///
    /// Views of bricks are updated after every scan, as OctoMap's tree always is. Voxel caches are written to the trees
    /// at the end.
    pub fn build(self, config: &MapConfig, cache: VoxelCacheConfig, scans: &[Scan]) -> Result<Build> {
        let mut mapper = InMemoryMapper::new(self.configure(config.clone(), cache))?;
        let stopwatch = Stopwatch::start()?;
        for scan in scans {
            mapper.insert_scan(scan)?;
            if self == Self::Bricks {
                mapper.sync_octrees();
            }
        }
        let inserting = stopwatch.stop()?;
        let inserted = mapper.statistics();
        let stopwatch = Stopwatch::start()?;
        mapper.sync_octrees();
        // The map is dropped after the measurement.
        Ok(Build { inserting, draining: stopwatch.stop()?, inserted, statistics: mapper.statistics() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{datasets, map_config};
    use std::path::Path;
    use voxtile::MapQueries;

    #[test]
    fn all_contenders_build_the_same_map() {
        let scans = datasets(Path::new(""))[1].scans(2).unwrap();
        let config = map_config(0.4).unwrap();
        let digest = |contender: Contender| {
            let mut mapper =
                InMemoryMapper::new(contender.configure(config.clone(), VoxelCacheConfig::default()))
                    .unwrap();
            for scan in &scans {
                mapper.insert_scan(scan).unwrap();
            }
            mapper.digest().unwrap()
        };
        assert!(Contender::ALL.windows(2).all(|pair| digest(pair[0]) == digest(pair[1])));
    }

    #[test]
    fn only_contenders_with_a_cache_hit_it_and_only_parallel_has_a_queue() {
        let scans = datasets(Path::new(""))[1].scans(2).unwrap();
        for contender in Contender::ALL {
            let config = map_config(0.4).unwrap();
            let octrees =
                contender.build(&config, VoxelCacheConfig::default(), &scans).unwrap().statistics.octrees;
            let has_cache = matches!(contender, Contender::Serial | Contender::Parallel);
            assert_eq!(octrees.voxel_cache.hits > 0, has_cache, "{contender:?}");
            assert_eq!(octrees.queue.limit_voxels > 0, contender == Contender::Parallel, "{contender:?}");
        }
    }
}

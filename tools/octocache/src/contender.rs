use anyhow::Result;
use report::{Stopwatch, Took};
use voxtile::mapper::MapStatistics;
use voxtile::{
    InMemoryMapper, MapConfig, MapView, Mapper, OctreeConfig, Scan, VoxelCacheConfig, VoxelCacheMode,
};

/// A form of octree that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contender {
    /// Every update goes straight into the pointer tree: OctoMap.
    Off,
    /// A voxel cache in front of it: serial OctoCache.
    Serial,
    /// And a thread that writes the tree: parallel OctoCache.
    Parallel,
    /// A view of the table's bricks: what voxtile does if nothing else is said.
    Bricks,
}

/// A map that was built, and what that took.
pub struct Build {
    /// The clocks while the scans were inserted.
    pub inserting: Took,
    /// The clocks while the trees were brought up to date after the last scan.
    pub draining: Took,
    /// What the mapper had counted when the last scan was inserted.
    pub inserted: MapStatistics,
    /// What it had counted in the end.
    pub statistics: MapStatistics,
}

impl Build {
    /// The clocks from the first scan until everything is in the trees.
    pub fn took(&self) -> Took {
        self.inserting + self.draining
    }
}

impl Contender {
    /// All, in the order of tables.
    pub const ALL: [Self; 4] = [Self::Off, Self::Serial, Self::Parallel, Self::Bricks];

    /// What tables and plots call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Serial => "serial",
            Self::Parallel => "parallel",
            Self::Bricks => "bricks",
        }
    }

    /// The configuration with this form of octree; a voxel cache, if there is one, has the shape `cache`.
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
    /// Views of bricks are brought up to date after every scan, for OctoMap's tree is always. What the voxel caches
    /// still hold in the end goes into the trees, too.
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
        // The map is dropped after the clocks were read.
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
    fn only_those_with_a_cache_hit_it_and_only_one_has_a_queue() {
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

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::Random;
use testkit::reference_map::{Voxels, voxels_of};
use voxtile::operations::MapWriter;
use voxtile::sensor::{Evidence, Iwlo, SensorModel};
use voxtile::space::VoxelKey;
use voxtile::tile::Table;
use voxtile::{MapConfig, MapPath, MapReader, Result, Storage};

/// Returns a configuration with tiles of 5 voxels, so that bricks of 8 voxels cross their borders.
pub fn config(random: &mut Random) -> MapConfig {
    let config = MapConfig::new(0.5, 2.5).unwrap();
    let config = if random.below(3) == 0 {
        config.with_sensor_model(SensorModel::Iwlo(Iwlo::default()))
    } else {
        config
    };
    config.with_storage([Storage::OctoMap, Storage::Compact][random.below(2) as usize])
}

/// Returns up to `max_voxels` voxels around a center. The values are repeated, random, or at and beyond the clamping
/// limits.
pub fn random_voxels(random: &mut Random, max_voxels: u64) -> Voxels {
    let center = [0, -70, 32_766][random.below(3) as usize];
    let mut voxels = Voxels::new();
    for _ in 0..random.below(max_voxels + 1) {
        let voxel = [center, 3, -2].map(|c| c + random.below(12) as i32 - 6);
        let log_odds = match random.below(8) {
            0 => random.between(-12.0, 12.0),
            1 => -0.0,
            2 => 3.511,
            3 => -2.0,
            _ => [0.85, -0.4, 1.7][random.below(3) as usize],
        };
        let count = match random.below(8) {
            0 => i32::MAX - random.below(3) as i32,
            _ => random.below(4) as i32,
        };
        voxels.insert(voxel, (f64::to_bits(log_odds), count));
    }
    voxels
}

/// Writes a map of these voxels.
pub fn write_map(disk: &FaultyDisk, folder: &Path, config: &MapConfig, voxels: &Voxels) {
    let mut tiles: BTreeMap<_, Voxels> = BTreeMap::new();
    for (&voxel, &evidence) in voxels {
        tiles.entry(config.grid.tile_of_voxel(voxel)).or_default().insert(voxel, evidence);
    }
    let mut writer = MapWriter::create(MapPath::on(disk.shared(), folder), config).unwrap();
    for (tile, voxels) in tiles {
        writer.put(tile, &table_of(&voxels)).unwrap();
    }
    writer.finish().unwrap();
}

fn table_of(voxels: &Voxels) -> Table {
    let mut table = Table::default();
    let mut by_code: Vec<_> =
        voxels.iter().map(|(&voxel, &e)| (VoxelKey::from_index(voxel).morton(), e)).collect();
    by_code.sort_unstable();
    for (code, (bits, observation_count)) in by_code {
        let evidence = Evidence { log_odds: f64::from_bits(bits), observation_count };
        table.insert(code.brick(), &[(code.place_in_brick(), evidence)]);
    }
    table
}

pub fn open(disk: &FaultyDisk, folder: &Path) -> Result<MapReader> {
    MapReader::open(MapPath::on(disk.shared(), folder), 0)
}

/// Returns the voxels of a map on disk.
pub fn read_map(disk: &FaultyDisk, folder: &Path) -> Voxels {
    voxels_of(&open(disk, folder).unwrap_or_else(|error| panic!("{error:#}")))
}

pub fn path(name: &str) -> PathBuf {
    PathBuf::from("/maps").join(name)
}

pub fn disk() -> FaultyDisk {
    FaultyDisk::new(Fault::None)
}

#[test]
fn written_voxels_are_read_back() {
    for seed in 0..40 {
        let mut random = Random(seed);
        let (disk, config) = (disk(), config(&mut random));
        let voxels = random_voxels(&mut random, 300);
        write_map(&disk, &path("a"), &config, &voxels);
        assert_eq!(read_map(&disk, &path("a")), voxels, "seed {seed}");
    }
}

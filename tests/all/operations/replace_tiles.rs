use super::random_maps::{config, disk, open, path, random_voxels, read_map, write_map};
use std::collections::BTreeSet;
use testkit::faulty_disk::FaultyDisk;
use testkit::random_scans::Random;
use testkit::reference_map::Voxels;
use voxtile::mapper::MapView;
use voxtile::operations::TilesReplaced;
use voxtile::space::TileIndex;
use voxtile::{Error, MapConfig, MapPath, MapQueries, Result};

fn replace(disk: &FaultyDisk, parts: &[&str], of_flush: u64, scans: u64) -> Result<TilesReplaced> {
    let parts = parts.iter().map(|part| open(disk, &path(part))).collect::<Result<Vec<_>>>()?;
    voxtile::operations::replace_tiles(
        MapPath::on(disk.shared(), path("map")),
        &parts,
        of_flush,
        scans,
        None,
        |_, _| {},
    )
}

fn flush_number(disk: &FaultyDisk) -> u64 {
    open(disk, &path("map")).unwrap().flush_number()
}

/// Returns the voxels in tiles on one side of a plane.
fn side(config: &MapConfig, voxels: &Voxels, at: i32, is_west: bool) -> Voxels {
    let is_on_side = |voxel| (config.grid.tile_of_voxel(voxel).x < at) == is_west;
    voxels.iter().filter(|(voxel, _)| is_on_side(**voxel)).map(|(&voxel, &e)| (voxel, e)).collect()
}

#[test]
fn tiles_of_parts_replace_the_tiles_of_the_map() {
    let (mut added, mut changed, mut equal) = (0, 0, 0);
    for seed in 0..60 {
        let mut random = Random(seed);
        let (disk, config) = (disk(), config(&mut random));
        let (before, mut new) = (random_voxels(&mut random, 300), random_voxels(&mut random, 300));
        let tile_of = |voxel: &_| config.grid.tile_of_voxel(*voxel);
        // Some tiles of the parts are unchanged.
        let kept: BTreeSet<TileIndex> = before.keys().map(tile_of).filter(|_| random.below(4) == 0).collect();
        new.retain(|voxel, _| !kept.contains(&tile_of(voxel)));
        new.extend(before.iter().filter(|(voxel, _)| kept.contains(&tile_of(voxel))).map(|(&v, &e)| (v, e)));
        let replaced: BTreeSet<TileIndex> = new.keys().map(tile_of).collect();
        write_map(&disk, &path("map"), &config, &before);
        let at = new.keys().next().map_or(0, |voxel| tile_of(voxel).x + 1);
        write_map(&disk, &path("west"), &config, &side(&config, &new, at, true));
        write_map(&disk, &path("east"), &config, &side(&config, &new, at, false));
        let view = open(&disk, &path("map")).unwrap();
        let digest = view.digest().unwrap();
        let flush = flush_number(&disk);

        let report = replace(&disk, &["west", "east"], flush, 7).unwrap();
        let mut expected = before.clone();
        expected.retain(|voxel, _| !replaced.contains(&tile_of(voxel)));
        expected.extend(new.iter().map(|(&voxel, &evidence)| (voxel, evidence)));
        assert_eq!(read_map(&disk, &path("map")), expected, "seed {seed}");
        assert_eq!(view.digest().unwrap(), digest, "seed {seed}: an open reader sees the old state");
        assert_eq!((report.scan_number, report.flush_number), (7, flush + 1));
        assert_eq!(open(&disk, &path("map")).unwrap().scan_number(), 7);
        (added, changed) = (added + report.tiles_added, changed + report.tiles_changed);
        equal += report.tiles_equal;
        // The same parts again are refused, because they are of an earlier flush.
        let again = replace(&disk, &["west", "east"], flush, 7);
        assert!(matches!(again, Err(Error::InvalidArgument { .. })), "seed {seed}: {again:?}");
        assert_eq!(read_map(&disk, &path("map")), expected);
    }
    assert!(added > 50 && changed > 50 && equal > 50, "{added} {changed} {equal}");
}

#[test]
fn incompatible_parts_leave_the_map_unchanged() {
    let disk = disk();
    let config = MapConfig::new(0.5, 2.5).unwrap();
    let voxels = Voxels::from([([0, 0, 0], (0.85_f64.to_bits(), 1))]);
    write_map(&disk, &path("map"), &config, &voxels);
    write_map(&disk, &path("one"), &config, &voxels);
    write_map(&disk, &path("other"), &config, &voxels);
    write_map(&disk, &path("coarse"), &MapConfig::new(0.25, 2.5).unwrap(), &voxels);
    let flush = flush_number(&disk);
    let common = replace(&disk, &["one", "other"], flush, 1).unwrap_err();
    assert!(common.to_string().contains("the same tile"), "{common}");
    let coarse = replace(&disk, &["coarse"], flush, 1).unwrap_err();
    assert!(matches!(coarse, Error::Mismatch { .. }), "{coarse}");
    let many = replace(&disk, &["one"], flush, u64::MAX).unwrap_err();
    assert!(many.to_string().starts_with("scans: "), "{many}");
    assert_eq!(read_map(&disk, &path("map")), voxels);
}

//! Measures size and speed of the compact form of a map's tiles. Prints one row per map, for
//! `docs/measurements/sizes.md`.
//!
//! `compact_form [--repeat N] MAP...`

use std::error::Error;
use std::path::Path;
use voxtile::space::VoxelBox;
use voxtile::tile::format::{CompactEffort, CompactReader, CompactWriter};
use voxtile::tile::{OctreeFactory, Table, Tile};
use voxtile::{MapReader, MapView};

fn main() -> Result<(), Box<dyn Error>> {
    let mut maps: Vec<String> = std::env::args().skip(1).collect();
    let repeats = match maps.first().map(String::as_str) {
        Some("--repeat") => maps.drain(..2).nth(1).ok_or("a number of times")?.parse()?,
        _ => 3,
    };
    println!(
        "| map | tiles | voxels | table (B/voxel) | fast (B/voxel) | small | below 18 B | encode fast (ns/voxel) | encode small | decode | octree |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for map in maps {
        println!("{}", row(Path::new(&map), repeats)?);
    }
    Ok(())
}

fn row(map: &Path, repeats: usize) -> Result<String, Box<dyn Error>> {
    let tables = tables(map)?;
    let voxels: usize = tables.iter().map(|(table, _)| table.len()).sum();
    let a_voxel = |amount: f64| amount / voxels as f64;
    let table_bytes: usize = tables.iter().map(|(table, _)| table.bytes()).sum();
    let (fast, made_fast) = made(&tables, CompactEffort::Fast, repeats)?;
    let (small, made_small) = made(&tables, CompactEffort::Small, repeats)?;
    let mut reader = CompactReader::new()?;
    let read = least_seconds(repeats, || {
        for (bytes, (_, voxels)) in fast.iter().zip(&tables) {
            std::hint::black_box(reader.read(&mut &bytes[..], bytes.len() as u64, voxels)?);
        }
        Ok(())
    })?;
    let octree = octree_seconds(map, &tables, repeats)?;
    for (bytes, (table, voxels)) in small.iter().zip(&tables) {
        let again = reader.read(&mut &bytes[..], bytes.len() as u64, voxels)?;
        assert!(again.iter().eq(table.iter()), "the decoded table equals the encoded one");
    }
    let [fast, small] = [fast, small].map(|tiles| a_voxel(tiles.iter().map(Vec::len).sum::<usize>() as f64));
    let name = map.file_name().unwrap_or_default().display();
    Ok(format!(
        "| {name} | {} | {voxels} | {:.2} | {fast:.3} | {small:.3} | {:.1}x, {:.1}x | {:.2} | {:.2} | {:.2} | {:.2} |",
        tables.len(),
        a_voxel(table_bytes as f64),
        18.0 / fast,
        18.0 / small,
        1e9 * a_voxel(made_fast),
        1e9 * a_voxel(made_small),
        1e9 * a_voxel(read),
        1e9 * a_voxel(octree),
    ))
}

/// Returns the time to create tiles from tables, with up-to-date octrees.
fn octree_seconds(map: &Path, tables: &[(Table, VoxelBox)], repeats: usize) -> Result<f64, Box<dyn Error>> {
    let (reader, octrees) = (MapReader::open(map, 0)?, OctreeFactory::default());
    let grid = reader.config().grid;
    let mut least = f64::INFINITY;
    for _ in 0..repeats {
        let copies = tables.to_vec();
        let mut tiles = Vec::with_capacity(copies.len());
        let before = cpu_seconds();
        for (table, voxels) in copies {
            tiles.push(Tile::from_table(&grid, &octrees, grid.tile_of_voxel(voxels.min), table));
        }
        least = least.min(cpu_seconds() - before);
    }
    Ok(least)
}

/// Returns the tables of a map's tiles, and the voxels that belong to each.
fn tables(map: &Path) -> Result<Vec<(Table, VoxelBox)>, Box<dyn Error>> {
    let mut tables = Vec::new();
    for tile in MapReader::open(map, 0)?.tiles() {
        let tile = tile?;
        tables.push((tile.table().clone(), tile.voxel_box()));
    }
    Ok(tables)
}

type Compact = Vec<Vec<u8>>;

fn made(
    tables: &[(Table, VoxelBox)],
    effort: CompactEffort,
    repeats: usize,
) -> Result<(Compact, f64), Box<dyn Error>> {
    let (mut made, mut writer) = (Vec::new(), CompactWriter::new(effort)?);
    let seconds = least_seconds(repeats, || {
        made.clear();
        for (table, _) in tables {
            let mut bytes = Vec::new();
            writer.write(table, &mut bytes)?;
            made.push(bytes);
        }
        Ok(())
    })?;
    Ok((made, seconds))
}

/// Returns the smallest CPU time that `work` takes on this thread, in seconds.
fn least_seconds(
    repeats: usize,
    mut work: impl FnMut() -> Result<(), Box<dyn Error>>,
) -> Result<f64, Box<dyn Error>> {
    let mut least = f64::INFINITY;
    for _ in 0..repeats {
        let before = cpu_seconds();
        work()?;
        least = least.min(cpu_seconds() - before);
    }
    Ok(least)
}

fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

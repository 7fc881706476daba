use crate::args::DemoArgs;
use crate::picture::TopDown;
use crate::progress::Progress;
use crate::summary::Summary;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::mapper::{MapReader, MapView, Mapper, OutOfCoreTileMapper};
use voxtile::scan::ScanReport;
use voxtile::simulation::{City, Lidar, scans};
use voxtile::space::Aabb;
use voxtile::store::Bounds;
use voxtile::{Error, MapConfig, Occupancy};

pub fn run(args: &DemoArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let map = args.out.join("map_tiles");
    if map.exists() {
        let hint = "the demo makes its map anew; remove it or choose another --out";
        return Err(Error::AlreadyExists { path: map, hint }.into());
    }
    // Few tiles and little room for what waits, so that the demo shows the disk at work.
    let config = MapConfig::new(args.resolution, 10.0)?
        .with_range(0.0, 40.0)
        .with_cache_tiles(args.cache_tiles)
        .with_pending_bytes(2 << 20);
    let mut mapper = OutOfCoreTileMapper::create(&map, config)?;
    mapper.set_input_fingerprint(format!("demo city {} over {} m", args.seed, args.length));
    let city = City::new(args.seed);
    let mut report = ScanReport::default();
    let progress = Progress::over_scans(Some(args.length as usize));
    for scan in scans(&city, Lidar::demo(), args.seed).take(args.length as usize) {
        report += mapper.insert_scan(&scan)?;
        progress.step();
        progress.show(&mapper);
    }
    progress.say("flushing");
    mapper.flush()?;
    drop(progress);
    Summary::of(&map, u64::from(args.length), report, &mapper, started.elapsed())?.print(args.json)?;
    drop(mapper);

    let picture = args.out.join("map.png");
    draw(&map, &picture)?;
    if !args.json {
        say_what_next(&args.out, &map, &picture)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Draws a map on disk from above, tile by tile.
fn draw(map: &Path, picture: &Path) -> anyhow::Result<()> {
    let reader = MapReader::open(map, 1)?;
    let config = reader.config();
    let (resolution_m, tile_size_m) = (config.grid.resolution_m(), config.grid.tile_size_m());
    let Some(Bounds { min, max }) = Bounds::of(reader.tile_indices().into_iter()) else { return Ok(()) };
    let corner = |index: [i32; 3], add: f64| index.map(|k| (f64::from(k) + add) * tile_size_m);
    let mut top_down =
        TopDown::new(Aabb { min: corner(min, 0.0), max: corner(max, 1.0) }, resolution_m, tile_size_m);
    for tile in reader.tiles() {
        for voxel in tile?.voxels() {
            let is_occupied = Occupancy::of(config, Some(voxel.evidence)).is_occupied();
            top_down.add(config.grid.center_m(voxel.index), resolution_m, is_occupied);
        }
    }
    top_down.write_png(picture)
}

fn say_what_next(folder: &Path, map: &Path, picture: &Path) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    let (folder, map) = (folder.display(), map.display());
    writeln!(out, "picture   {}", picture.display())?;
    writeln!(out, "\nWhat to try next:")?;
    writeln!(out, "  voxtile info {map}")?;
    writeln!(out, "  voxtile query {map} 10 0 1.9")?;
    writeln!(out, "  voxtile raycast {map} --origin 10 0 1.9 --direction 0 1 0")?;
    writeln!(out, "  voxtile export {map} -o {folder}/city.ply")?;
    writeln!(out, "  voxtile build YOUR_SCANS -o your_map")
}

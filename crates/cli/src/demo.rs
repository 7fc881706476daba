use crate::args::DemoArgs;
use crate::counted::Counted;
use crate::failure::JsonTo;
use crate::octree_choice::octree_config;
use crate::picture::write_png;
use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::run::INTERRUPTED;
use crate::stop_signal;
use crate::summary;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::mapper::{MapReader, MapView, Mapper, OutOfCoreTileMapper};
use voxtile::scan::ScanReport;
use voxtile::space::Point;
use voxtile::{Error, MapConfig};
use voxtile_pipeline::Summary;
use voxtile_render::{ColorBy, Picture};
use voxtile_simulation::{City, Drive, Lidar, Survey};

/// Distance between scans.
const SPACING_M: u32 = 2;

pub fn run(args: &DemoArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let stop = stop_signal::catch()?;
    let map = args.out.join("map_tiles");
    // Small limits, so that the demo pages tiles to disk.
    let config = MapConfig::new(args.resolution, 10.0)?
        .with_range(0.0, 40.0)
        .with_octree(octree_config(&args.octree)?)
        .with_cache_tiles(args.cache_tiles)
        .with_write_buffer_bytes(4 << 20)
        .with_storage(args.storage.into());
    if let ColorBy::Layer(layer) = args.color.into() {
        layer.check(&config.layers())?;
    }
    let (mut mapper, done) = begin(args, &map, config)?;
    mapper.stop_with(stop.clone());
    let scans = args.length.div_ceil(SPACING_M) as usize;
    let drive = Drive::new(args.seed, f64::from(SPACING_M));
    let survey = Survey::new(City::new(args.seed), drive, Lidar::demo(), args.seed);
    let mut report = ScanReport::default();
    let mut path: Vec<Point> = Vec::with_capacity(scans);
    let mut inserted = 0;
    let progress = Progress::over_scans(Some(scans));
    for (number, scan) in (0..).zip(survey.take(scans)) {
        path.push(scan.origin);
        progress.step();
        if number < done {
            // In the map already; only its position is needed, for the picture.
            continue;
        }
        match mapper.insert_scan(&scan) {
            Ok(of_scan) => report += of_scan,
            Err(Error::Stopped) => break,
            Err(error) => return Err(error.into()),
        }
        inserted += 1;
        progress.show(&|| mapper.statistics());
    }
    progress.show_message("flushing");
    mapper.flush()?;
    drop(progress);
    if stop.is_set() {
        let all = done + inserted;
        let message = format!(
            "stopped after {}; all of them are in the map; run the same command to continue",
            Counted(all, "scan")
        );
        JsonTo::output_if(args.json).report_stopped(&message);
        return Ok(ExitCode::from(INTERRUPTED));
    }
    let mut built = Summary::of(&map, inserted, report, &mapper, started.elapsed())?;
    built.resumed_after = done;
    summary::print(built, args.json)?;
    drop(mapper);

    let picture = args.out.join("map.png");
    draw(args, &map, &path, &picture)?;
    if !args.json {
        print_next_steps(&args.out, &map, &picture, path.first().copied().unwrap_or_default())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Creates the demo's map or resumes an interrupted one; returns it with the number of its scans.
fn begin(args: &DemoArgs, map: &Path, config: MapConfig) -> anyhow::Result<(OutOfCoreTileMapper, u64)> {
    let name = format!("demo city {} over {} m", args.seed, args.length);
    let mut mapper = match MapReader::open(map, 0) {
        Err(Error::NoMap { .. }) => OutOfCoreTileMapper::create(map, config)?,
        _ => OutOfCoreTileMapper::open(map, config).map_err(|error| match error {
            Error::Mismatch { .. } => another_demo(map),
            error => error,
        })?,
    };
    match mapper.resume_input(&name) {
        Ok(done) => Ok((mapper, done)),
        Err(Error::Mismatch { .. }) => Err(another_demo(map).into()),
        Err(error) => Err(error.into()),
    }
}

fn another_demo(map: &Path) -> Error {
    let hint =
        "the demo resumes only its own map with the same options; remove the map or choose another --out";
    Error::AlreadyExists { path: map.to_owned(), hint }
}

/// Draws a map and the trajectory from above, tile by tile.
fn draw(args: &DemoArgs, map: &Path, path: &[Point], file: &Path) -> anyhow::Result<()> {
    let reader = MapReader::open(map, 0)?;
    let grid = reader.config().grid;
    let (scans, resolution_m, tile_size_m) = (path.len(), grid.resolution_m(), grid.tile_size_m());
    let title = format!("voxtile demo: {scans} scans, {resolution_m} m voxels, {tile_size_m} m tiles");
    let picture = Picture::new().with_color(args.color.into()).with_path(path.to_vec()).with_title(title);
    write_png(&picture.draw(&reader, |_, _| {})?, file)
}

fn print_next_steps(folder: &Path, map: &Path, picture: &Path, [x, y, z]: Point) -> std::io::Result<()> {
    let mut out = summary_out(false);
    let (folder, map) = (folder.display(), map.display());
    writeln!(out, "picture   {}", picture.display())?;
    writeln!(out, "\nNext steps:")?;
    if cfg!(feature = "view") {
        writeln!(out, "  voxtile view {map}")?;
    }
    writeln!(out, "  voxtile picture {map} -o {folder}/slice.png --slice 1.5")?;
    writeln!(out, "  voxtile report {map} -o {folder}/report.html")?;
    writeln!(out, "  voxtile info {map}")?;
    writeln!(out, "  voxtile query {map} {x:.1} {y:.1} {z:.1}")?;
    writeln!(out, "  voxtile raycast {map} --origin {x:.1} {y:.1} {z:.1} --direction 0 1 0")?;
    writeln!(out, "  voxtile export {map} -o {folder}/city.ply")?;
    writeln!(out, "  voxtile build YOUR_SCANS -o your_map")
}

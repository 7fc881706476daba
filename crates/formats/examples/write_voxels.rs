//! Writes the voxels of a CSV table in one of the output formats.
//!
//! ```text
//! write_voxels FORMAT VOXELS.csv OUTPUT [--resolution M] [--origin X Y Z] [--subtract X Y Z] [--quantize] [--crs CRS]
//! ```
//!
//! Each line of the table is `ix,iy,iz,log_odds,count`. Tiles have 32 voxels per edge.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use voxtile_formats::write::{
    Origin, OutputFormat, OutputFormats, RowLayers, VoxelRow, VoxelsHead, WriteOptions,
};

const TILE_VOXELS: i32 = 32;

struct Arguments {
    format: OutputFormat,
    table: PathBuf,
    output: PathBuf,
    resolution_m: f64,
    origin_m: [f64; 3],
    subtract_m: [f64; 3],
    is_quantized: bool,
    crs: String,
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = arguments()?;
    let text = std::fs::read_to_string(&arguments.table)?;
    let mut rows: Vec<VoxelRow> = Vec::new();
    for line in text.lines().filter(|line| !line.is_empty()) {
        rows.push(row(line, &arguments).ok_or_else(|| format!("not a voxel: {line}"))?);
    }
    rows.sort_by_key(|row| (row.tile, morton(row.index)));
    let mut bounds_m = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for row in &rows {
        #[expect(clippy::needless_range_loop, reason = "two lists, one index")]
        for k in 0..3 {
            bounds_m[0][k] = bounds_m[0][k].min(row.center_m[k]);
            bounds_m[1][k] = bounds_m[1][k].max(row.center_m[k]);
        }
    }
    let head = VoxelsHead {
        voxels: rows.len() as u64,
        resolution_m: arguments.resolution_m,
        bounds_m,
        occupied_log_odds: 0.0,
        layers: voxtile::Layers::NONE,
    };
    let mut options = WriteOptions::for_path(&arguments.output);
    options.crs = Some(arguments.crs);
    options.origin_m = arguments.subtract_m;
    options.is_quantized = arguments.is_quantized;
    options.stamp_ns = 1_700_000_000_123_456_789;
    let mut sink = arguments.format.open(&head, &arguments.output, &options)?;
    for row in &rows {
        sink.put(row)?;
    }
    sink.finish()?;
    Ok(())
}

fn arguments() -> Result<Arguments, String> {
    let mut words = std::env::args().skip(1);
    let mut word = |what: &str| words.next().ok_or_else(|| format!("{what} is missing"));
    let name = word("FORMAT")?;
    let format = *OutputFormats::default().of_name(&name).ok_or_else(|| format!("{name} is not a format"))?;
    let (table, output) = (word("VOXELS.csv")?.into(), Path::new(&word("OUTPUT")?).to_owned());
    let (origin_m, subtract_m) = ([0.0; 3], [0.0; 3]);
    let crs = "LOCAL_CS[\"voxels\",UNIT[\"metre\",1]]".to_owned();
    let mut arguments = Arguments {
        format,
        table,
        output,
        resolution_m: 0.1,
        origin_m,
        subtract_m,
        is_quantized: false,
        crs,
    };
    let mut rest: Vec<String> = words.collect();
    rest.reverse();
    while let Some(option) = rest.pop() {
        let mut number = || -> Result<f64, String> {
            let text = rest.pop().ok_or_else(|| format!("{option} needs a number"))?;
            text.parse().map_err(|_| format!("{option}: {text} is not a number"))
        };
        match option.as_str() {
            "--resolution" => arguments.resolution_m = number()?,
            "--origin" => arguments.origin_m = [number()?, number()?, number()?],
            "--quantize" => arguments.is_quantized = true,
            "--crs" => arguments.crs = rest.pop().ok_or("--crs needs a value")?,
            "--subtract" => arguments.subtract_m = [number()?, number()?, number()?],
            _ => return Err(format!("unknown option {option}")),
        }
    }
    if format.origin == Origin::Map {
        arguments.subtract_m = [0.0; 3];
    }
    Ok(arguments)
}

fn row(line: &str, arguments: &Arguments) -> Option<VoxelRow> {
    let words: Vec<&str> = line.split(',').collect();
    let [x, y, z, log_odds, count] = words.as_slice() else {
        return None;
    };
    let index: [i32; 3] = [x.parse().ok()?, y.parse().ok()?, z.parse().ok()?];
    let log_odds: f64 = log_odds.parse().ok()?;
    let center = |k: usize| {
        let center = arguments.origin_m[k] + (f64::from(index[k]) + 0.5) * arguments.resolution_m;
        center - arguments.subtract_m[k]
    };
    Some(VoxelRow {
        index,
        center_m: std::array::from_fn(center),
        probability: 1.0 / (1.0 + (-log_odds).exp()),
        log_odds,
        observation_count: count.parse().ok()?,
        tile: index.map(|k| k.div_euclid(TILE_VOXELS)),
        layers: RowLayers::default(),
    })
}

/// Returns the Morton index of a voxel within its tile.
fn morton(index: [i32; 3]) -> u64 {
    let mut code = 0;
    for bit in 0..5 {
        for (k, number) in index.iter().enumerate() {
            code |= u64::from(number.rem_euclid(TILE_VOXELS) as u32 >> bit & 1) << (3 * bit + k);
        }
    }
    code
}

use crate::args::QueryArgs;
use crate::json;
use crate::part::point_of;
use anyhow::Context;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;
use voxtile::Error;
use voxtile::mapper::MapView;
use voxtile::space::Point;
use voxtile_formats::read_points;
use voxtile_pipeline::{Answer, LayersAnswer, answer_at, read_any_map};

pub fn run(args: &QueryArgs) -> anyhow::Result<ExitCode> {
    let points = match &args.points {
        Some(path) => points_from(path)?,
        None => vec![point_of(&args.point)],
    };
    if let Some(point) = points.iter().find(|point| !point.iter().all(|coordinate| coordinate.is_finite())) {
        return Err(Error::argument("point", format!("{point:?} is not finite")).into());
    }
    let answers = read_any_map(&args.map, |reader| {
        let grid = reader.config().grid;
        // Query in tile order, so that each tile is read once, then restore the order of the points.
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_key(|&number| grid.tile_of(points[number]));
        let mut answers: Vec<(usize, Answer)> = Vec::with_capacity(points.len());
        for number in order {
            answers.push((number, answer_at(reader, points[number])?));
        }
        answers.sort_by_key(|(number, _)| *number);
        Ok(answers)
    })?;
    let mut out = BufWriter::new(std::io::stdout().lock());
    for (_, answer) in &answers {
        if args.json {
            json::print(answer, &mut out)?;
        } else {
            let [x, y, z] = answer.point_m;
            write!(out, "{x} {y} {z}  {}", answer.state)?;
            if let (Some(probability), Some(count)) = (answer.probability, answer.observation_count) {
                let log_odds = answer.log_odds.unwrap_or_default();
                write!(out, "  probability {probability:.4}  log-odds {log_odds:.4}  {count} observations")?;
            }
            answer.layers.iter().try_for_each(|layers| write_layers(layers, &mut out))?;
            writeln!(out)?;
        }
    }
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the layers of a voxel after its evidence.
fn write_layers(layers: &LayersAnswer, out: &mut impl Write) -> std::io::Result<()> {
    write!(out, "  {} hits", layers.points)?;
    if let Some([red, green, blue]) = layers.colour {
        write!(out, "  colour {red} {green} {blue}")?;
    }
    if let (Some(mean), Some(deviation)) = (layers.intensity, layers.intensity_deviation) {
        write!(out, "  intensity {mean:.3} +- {deviation:.3}")?;
    }
    for (class, votes) in &layers.classes {
        write!(out, "  class {class}: {votes}")?;
    }
    if let (Some(first), Some(last)) = (layers.first_ns, layers.last_ns) {
        write!(out, "  hit from {:.3} to {:.3} s", first as f64 * 1e-9, last as f64 * 1e-9)?;
    }
    if let Some([x, y, z]) = layers.mean_m {
        write!(out, "  mean {x:.4} {y:.4} {z:.4}")?;
    }
    Ok(())
}

fn points_from(path: &Path) -> anyhow::Result<Vec<Point>> {
    let points = if path == Path::new("-") {
        read_points(std::io::stdin().lock()).context("standard input")?
    } else {
        let file = File::open(path).map_err(|error| Error::io(path, "open", error))?;
        read_points(BufReader::new(file)).map_err(|error| Error::io(path, "read", error))?
    };
    Ok(points.map_err(|error| error.in_input(path))?)
}

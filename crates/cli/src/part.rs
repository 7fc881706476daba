use crate::args::PartArgs;
use voxtile::operations::Part;
use voxtile::space::{Aabb, Point};
use voxtile::{Error, Result};

/// The box of a `--region`: six numbers that the argument parser has counted.
pub fn region_of(corners: &[f64]) -> Result<Aabb> {
    let (lower, upper) = corners.split_at(corners.len().min(3));
    let region = Aabb { min: point_of(lower), max: point_of(upper) };
    if (0..3).all(|k| region.min[k] < region.max[k]) {
        return Ok(region);
    }
    Err(Error::argument("--region", "needs X0 < X1, Y0 < Y1 and Z0 < Z1"))
}

/// The part of space that a command is about.
pub fn part_of(args: &PartArgs) -> Result<Part> {
    let region = region_of(&args.region)?;
    Ok(if args.outside { Part::Outside(region) } else { Part::Inside(region) })
}

/// Three coordinates that the argument parser has counted.
pub fn point_of(numbers: &[f64]) -> Point {
    std::array::from_fn(|axis| numbers.get(axis).copied().unwrap_or(f64::NAN))
}

use crate::args::PartArgs;
use voxtile::Result;
use voxtile::operations::Part;
use voxtile::space::{Aabb, Point};
use voxtile_pipeline::numbers;

/// The box of a `--region`.
pub fn region_of(corners: &[f64]) -> Result<Aabb> {
    numbers::region_of("region", corners)
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

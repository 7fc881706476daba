use voxtile::Result;
use voxtile::operations::Part;
use voxtile::space::{Aabb, Point};
use voxtile_pipeline::numbers;

pub fn region_of(corners: &[f64]) -> Result<Aabb> {
    numbers::region_of("region", corners)
}

/// Returns the part of space from `--region` and `--outside`.
pub fn part_of(region: &[f64], is_outside: bool) -> Result<Part> {
    let region = region_of(region)?;
    Ok(if is_outside { Part::Outside(region) } else { Part::Inside(region) })
}

/// Returns a point from three coordinates, which the argument parser has counted.
pub fn point_of(numbers: &[f64]) -> Point {
    std::array::from_fn(|axis| numbers.get(axis).copied().unwrap_or(f64::NAN))
}

use crate::distance::Distance;
use voxtile::{Error, Point, Result};

/// Result of a check of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Smallest distance to obstacles on the checked part, in metres; the cap of the field if all distances are beyond
    /// it, and `None` if none is known.
    pub min_distance_m: Option<f64>,
    /// The first place that is not clear, where the check ended; `None` if the whole path is clear.
    pub blocked: Option<Blocked>,
}

/// The first place of a path that is not clear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blocked {
    /// Point on the path, in metres.
    pub point: Point,
    /// Length of the path up to the point, in metres.
    pub along_m: f64,
    /// Distance at the point: less than the radius, or unknown.
    pub distance: Distance,
}

impl Clearance {
    /// Returns whether the whole path has the requested clearance.
    pub fn is_clear(&self) -> bool {
        self.blocked.is_none()
    }
}

/// Most points of a path that are checked.
const MAX_POINTS: f64 = 1e8;

/// Checks a path at its corners and at least every half voxel between them. A place is blocked if its distance is less
/// than `radius_m` or unknown.
///
/// # Errors
///
/// Fails if the path or the radius is not finite, if the path is too long, or if `distance_at` fails.
pub(crate) fn along(
    path: &[Point],
    radius_m: f64,
    resolution_m: f64,
    max_distance_m: f64,
    mut distance_at: impl FnMut(Point) -> Result<Distance>,
) -> Result<Clearance> {
    check(path, radius_m, resolution_m, max_distance_m)?;
    let mut clearance = Clearance { min_distance_m: None, blocked: None };
    let mut along_m = 0.0;
    let mut visit = |point: Point, along_m: f64| -> Result<bool> {
        let distance = distance_at(point)?;
        let distance_m = distance.capped_m(max_distance_m);
        if let Some(distance_m) = distance_m {
            clearance.min_distance_m =
                Some(clearance.min_distance_m.map_or(distance_m, |least| least.min(distance_m)));
        }
        // At the cap, `Beyond` is clear for every radius up to it.
        let is_clear =
            distance == Distance::Beyond || distance_m.is_some_and(|distance_m| distance_m >= radius_m);
        if !is_clear {
            clearance.blocked = Some(Blocked { point, along_m, distance });
        }
        Ok(is_clear)
    };
    if let Some(&first) = path.first()
        && !visit(first, 0.0)?
    {
        return Ok(clearance);
    }
    for ends in path.windows(2) {
        let step: [f64; 3] = std::array::from_fn(|k| ends[1][k] - ends[0][k]);
        let length_m = length(step);
        let count = (length_m / (0.5 * resolution_m)).ceil().max(1.0);
        for number in 1..=count as u64 {
            let part = number as f64 / count;
            let point =
                if part < 1.0 { std::array::from_fn(|k| ends[0][k] + part * step[k]) } else { ends[1] };
            if !visit(point, along_m + part * length_m)? {
                return Ok(clearance);
            }
        }
        along_m += length_m;
    }
    Ok(clearance)
}

fn length(step: [f64; 3]) -> f64 {
    step.iter().map(|k| k * k).sum::<f64>().sqrt()
}

fn check(path: &[Point], radius_m: f64, resolution_m: f64, max_distance_m: f64) -> Result<()> {
    if !(0.0..=max_distance_m).contains(&radius_m) {
        let reason =
            format!("{radius_m} m, but distances of this field are known from 0 m to {max_distance_m} m");
        return Err(Error::argument("radius", reason));
    }
    if let Some(point) = path.iter().find(|point| !point.iter().all(|k| k.is_finite())) {
        return Err(Error::argument("path", format!("has the point {point:?}, which is not finite")));
    }
    let length_m: f64 =
        path.windows(2).map(|ends| length(std::array::from_fn(|k| ends[1][k] - ends[0][k]))).sum();
    let points = length_m / (0.5 * resolution_m);
    if points + path.len() as f64 <= MAX_POINTS {
        return Ok(());
    }
    let hint = "check a shorter path";
    Err(Error::TooLarge {
        what: "the number of points of the path",
        size: points as u64,
        limit: MAX_POINTS as u64,
        hint,
    })
}

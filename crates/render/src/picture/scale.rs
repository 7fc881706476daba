use voxtile::space::Aabb;
use voxtile::{Error, Result};

/// Division of the ground plane into square cells of whole voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneFrame {
    /// Lower corner in metres, world frame.
    pub min_m: [f64; 2],
    /// Edge length of a cell in metres: one voxel, or several for large maps.
    pub cell_m: f64,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
}

impl PlaneFrame {
    /// Returns the frame of the bounds with at most `max_edge` cells along an edge.
    pub fn new(bounds: &Aabb, resolution_m: f64, max_edge: usize) -> Result<Self> {
        let size_m: [f64; 2] = std::array::from_fn(|k| bounds.max[k] - bounds.min[k]);
        let longest_m = size_m[0].max(size_m[1]);
        if !(resolution_m > 0.0
            && longest_m.is_finite()
            && size_m[0] > 0.0
            && size_m[1] > 0.0
            && max_edge > 0)
        {
            return Err(Error::argument("picture", "there is nothing to draw: the map has no extent"));
        }
        let voxels_a_cell = (longest_m / resolution_m / max_edge as f64 - 1e-9).ceil().max(1.0);
        let cell_m = voxels_a_cell * resolution_m;
        let cells = size_m.map(|m| ((m / cell_m - 1e-9).ceil() as usize).clamp(1, max_edge));
        Ok(Self { min_m: [bounds.min[0], bounds.min[1]], cell_m, cells })
    }

    /// Returns the cell of a point in metres, unless it is outside.
    pub fn cell_of(&self, x_m: f64, y_m: f64) -> Option<[usize; 2]> {
        let along = |k: usize, m: f64| {
            let cell = ((m - self.min_m[k]) / self.cell_m).floor();
            (cell >= 0.0 && cell < self.cells[k] as f64).then_some(cell as usize)
        };
        Some([along(0, x_m)?, along(1, y_m)?])
    }
}

/// Returns the longest round length (1, 2 or 5 times a power of ten, in metres) up to `longest_m`.
pub fn round_length_m(longest_m: f64) -> f64 {
    let power = 10_f64.powi(longest_m.log10().floor().clamp(-6.0, 9.0) as i32);
    [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|&m| m <= longest_m).unwrap_or(power)
}

/// Formats a round length: `50 cm`, `10 m`, `2 km`.
pub fn length_label(length_m: f64) -> String {
    if length_m >= 1000.0 {
        format!("{} km", length_m / 1000.0)
    } else if length_m >= 1.0 {
        format!("{length_m} m")
    } else {
        format!("{} cm", (length_m * 1e5).round() / 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(x: f64, y: f64) -> Aabb {
        Aabb { min: [-10.0, 20.0, 0.0], max: [-10.0 + x, 20.0 + y, 10.0] }
    }

    #[test]
    fn a_small_map_has_a_cell_a_voxel() {
        let frame = PlaneFrame::new(&bounds(30.0, 10.0), 0.1, 2048).unwrap();
        assert_eq!((frame.cells, frame.cell_m), ([300, 100], 0.1));
        assert_eq!(frame.cell_of(-9.95, 20.05), Some([0, 0]));
        assert_eq!(frame.cell_of(19.95, 29.95), Some([299, 99]));
        assert_eq!(frame.cell_of(-10.05, 20.05), None);
        assert_eq!(frame.cell_of(0.0, 30.05), None);
        assert_eq!(frame.cell_of(f64::NAN, 25.0), None);
    }

    #[test]
    fn a_large_map_has_cells_of_whole_voxels_and_stays_bounded() {
        let frame = PlaneFrame::new(&bounds(20_000.0, 500.0), 0.1, 2048).unwrap();
        assert!(frame.cells[0] <= 2048);
        assert!((frame.cell_m / 0.1 - (frame.cell_m / 0.1).round()).abs() < 1e-9);
        assert_eq!(frame.cell_of(19_989.0, 25.0).unwrap()[0], frame.cells[0] - 1);
    }

    #[test]
    fn a_map_without_extent_is_an_error() {
        assert!(PlaneFrame::new(&bounds(0.0, 5.0), 0.1, 2048).is_err());
        assert!(PlaneFrame::new(&bounds(f64::NAN, 5.0), 0.1, 2048).is_err());
        assert!(PlaneFrame::new(&bounds(f64::INFINITY, 5.0), 0.1, 2048).is_err());
    }

    #[test]
    fn scale_bars_are_round_and_within_the_maximum() {
        for (longest_m, length_m, label) in [
            (12.0, 10.0, "10 m"),
            (49.0, 20.0, "20 m"),
            (50.0, 50.0, "50 m"),
            (0.7, 0.5, "50 cm"),
            (2_300.0, 2_000.0, "2 km"),
        ] {
            assert_eq!(round_length_m(longest_m), length_m);
            assert_eq!(length_label(length_m), label);
        }
    }
}

use crate::config::RayConfig;
use crate::error::{Error, Result};
use crate::space::{Grid, TileBox};

/// Conversion of regions between tile sizes. A region is given in tiles, and keeps its place in space.
pub(super) struct Retiling {
    from_m: f64,
    to_m: f64,
}

/// Tolerance of a border, in new tiles: the rounding error of the largest indices.
const TOLERANCE: f64 = 1e-6;

impl Retiling {
    pub(super) fn between(from: &Grid, to: &Grid) -> Self {
        Self { from_m: from.tile_size_m(), to_m: to.tile_size_m() }
    }

    /// Converts the region of ray settings to the other tiles.
    ///
    /// # Errors
    ///
    /// A region whose border is not a border of the other tiles.
    pub(super) fn rays(&self, rays: &RayConfig) -> Result<RayConfig> {
        let region = rays.region.map(|region| self.region(region)).transpose()?;
        Ok(RayConfig { region, ..*rays })
    }

    fn region(&self, region: TileBox) -> Result<TileBox> {
        if self.from_m == self.to_m {
            return Ok(region);
        }
        let corners = [region.min().to_array(), region.max().to_array()];
        let edges = [0, 1, 2].map(|axis| self.edge(corners[0][axis], corners[1][axis]));
        match edges {
            [Some(x), Some(y), Some(z)] => Ok(TileBox::new([x.0, y.0, z.0].into(), [x.1, y.1, z.1].into())),
            _ => Err(self.refuse(region)),
        }
    }

    /// Converts the first and last tile of a region along an axis to new tiles. The limits of the index range represent
    /// a region without a border.
    fn edge(&self, first: i32, last: i32) -> Option<(i32, i32)> {
        let begin = if first == i32::MIN { first } else { self.border(i64::from(first))? };
        let end = if last >= i32::MAX - 1 { i32::MAX } else { self.border(i64::from(last) + 1)? };
        (begin < end).then(|| (begin, end - 1))
    }

    /// Returns the number of the new tile that begins where the old tile `number` begins; `None` if no new tile begins
    /// there.
    fn border(&self, number: i64) -> Option<i32> {
        let exact = number as f64 * self.from_m / self.to_m;
        let whole = exact.round();
        let is_border = (exact - whole).abs() <= TOLERANCE;
        let is_number = f64::from(i32::MIN) < whole && whole < f64::from(i32::MAX);
        (is_border && is_number).then_some(whole as i32)
    }

    fn refuse(&self, region: TileBox) -> Error {
        let Self { from_m, to_m } = self;
        let reason = format!(
            "{to_m} m does not fit the region of the map, tiles {} to {} of {from_m} m: its border would be inside a \
             tile; keep the tile size, or use one that divides {from_m} m",
            region.min(),
            region.max()
        );
        Error::argument("tile size", reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn retiled(from_m: f64, to_m: f64, min: [i32; 3], max: [i32; 3]) -> Option<TileBox> {
        let retiling = Retiling { from_m, to_m };
        retiling.region(TileBox::new(min.into(), max.into())).ok()
    }

    #[test]
    fn regions_are_converted_or_refused() {
        let tiles = |min: [i32; 3], max: [i32; 3]| Some(TileBox::new(min.into(), max.into()));
        let (min, max) = ([-2, 0, 4], [1, 0, 5]);
        assert_eq!(retiled(10.0, 2.5, min, max), tiles([-8, 0, 16], [7, 3, 23]));
        assert_eq!(retiled(0.3, 0.1, min, max), tiles([-6, 0, 12], [5, 2, 17]));
        assert_eq!(retiled(10.0, 20.0, min, max), None);
        assert_eq!(retiled(10.0, 20.0, [-2, 0, 4], [1, 1, 5]), tiles([-1, 0, 2], [0, 0, 2]));
        assert_eq!(retiled(10.0, 10.0, min, max), tiles(min, max));
        assert_eq!(retiled(10.0, 3.0, min, max), None);
    }

    #[test]
    fn unbounded_regions_stay_unbounded_and_in_range() {
        let all = ([i32::MIN, i32::MIN, 0], [i32::MAX - 1, -1, i32::MAX - 1]);
        let tiles = TileBox::new(all.0.into(), all.1.into());
        assert_eq!(retiled(10.0, 2.5, all.0, all.1), Some(tiles));
        assert_eq!(retiled(1000.0, 0.001, [0; 3], [9_999_999; 3]), None);
    }
}

use super::{Grid, VoxelBox};
use thiserror::Error;

/// Area in the plane of x and y: polygons with holes.
///
/// A point is in a polygon by the even-odd rule over all its rings, so a hole is a ring inside another, and in the area
/// if it is in any of its polygons. As for boxes, a point on a lower or left edge is inside, one on an upper or right
/// edge is not: areas that share an edge never share a point.
#[derive(Clone, Debug)]
pub struct Area {
    /// Edges of all rings, in the order of the polygons.
    edges: Vec<Edge>,
    bands: Bands,
    /// Lowest and highest x and y.
    bounds_m: [[f64; 2]; 2],
}

/// Ring of a polygon: its corners in metres. The last one is connected to the first one, and may repeat it.
pub type AreaRing = Vec<[f64; 2]>;

/// Reason why rings are not an area.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AreaError {
    /// There is no polygon.
    #[error("there is no polygon")]
    Empty,
    /// A coordinate is not finite.
    #[error("polygon {polygon}: the corner {corner_m:?} is not finite")]
    NotFinite {
        /// Number of the polygon, the first being 0.
        polygon: usize,
        /// The corner.
        corner_m: [f64; 2],
    },
    /// A ring has fewer than three corners.
    #[error("polygon {polygon}: ring {ring} has {corners} different corners; a ring needs three")]
    TooFewCorners {
        /// Number of the polygon, the first being 0.
        polygon: usize,
        /// Number of the ring, the first being 0.
        ring: usize,
        /// Number of different corners.
        corners: usize,
    },
}

/// Edge of a ring, upwards, or to the right if it is horizontal. So two polygons that share an edge compute the same
/// crossings, whatever the directions of their rings.
#[derive(Clone, Copy, Debug)]
struct Edge {
    low: [f64; 2],
    high: [f64; 2],
    polygon: u32,
}

impl Edge {
    fn x_range(&self) -> [f64; 2] {
        [self.low[0].min(self.high[0]), self.low[0].max(self.high[0])]
    }

    /// Returns where the edge crosses a height between its ends.
    fn x_at(&self, y: f64) -> f64 {
        let share = (y - self.low[1]) / (self.high[1] - self.low[1]);
        let [least, most] = self.x_range();
        (self.low[0] + share * (self.high[0] - self.low[0])).clamp(least, most)
    }
}

/// Edges by height: each band lists the edges that touch it.
#[derive(Clone, Debug)]
struct Bands {
    lowest_m: f64,
    bands_per_m: f64,
    /// First entry of each band in `edges`, and the number of entries.
    starts: Vec<usize>,
    edges: Vec<u32>,
}

impl Bands {
    fn of(edges: &[Edge], bounds_m: &[[f64; 2]; 2]) -> Self {
        let (lowest_m, height_m) = (bounds_m[0][1], bounds_m[1][1] - bounds_m[0][1]);
        // Edges as high as the area are listed by every band, so there are fewer bands the higher the edges are.
        let heights: f64 = edges.iter().map(|edge| edge.high[1] - edge.low[1]).sum();
        let bands = (4.0 * edges.len() as f64 * height_m / heights).clamp(1.0, edges.len() as f64);
        let bands = if bands.is_nan() { 1 } else { bands as usize };
        let bands_per_m = if height_m > 0.0 { bands as f64 / height_m } else { 0.0 };
        let mut made = Self { lowest_m, bands_per_m, starts: vec![0; bands + 1], edges: Vec::new() };
        for edge in edges {
            made.of_edge(edge).for_each(|band| made.starts[band + 1] += 1);
        }
        (0..bands).for_each(|band| made.starts[band + 1] += made.starts[band]);
        made.edges.resize(made.starts[bands], 0);
        let mut next = made.starts.clone();
        for (number, edge) in edges.iter().enumerate() {
            for band in made.of_edge(edge) {
                made.edges[next[band]] = number as u32;
                next[band] += 1;
            }
        }
        made
    }

    fn at(&self, y: f64) -> usize {
        (((y - self.lowest_m) * self.bands_per_m) as usize).min(self.starts.len() - 2)
    }

    fn of_edge(&self, edge: &Edge) -> std::ops::RangeInclusive<usize> {
        self.at(edge.low[1])..=self.at(edge.high[1])
    }
}

impl Area {
    /// Creates the area of polygons, each a list of rings.
    ///
    /// # Errors
    ///
    /// There is no polygon, a coordinate is not finite, or a ring has fewer than three corners.
    pub fn new(polygons: &[Vec<AreaRing>]) -> Result<Self, AreaError> {
        let mut edges = Vec::new();
        for (polygon, rings) in polygons.iter().enumerate() {
            for (ring, corners) in rings.iter().enumerate() {
                add_ring(&mut edges, polygon, ring, corners)?;
            }
        }
        let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for edge in &edges {
            low = [0, 1].map(|k| low[k].min(edge.low[k]).min(edge.high[k]));
            high = [0, 1].map(|k| high[k].max(edge.low[k]).max(edge.high[k]));
        }
        let bounds_m = [low, high];
        if edges.is_empty() {
            return Err(AreaError::Empty);
        }
        Ok(Self { bands: Bands::of(&edges, &bounds_m), edges, bounds_m })
    }

    /// The lowest and the highest x and y of the area, in metres.
    pub fn bounds_m(&self) -> [[f64; 2]; 2] {
        self.bounds_m
    }

    /// Returns the columns of a box of voxels, such as a tile, whose centers are in the area.
    pub fn columns(&self, grid: &Grid, voxels: &VoxelBox) -> ColumnMask {
        let min = [voxels.min[0], voxels.min[1]];
        let [x_m, y_m] = [0, 1].map(|k| -> Vec<f64> {
            (voxels.min[k]..voxels.end[k]).map(|index| grid.center_m([index; 3])[k]).collect()
        });
        let size = [x_m.len(), y_m.len()];
        let none = ColumnMask { min, size, columns: Columns::None };
        let (Some((&west, &east)), Some((&south, &north))) =
            (x_m.first().zip(x_m.last()), y_m.first().zip(y_m.last()))
        else {
            return none;
        };
        let [least, most] = self.bounds_m;
        if east < least[0] || west > most[0] || north < least[1] || south > most[1] {
            return none;
        }
        // Crossings east of the box do not count.
        let mut near = self.edges_between(south, north);
        near.retain(|edge| edge.x_range()[0] <= east);
        let is_uniform = !near.iter().any(|edge| edge.x_range()[1] >= west);
        let words = size[0].div_ceil(64);
        let rows = if is_uniform { 1 } else { size[1] };
        let mut inside = vec![0_u64; words * rows];
        for edges in near.chunk_by(|a, b| a.polygon == b.polygon) {
            let mut turns = vec![0_u64; words * rows];
            for edge in edges {
                let from = y_m[..rows].partition_point(|&y| y < edge.low[1]);
                let end = y_m[..rows].partition_point(|&y| y < edge.high[1]);
                for row in from..end {
                    let x = edge.x_at(y_m[row]);
                    let first = x_m.partition_point(|&center| center < x);
                    if first < size[0] {
                        turns[row * words + first / 64] ^= 1 << (first % 64);
                    }
                }
            }
            for (row, turns) in inside.chunks_mut(words).zip(turns.chunks(words)) {
                let mut is_in = false;
                for (word, &turns) in row.iter_mut().zip(turns) {
                    let found = with_runs_filled(turns) ^ if is_in { u64::MAX } else { 0 };
                    is_in = found >> 63 == 1;
                    *word |= found;
                }
            }
        }
        let last_bits = u64::MAX >> ((64 - size[0] % 64) % 64);
        inside.chunks_mut(words).for_each(|row| row[words - 1] &= last_bits);
        let count: usize = inside.iter().map(|word| word.count_ones() as usize).sum();
        let columns = match count {
            0 => Columns::None,
            _ if count == size[0] * rows => Columns::All,
            _ => Columns::Some(inside),
        };
        ColumnMask { min, size, columns }
    }

    /// Returns the edges that touch a range of heights, in order.
    fn edges_between(&self, south: f64, north: f64) -> Vec<Edge> {
        let (first, last) = (self.bands.at(south), self.bands.at(north));
        let mut numbers = Vec::new();
        for band in first..=last {
            for &number in &self.bands.edges[self.bands.starts[band]..self.bands.starts[band + 1]] {
                let edge = &self.edges[number as usize];
                // Each edge once: in the first of its bands that is read.
                let is_first = band == *self.bands.of_edge(edge).start().max(&first);
                if is_first && edge.low[1] <= north && edge.high[1] >= south {
                    numbers.push(number);
                }
            }
        }
        numbers.sort_unstable();
        numbers.iter().map(|&number| self.edges[number as usize]).collect()
    }
}

fn add_ring(
    edges: &mut Vec<Edge>,
    polygon: usize,
    ring: usize,
    corners: &[[f64; 2]],
) -> Result<(), AreaError> {
    if let Some(&corner_m) = corners.iter().find(|corner| !corner.iter().all(|c| c.is_finite())) {
        return Err(AreaError::NotFinite { polygon, corner_m });
    }
    let mut different: Vec<[f64; 2]> = Vec::new();
    for corner in corners {
        if !different.contains(corner) && different.len() < 3 {
            different.push(*corner);
        }
    }
    if different.len() < 3 {
        return Err(AreaError::TooFewCorners { polygon, ring, corners: different.len() });
    }
    let nexts = corners.iter().skip(1).chain(&corners[..1]);
    for (&one, &next) in corners.iter().zip(nexts).filter(|(one, next)| one != next) {
        let (low, high) = if (one[1], one[0]) <= (next[1], next[0]) { (one, next) } else { (next, one) };
        edges.push(Edge { low, high, polygon: polygon as u32 });
    }
    Ok(())
}

/// Turns bits where runs begin and end into the bits of the runs: each bit is the parity of those up to it.
fn with_runs_filled(mut bits: u64) -> u64 {
    for shift in [1, 2, 4, 8, 16, 32] {
        bits ^= bits << shift;
    }
    bits
}

/// Columns of the voxels of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMask {
    min: [i32; 2],
    size: [usize; 2],
    columns: Columns,
}

#[derive(Clone, Debug, PartialEq)]
enum Columns {
    None,
    All,
    /// A bit per column, row by row; rows begin with a new word.
    Some(Vec<u64>),
}

impl ColumnMask {
    /// Returns whether there is no column.
    pub fn is_empty(&self) -> bool {
        self.columns == Columns::None
    }

    /// Returns whether all columns of the box are in the mask.
    pub fn is_full(&self) -> bool {
        self.columns == Columns::All
    }

    /// Returns whether the mask has the column with this index along x and y.
    pub fn contains(&self, [x, y]: [i32; 2]) -> bool {
        let place = |index: i32, k: usize| {
            let from_min = i64::from(index) - i64::from(self.min[k]);
            usize::try_from(from_min).ok().filter(|&at| at < self.size[k])
        };
        let Some((x, y)) = place(x, 0).zip(place(y, 1)) else { return false };
        match &self.columns {
            Columns::None => false,
            Columns::All => true,
            Columns::Some(words) => words[y * self.size[0].div_ceil(64) + x / 64] >> (x % 64) & 1 == 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The textbook's test, edge by edge.
    fn is_in(polygons: &[Vec<AreaRing>], [x, y]: [f64; 2]) -> bool {
        polygons.iter().any(|rings| {
            let mut is_in = false;
            for ring in rings {
                for k in 0..ring.len() {
                    let (mut a, mut b) = (ring[k], ring[(k + 1) % ring.len()]);
                    if (b[1], b[0]) < (a[1], a[0]) {
                        (a, b) = (b, a);
                    }
                    if (a[1] > y) != (b[1] > y) {
                        is_in ^= a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) <= x;
                    }
                }
            }
            is_in
        })
    }

    /// Compares tiles of several sizes with the textbook's test. Returns the numbers of empty, full and other tiles.
    fn check(polygons: &[Vec<AreaRing>], reach: i32) -> [usize; 3] {
        let area = Area::new(polygons).unwrap();
        let mut kinds = [0; 3];
        for edge in [7, 64, 100] {
            let grid = Grid::new(0.5, 0.5 * f64::from(edge)).unwrap();
            for tile in (-reach..reach).flat_map(|x| (-reach..reach).map(move |y| [x * edge, y * edge, 0])) {
                let voxels = VoxelBox { min: tile, end: tile.map(|first| first + edge) };
                let mask = area.columns(&grid, &voxels);
                let mut count = 0;
                for x in tile[0] - 1..=voxels.end[0] {
                    for y in tile[1] - 1..=voxels.end[1] {
                        let [cx, cy, _] = grid.center_m([x, y, 0]);
                        let is_of_tile = voxels.contains([x, y, tile[2]]);
                        let expected = is_of_tile && is_in(polygons, [cx, cy]);
                        assert_eq!(mask.contains([x, y]), expected, "{x} {y} of {tile:?}");
                        count += usize::from(expected);
                    }
                }
                let all = (edge * edge) as usize;
                assert_eq!((mask.is_empty(), mask.is_full()), (count == 0, count == all));
                kinds[if count == 0 { 0 } else { 1 + usize::from(count < all) }] += 1;
            }
        }
        kinds
    }

    fn square(min: f64, max: f64) -> AreaRing {
        vec![[min, min], [max, min], [max, max], [min, max]]
    }

    fn star(corners: usize, step: usize, radius_m: f64) -> AreaRing {
        let at = |k: usize| 2.0 * std::f64::consts::PI * (k * step % corners) as f64 / corners as f64;
        (0..corners).map(|k| [radius_m * at(k).cos(), radius_m * at(k).sin() + 0.1]).collect()
    }

    #[test]
    fn columns_are_those_of_the_even_odd_rule() {
        // Edges through centers, between them and on borders of tiles; holes; an island in a hole.
        for corner in [10.0, 10.25, 10.1, 32.0] {
            let kinds = check(&[vec![square(-corner, corner)]], 2);
            assert!(kinds[0] > 0 && kinds[1] > 0, "{corner}: {kinds:?}");
            check(&[vec![square(-corner, corner), square(-3.3, 7.25)]], 1);
            check(&[vec![square(-corner, corner), square(-3.3, 7.25)], vec![square(1.0, 2.0)]], 1);
        }
        // Polygons that overlap are united; rings of one polygon that cross are not.
        check(&[vec![square(-9.0, 3.0)], vec![square(-3.0, 9.0)]], 1);
        check(&[vec![square(-9.0, 3.0), square(-3.0, 9.0)]], 1);
        // A star that crosses itself: its middle is outside.
        let pentagram = [vec![star(5, 2, 20.0)]];
        assert!(!is_in(&pentagram, [0.0, 0.0]));
        check(&pentagram, 1);
        // A spike that returns on itself has no area.
        let spike = vec![[0.0, 0.0], [5.0, 0.0], [9.0, 0.0], [5.0, 0.0], [5.0, 5.0]];
        check(&[vec![spike]], 1);
    }

    #[test]
    fn polygons_that_share_an_edge_share_no_column() {
        let (left, right) = ([-20.0, -21.0], [21.0, 20.0]);
        for shared in
            [[[0.3, -20.0], [-7.1, 20.0]], [[-20.0, 0.25], [20.0, 0.25]], [[0.25, -20.0], [0.25, 20.0]]]
        {
            let [a, b] = shared;
            let one = vec![vec![a, b, left]];
            let other = vec![vec![b, a, right]];
            let whole = vec![vec![a, right, b, left]];
            let grid = Grid::new(0.5, 10.0).unwrap();
            let voxels = VoxelBox { min: [-40, -40, 0], end: [40, 40, 1] };
            let [one, other, whole] =
                [one, other, whole].map(|rings| Area::new(&[rings]).unwrap().columns(&grid, &voxels));
            for column in (-40..40).flat_map(|x| (-40..40).map(move |y| [x, y])) {
                let of_parts = [one.contains(column), other.contains(column)];
                assert!(of_parts != [true, true], "{column:?}");
                assert_eq!(of_parts[0] || of_parts[1], whole.contains(column), "{column:?}");
            }
        }
    }

    #[test]
    fn areas_of_many_corners_list_each_edge_in_few_bands() {
        // A comb of high teeth, which every row crosses, and a circle.
        let teeth = (0..5000).flat_map(|k| [[0.04 * f64::from(k), 100.0], [0.04 * f64::from(k) + 0.02, 0.0]]);
        let comb: AreaRing = teeth.chain([[200.0, -10.0], [0.0, -10.0]]).collect();
        let circle = star(10_000, 1, 90.0);
        let grid = Grid::new(0.5, 10.0).unwrap();
        for ring in [comb, circle] {
            let area = Area::new(&[vec![ring.clone()]]).unwrap();
            assert!(area.bands.edges.len() <= 6 * ring.len(), "{}", area.bands.edges.len());
            let mut columns = 0;
            for tile in (-10..10).flat_map(|x| (-10..10).map(move |y| [20 * x, 20 * y, 0])) {
                let mask = area.columns(&grid, &VoxelBox { min: tile, end: tile.map(|k| k + 20) });
                for column in [[0, 0], [3, 7], [19, 19]].map(|[x, y]| [tile[0] + x, tile[1] + y]) {
                    let [x, y, _] = grid.center_m([column[0], column[1], 0]);
                    columns += 1;
                    assert_eq!(mask.contains(column), is_in(&[vec![ring.clone()]], [x, y]));
                }
            }
            assert_eq!(columns, 1200);
        }
    }

    #[test]
    fn rings_without_an_area_are_refused() {
        assert_eq!(Area::new(&[]).unwrap_err(), AreaError::Empty);
        assert_eq!(Area::new(&[Vec::new()]).unwrap_err(), AreaError::Empty);
        let few = |corners: AreaRing| Area::new(&[vec![square(0.0, 1.0), corners]]).unwrap_err();
        let refused = |corners| AreaError::TooFewCorners { polygon: 0, ring: 1, corners };
        assert_eq!(few(Vec::new()), refused(0));
        assert_eq!(few(vec![[1.0, 1.0], [2.0, 2.0], [1.0, 1.0]]), refused(2));
        for wrong in [f64::NAN, f64::INFINITY] {
            let error = Area::new(&[vec![vec![[0.0, 0.0], [1.0, wrong], [1.0, 0.0]]]]).unwrap_err();
            assert!(matches!(error, AreaError::NotFinite { polygon: 0, .. }), "{error}");
        }
        // A ring may repeat its first corner; coordinates may be huge.
        let closed = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 0.0]];
        check(&[vec![closed]], 1);
        let huge = Area::new(&[vec![vec![[-1e300, -1e300], [1e300, -1e300], [0.0, 1e300]]]]).unwrap();
        let grid = Grid::new(0.5, 10.0).unwrap();
        assert!(huge.columns(&grid, &VoxelBox { min: [0; 3], end: [20; 3] }).is_full());
    }
}

use super::hit_run::HitRun;
use super::voxel_layers::{ClassVotes, ColourSums, IntensitySums, ShapeSums, TimeSpan, VoxelLayers};
use crate::config::Layers;
use crate::scan::{unzigzag, zigzag};

/// Maximum number of points of a voxel in a file: sums of so many points have at most 63 bits.
const MAX_POINTS: u64 = 1 << 31;

/// Number of integers of a voxel.
pub(crate) const COLUMNS: usize = 22;

/// The integers of one voxel, in the form in which bricks and files store them: counts that mostly equal the number of
/// points are differences from it, so that they take no bits. Votes for classes other than the first are elsewhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Row(pub(crate) [u64; COLUMNS]);

pub(super) const POINTS: usize = 0;
/// Points without a colour.
pub(super) const UNCOLOURED: usize = 1;
pub(super) const RED: usize = 2;
/// Points without an intensity.
pub(super) const UNMEASURED: usize = 5;
pub(super) const INTENSITY: usize = 6;
pub(super) const SQUARES: usize = 7;
/// One more than the number of the main class; 0 if there is none.
pub(super) const CLASS: usize = 8;
/// Points that did not vote for the main class; 0 if there is none.
pub(super) const OUTVOTED: usize = 9;
/// 1 if the voxel has no time, else 0.
pub(super) const UNTIMED: usize = 10;
/// First time relative to the base of the brick, as zigzag.
pub(super) const FIRST: usize = 11;
/// Last time relative to the first.
pub(super) const SPAN: usize = 12;
/// Three sums of offsets, as zigzag.
pub(super) const OFFSETS: usize = 13;
/// Three sums of squares, then three sums of products as zigzag.
pub(super) const PRODUCTS: usize = 16;

/// Bits with which a column begins: sums of a few points fit. Columns that are not listed begin with what they need.
pub(super) const FIRST_BITS: [u8; COLUMNS] = {
    let mut bits = [0; COLUMNS];
    bits[POINTS] = 3;
    (bits[RED], bits[RED + 1], bits[RED + 2]) = (10, 10, 10);
    (bits[CLASS], bits[OUTVOTED]) = (5, 2);
    bits
};

/// The columns that layers may use, in ascending order.
pub(crate) fn columns_of(layers: &Layers) -> Vec<usize> {
    let is_used = |column: usize| match column {
        POINTS => true,
        UNCOLOURED..UNMEASURED => layers.colour,
        UNMEASURED..CLASS => layers.intensity_max.is_some(),
        CLASS..UNTIMED => layers.class,
        UNTIMED..OFFSETS => layers.time,
        _ => layers.shape,
    };
    (0..COLUMNS).filter(|column| is_used(*column)).collect()
}

impl Row {
    /// Adds the sums over points, except for their class.
    pub(super) fn add(&mut self, run: &HitRun) {
        let columns = &mut self.0;
        columns[POINTS] += run.points;
        columns[UNCOLOURED] += run.uncoloured;
        (0..3).for_each(|k| columns[RED + k] += run.colour[k]);
        columns[UNMEASURED] += run.unmeasured;
        columns[INTENSITY] += run.intensity;
        columns[SQUARES] += run.squares;
        let mut add = |column: usize, sum: i64| {
            columns[column] = zigzag(unzigzag(columns[column]) + sum);
        };
        (0..3).for_each(|k| add(OFFSETS + k, run.offsets[k]));
        (3..6).for_each(|k| add(PRODUCTS + k, run.products[k]));
        (0..3).for_each(|k| columns[PRODUCTS + k] += run.products[k] as u64);
    }

    /// The time span; `base_ns` is that of the brick.
    pub(crate) fn time(&self, base_ns: i64) -> Option<TimeSpan> {
        let first_ns = base_ns.wrapping_add(unzigzag(self.0[FIRST]));
        let last_ns = first_ns.wrapping_add(self.0[SPAN] as i64);
        (self.0[UNTIMED] == 0).then_some(TimeSpan { first_ns, last_ns })
    }

    pub(crate) fn set_time(&mut self, base_ns: i64, time: Option<TimeSpan>) {
        self.0[UNTIMED] = u64::from(time.is_none());
        let TimeSpan { first_ns, last_ns } = time.unwrap_or(TimeSpan { first_ns: base_ns, last_ns: base_ns });
        self.0[FIRST] = zigzag(first_ns.wrapping_sub(base_ns));
        self.0[SPAN] = last_ns.wrapping_sub(first_ns) as u64;
    }

    /// The class with most votes, if any point had a class.
    pub(crate) fn main_class(&self) -> Option<u8> {
        self.0[CLASS].checked_sub(1).map(|class| class as u8)
    }

    /// Like [`Row::to_layers`] for a row from a file; `None` if its integers cannot be sums over so many points.
    pub(crate) fn checked_layers(
        self,
        base_ns: i64,
        layers: &Layers,
        others: Vec<ClassVotes>,
    ) -> Option<VoxelLayers> {
        let columns = &self.0;
        let points = columns[POINTS];
        let up_to = |column: usize, most: u64| columns[column] <= points * most;
        let largest = u64::from(u16::MAX);
        let is_sum = |column: usize, most: u64| unzigzag(columns[column]).unsigned_abs() <= points * most;
        let is_possible = points > 0
            && points <= MAX_POINTS
            && [UNCOLOURED, UNMEASURED, OUTVOTED].into_iter().all(|column| columns[column] <= points)
            && (RED..RED + 3).all(|column| up_to(column, 255))
            && up_to(INTENSITY, largest)
            && up_to(SQUARES, largest * largest)
            && columns[CLASS] <= 256
            && columns[UNTIMED] <= 1
            && (OFFSETS..OFFSETS + 3).all(|column| is_sum(column, 512))
            && (PRODUCTS..PRODUCTS + 3).all(|column| up_to(column, 512 * 512))
            && (PRODUCTS + 3..PRODUCTS + 6).all(|column| is_sum(column, 512 * 512))
            && others.iter().all(|other| Some(other.class) != self.main_class())
            && others.iter().try_fold(0_u64, |sum, other| sum.checked_add(other.votes))
                <= Some(columns[OUTVOTED])
            && others.iter().all(|other| other.votes <= points);
        let made = is_possible.then(|| self.to_layers(base_ns, layers, others.into_iter()))?;
        // A voxel has one form: its main class is the one with most votes.
        (Self::of(&made, base_ns, layers) == self).then_some(made)
    }

    /// Converts the row; `others` are the votes for other classes than the main one.
    pub(super) fn to_layers(
        self,
        base_ns: i64,
        layers: &Layers,
        others: impl Iterator<Item = ClassVotes>,
    ) -> VoxelLayers {
        let Self(columns) = self;
        let points = columns[POINTS];
        let mut classes: Vec<ClassVotes> = others.collect();
        if let Some(class) = columns[CLASS].checked_sub(1) {
            classes.push(ClassVotes { class: class as u8, votes: points - columns[OUTVOTED] });
            classes.sort_unstable_by_key(|votes| votes.class);
        }
        let mut made = VoxelLayers { points, classes, ..VoxelLayers::default() };
        if layers.colour {
            let [red, green, blue] = [0, 1, 2].map(|k| columns[RED + k]);
            made.colour = ColourSums { points: points - columns[UNCOLOURED], red, green, blue };
        }
        if layers.intensity_max.is_some() {
            let points = points - columns[UNMEASURED];
            made.intensity = IntensitySums { points, sum: columns[INTENSITY], squares: columns[SQUARES] };
        }
        if layers.time {
            made.time = self.time(base_ns);
        }
        if layers.shape {
            let products = std::array::from_fn(|k| match k {
                0..3 => columns[PRODUCTS + k] as i64,
                _ => unzigzag(columns[PRODUCTS + k]),
            });
            made.shape =
                ShapeSums { offsets: std::array::from_fn(|k| unzigzag(columns[OFFSETS + k])), products };
        }
        made
    }

    /// Converts layers to a row, with the class of most votes as the main one.
    pub(crate) fn of(made: &VoxelLayers, base_ns: i64, layers: &Layers) -> Self {
        let mut row = Self::default();
        let columns = &mut row.0;
        columns[POINTS] = made.points;
        if layers.colour {
            let ColourSums { points, red, green, blue } = made.colour;
            columns[UNCOLOURED] = made.points - points;
            columns[RED..RED + 3].copy_from_slice(&[red, green, blue]);
        }
        if layers.intensity_max.is_some() {
            let IntensitySums { points, sum, squares } = made.intensity;
            (columns[UNMEASURED], columns[INTENSITY], columns[SQUARES]) =
                (made.points - points, sum, squares);
        }
        if let Some(main) = made.class().filter(|_| layers.class) {
            let votes = made.classes.iter().find(|votes| votes.class == main).map_or(0, |votes| votes.votes);
            (columns[CLASS], columns[OUTVOTED]) = (u64::from(main) + 1, made.points - votes);
        }
        if layers.shape {
            (0..3).for_each(|k| columns[OFFSETS + k] = zigzag(made.shape.offsets[k]));
            (0..3).for_each(|k| columns[PRODUCTS + k] = made.shape.products[k] as u64);
            (3..6).for_each(|k| columns[PRODUCTS + k] = zigzag(made.shape.products[k]));
        }
        if layers.time {
            row.set_time(base_ns, made.time);
        }
        row
    }
}

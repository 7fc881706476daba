use super::packed_rows::PackedRows;
use super::row::{
    CLASS, INTENSITY, OFFSETS, OUTVOTED, POINTS, PRODUCTS, RED, Row, SQUARES, UNCOLOURED, UNMEASURED,
};
use super::voxel_layers::{ClassVotes, TimeSpan, VoxelLayers};
use crate::config::Layers;
use crate::scan::{LayerHit, unzigzag, zigzag};
use crate::space::{BrickMask, add_to_mask, is_in_mask, places};

/// Layers of the hit voxels of a brick.
#[derive(Clone, Debug, Default)]
pub(super) struct LayeredBrick {
    /// Voxels that were hit.
    mask: BrickMask,
    /// One row per hit voxel, in the order of the mask.
    rows: PackedRows,
    /// Times are relative to this one: the first that the brick got.
    base_ns: Option<i64>,
    /// Votes for other classes than the main one of a voxel, by position and class.
    others: Vec<OtherVotes>,
}

#[derive(Clone, Copy, Debug)]
struct OtherVotes {
    place: u16,
    class: u8,
    votes: u64,
}

impl LayeredBrick {
    pub(super) fn mask(&self) -> BrickMask {
        self.mask
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.rows.heap_bytes() + self.others.capacity() * size_of::<OtherVotes>()
    }

    /// The layers of a voxel; `None` if it was not hit.
    pub(super) fn get(&self, place: usize, layers: &Layers) -> Option<VoxelLayers> {
        let number = self.number_of(place)?;
        Some(self.rows.get(number).to_layers(self.base(), layers, self.others_of(place)))
    }

    /// Adds a point to the voxel at a position.
    #[inline]
    pub(super) fn add(&mut self, place: usize, hit: &LayerHit, stamp_ns: Option<i64>, layers: &Layers) {
        let number = self.number_of(place);
        let mut row = number.map_or_else(Row::default, |number| self.rows.get(number));
        self.add_to(&mut row, place, hit, layers);
        if layers.time {
            let base_ns = self.note_base(stamp_ns);
            let before = row.time(base_ns).filter(|_| number.is_some());
            let now = stamp_ns.map(|ns| TimeSpan { first_ns: ns, last_ns: ns });
            row.set_time(base_ns, TimeSpan::joined(before, now));
        }
        match number {
            Some(number) => self.rows.set(number, &row),
            None => self.insert(place, &row),
        }
    }

    #[inline]
    fn add_to(&mut self, row: &mut Row, place: usize, hit: &LayerHit, layers: &Layers) {
        let columns = &mut row.0;
        let points_before = columns[POINTS];
        columns[POINTS] += 1;
        if layers.colour {
            match hit.colour {
                Some(colour) => (0..3).for_each(|k| columns[RED + k] += u64::from(colour[k])),
                None => columns[UNCOLOURED] += 1,
            }
        }
        if layers.intensity_max.is_some() {
            match hit.intensity.map(u64::from) {
                Some(intensity) => {
                    columns[INTENSITY] += intensity;
                    columns[SQUARES] += intensity * intensity;
                }
                None => columns[UNMEASURED] += 1,
            }
        }
        if layers.shape {
            let offset = hit.offset.map(i64::from);
            let [x, y, z] = offset;
            let mut add = |column: usize, number: i64| {
                columns[column] = zigzag(unzigzag(columns[column]) + number);
            };
            (0..3).for_each(|k| add(OFFSETS + k, offset[k]));
            [x * y, x * z, y * z]
                .into_iter()
                .enumerate()
                .for_each(|(k, product)| add(PRODUCTS + 3 + k, product));
            (0..3).for_each(|k| columns[PRODUCTS + k] += (offset[k] * offset[k]) as u64);
        }
        if layers.class {
            match (hit.class.map(|class| u64::from(class) + 1), columns[CLASS]) {
                (None, 0) => {}
                (Some(class), 0) => (columns[CLASS], columns[OUTVOTED]) = (class, points_before),
                (Some(class), main) if class == main => {}
                (class, _) => {
                    columns[OUTVOTED] += 1;
                    if let Some(class) = class {
                        self.vote(place, (class - 1) as u8, 1);
                    }
                }
            }
        }
    }

    /// Replaces the layers of a voxel.
    pub(super) fn put(&mut self, place: usize, made: &VoxelLayers, layers: &Layers) {
        let base_ns = self.note_base(made.time.map(|time| time.first_ns));
        let row = Row::of(made, base_ns, layers);
        self.others.retain(|other| usize::from(other.place) != place);
        for votes in made.classes.iter().filter(|votes| u64::from(votes.class) + 1 != row.0[CLASS]) {
            self.vote(place, votes.class, votes.votes);
        }
        match self.number_of(place) {
            Some(number) => self.rows.set(number, &row),
            None => self.insert(place, &row),
        }
    }

    /// Visits the hit voxels in Morton order.
    pub(super) fn for_each(&self, layers: &Layers, mut visit: impl FnMut(usize, VoxelLayers)) {
        for (number, place) in places(self.mask).enumerate() {
            visit(place, self.rows.get(number).to_layers(self.base(), layers, self.others_of(place)));
        }
    }

    fn insert(&mut self, place: usize, row: &Row) {
        self.rows.insert(rank(&self.mask, place), row);
        add_to_mask(&mut self.mask, place);
    }

    fn number_of(&self, place: usize) -> Option<usize> {
        is_in_mask(&self.mask, place).then(|| rank(&self.mask, place))
    }

    fn base(&self) -> i64 {
        self.base_ns.unwrap_or(0)
    }

    fn note_base(&mut self, stamp_ns: Option<i64>) -> i64 {
        // Until the first time stamp no row has a time, so any base is valid for them.
        if self.base_ns.is_none() {
            self.base_ns = stamp_ns;
        }
        self.base()
    }

    fn vote(&mut self, place: usize, class: u8, votes: u64) {
        let place = place as u16;
        match self.others.binary_search_by_key(&(place, class), |other| (other.place, other.class)) {
            Ok(at) => self.others[at].votes += votes,
            Err(at) => self.others.insert(at, OtherVotes { place, class, votes }),
        }
    }

    fn others_of(&self, place: usize) -> impl Iterator<Item = ClassVotes> {
        let from = self.others.partition_point(|other| usize::from(other.place) < place);
        let of_voxel = self.others[from..].iter().take_while(move |other| usize::from(other.place) == place);
        of_voxel.map(|other| ClassVotes { class: other.class, votes: other.votes })
    }
}

/// Number of voxels in a mask before a position.
#[inline]
fn rank(mask: &BrickMask, place: usize) -> usize {
    let (word, bit) = (place / 64, place % 64);
    let before: u32 = mask[..word].iter().map(|word| word.count_ones()).sum();
    (before + (mask[word] & ((1 << bit) - 1)).count_ones()) as usize
}

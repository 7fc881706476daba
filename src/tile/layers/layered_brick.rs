use super::hit_run::HitRun;
use super::packed_rows::PackedRows;
use super::row::{CLASS, INTENSITY, OUTVOTED, POINTS, RED, Row, SQUARES, UNCOLOURED, UNMEASURED};
use super::voxel_layers::{ClassVotes, TimeSpan, VoxelLayers};
use crate::config::Layers;
use crate::space::{BrickMask, add_to_mask, is_in_mask, places};

/// Layers of the hit voxels of a brick.
#[derive(Clone, Debug, Default)]
pub(super) struct LayeredBrick {
    /// Voxels that were hit.
    mask: BrickMask,
    /// Number of voxels in the words of the mask before each word.
    before: [u16; 8],
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

    /// Adds points to the voxel at a position.
    #[inline]
    pub(super) fn add(&mut self, place: usize, run: &HitRun, stamp_ns: Option<i64>, layers: &Layers) {
        // Other layers than these are no sums, or have a sign.
        let has_only_sums = !layers.time && !layers.shape;
        if !has_only_sums || !self.add_packed(place, run, layers) {
            self.add_to_row(place, run, stamp_ns, layers);
        }
    }

    /// Adds points to the packed integers; returns `false`, with these unchanged, if that is not possible.
    #[inline]
    fn add_packed(&mut self, place: usize, run: &HitRun, layers: &Layers) -> bool {
        let number = self.rank(place);
        let is_new = !is_in_mask(&self.mask, place);
        let Some(mut summand) = self.rows.summand() else { return false };
        summand.include(POINTS, run.points);
        if layers.colour {
            summand.include(UNCOLOURED, run.uncoloured);
            (0..3).for_each(|k| summand.include(RED + k, run.colour[k]));
        }
        if layers.intensity_max.is_some() {
            summand.include(UNMEASURED, run.unmeasured);
            summand.include(INTENSITY, run.intensity);
            summand.include(SQUARES, run.squares);
        }
        let class = run.class.map_or(0, |class| u64::from(class) + 1);
        if is_new {
            summand.include(CLASS, class);
        }
        let summand = summand.done();
        match is_new {
            true => {
                let is_added = self.rows.insert_sum(number, summand);
                if is_added {
                    self.note(place);
                }
                is_added
            }
            // Votes for another class than the main one are elsewhere.
            false => self.rows.add_if(number, summand, CLASS, class),
        }
    }

    fn add_to_row(&mut self, place: usize, run: &HitRun, stamp_ns: Option<i64>, layers: &Layers) {
        let number = self.number_of(place);
        let mut row = number.map_or_else(Row::default, |number| self.rows.get(number));
        let points_before = row.0[POINTS];
        row.add(run);
        match (run.class.map(|class| u64::from(class) + 1), row.0[CLASS]) {
            (None, 0) => {}
            (Some(class), 0) => (row.0[CLASS], row.0[OUTVOTED]) = (class, points_before),
            (Some(class), main) if class == main => {}
            _ => {
                row.0[OUTVOTED] += run.points;
                if let Some(class) = run.class {
                    self.vote(place, class, run.points);
                }
            }
        }
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

    /// Visits the rows of the hit voxels in Morton order, each in its one form, with the base of its times and the votes
    /// for other classes than the main one.
    pub(super) fn for_each_row(&self, layers: &Layers, mut visit: impl FnMut(&Row, i64, &[ClassVotes])) {
        let mut row = Row::default();
        for (number, place) in places(self.mask).enumerate() {
            self.rows.read(number, &mut row);
            if self.others.is_empty() || row.0[OUTVOTED] == 0 {
                visit(&row, self.base(), &[]);
                continue;
            }
            let made = row.to_layers(self.base(), layers, self.others_of(place));
            let row = Row::of(&made, self.base(), layers);
            let mut others = made.classes;
            others.retain(|votes| Some(votes.class) != row.main_class());
            visit(&row, self.base(), &others);
        }
    }

    fn insert(&mut self, place: usize, row: &Row) {
        self.rows.insert(self.rank(place), row);
        self.note(place);
    }

    /// Notes that a voxel has a row.
    fn note(&mut self, place: usize) {
        add_to_mask(&mut self.mask, place);
        self.before[place / 64 + 1..].iter_mut().for_each(|before| *before += 1);
    }

    fn number_of(&self, place: usize) -> Option<usize> {
        is_in_mask(&self.mask, place).then(|| self.rank(place))
    }

    /// Number of hit voxels before a position.
    #[inline]
    fn rank(&self, place: usize) -> usize {
        let (word, bit) = (place / 64, place % 64);
        let in_word = (self.mask[word] & ((1 << bit) - 1)).count_ones();
        usize::from(self.before[word]) + in_word as usize
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

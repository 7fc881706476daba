use super::brick::Brick;
use super::brick_directory::Address;
use super::brick_table::Table;
use super::brick_update::Rest;
use super::miss_runs::MissRuns;
use crate::scan::{BrickRuns, BrickUpdate, OrderedUpdates, Run, TileRuns, TileUpdates};
use crate::sensor::{Evidence, Observation, SensorModel};
use crate::space::{BrickCode, MortonCode, VoxelIndex, VoxelKey, place_of_voxel};

/// Number of bricks that are updated together, stage by stage.
const GROUP_SIZE: usize = 16;

impl Table {
    /// Applies updates of any form; `first` is the tile's lowest voxel.
    pub fn apply(&mut self, model: &SensorModel, first: VoxelIndex, updates: &TileUpdates) {
        match updates {
            TileUpdates::Masks(bricks) => self.update_bricks(model, bricks),
            TileUpdates::Runs(runs) => self.update_runs(model, runs),
            TileUpdates::Ordered(updates) => self.update_in_order(model, first, updates),
            TileUpdates::Packed(packed) => {
                packed.iter().for_each(|updates| self.apply(model, first, &updates));
            }
            TileUpdates::Layers(hits) => self.add_hits(first, hits),
            TileUpdates::WithLayers(updates, hits) => {
                self.apply(model, first, updates);
                self.add_hits(first, hits);
            }
        }
    }

    /// Applies the update of one brick, in insertion per scan.
    pub fn update_brick(&mut self, model: &SensorModel, update: &BrickUpdate) {
        self.update_bricks(model, std::slice::from_ref(update));
    }

    /// Applies the updates of bricks, in insertion per scan.
    ///
    /// Bricks are scattered in memory, so each stage of an update is executed for several bricks before the next stage:
    /// the CPU then waits for the cache lines of many bricks at once.
    pub fn update_bricks(&mut self, model: &SensorModel, updates: &[BrickUpdate]) {
        self.palette.use_model(model);
        let mut numbers = [None; GROUP_SIZE];
        for updates in updates.chunks(GROUP_SIZE) {
            for (number, update) in numbers.iter_mut().zip(updates) {
                let is_empty = (0..8).fold(0, |all, word| all | update.hits[word] | update.misses[word]) == 0;
                *number = (!is_empty).then(|| self.number_of(update.brick));
            }
            let present = numbers[..updates.len()].iter().flatten();
            present.clone().for_each(|&number| self.bricks[number].prefetch_storage());
            present.clone().for_each(|&number| self.bricks[number].prefetch_cells());
            for (number, update) in numbers.iter().zip(updates) {
                if let Some(number) = *number {
                    self.update_rest(number, &mut Rest::of(update));
                }
            }
        }
    }

    /// Applies runs of updates of bricks, in insertion per ray. Works in stages, as [`Table::update_bricks`] does.
    pub fn update_runs(&mut self, model: &SensorModel, runs: &TileRuns) {
        self.palette.use_model(model);
        let mut known = MissRuns::new();
        let mut bricks = runs.bricks().peekable();
        let mut some = Vec::with_capacity(GROUP_SIZE);
        while bricks.peek().is_some() {
            some.clear();
            some.extend(bricks.by_ref().take(GROUP_SIZE).map(|runs| (self.number_of(runs.brick), runs)));
            some.iter().for_each(|&(number, _)| self.bricks[number].prefetch_storage());
            some.iter().for_each(|&(number, _)| self.bricks[number].prefetch_cells());
            some.iter().for_each(|&(number, runs)| self.update_runs_at(number, runs, &mut known));
        }
    }

    /// Applies runs of updates of one brick, in insertion per ray.
    pub fn update_runs_of_brick(&mut self, model: &SensorModel, runs: BrickRuns<'_>) {
        self.palette.use_model(model);
        let number = self.number_of(runs.brick);
        self.update_runs_at(number, runs, &mut MissRuns::new());
    }

    fn update_runs_at(&mut self, number: usize, mut left: BrickRuns<'_>, known: &mut MissRuns) {
        loop {
            let brick = &mut self.bricks[number];
            let (bytes, bound) = (brick.heap_bytes(), brick.bound());
            self.len += brick.update_runs(&mut left, &mut self.palette, known);
            self.cell_bytes += brick.heap_bytes() - bytes;
            self.note_raised(number, bound);
            let Some(run) = left.take_first() else { return };
            let renumberings = self.palette.renumberings();
            self.update_run(number, run);
            if self.palette.renumberings() != renumberings {
                known.clear();
            }
        }
    }

    /// Applies the updates of a run one by one.
    fn update_run(&mut self, number: usize, run: Run) {
        let hit = run.hit.map(Observation::Hit);
        for observation in std::iter::repeat_n(Observation::Miss, run.misses.into()).chain(hit) {
            self.step(number, run.place.into(), observation);
        }
    }

    /// Applies one update of one voxel.
    pub fn update(&mut self, model: &SensorModel, code: MortonCode, observation: Observation) {
        self.palette.use_model(model);
        let number = self.number_of(code.brick());
        self.update_rest(number, &mut Rest::of_voxel(code.place_in_brick(), &observation));
    }

    /// Applies updates of single voxels in their order; `first` is the tile's lowest voxel.
    pub fn update_in_order(&mut self, model: &SensorModel, first: VoxelIndex, updates: &OrderedUpdates) {
        self.update_each(model, first, updates, |_, _, _| {});
    }

    /// Like [`Table::update_in_order`]; passes each update's voxel and resulting log-odds to `visit`.
    pub(crate) fn update_in_order_with(
        &mut self,
        model: &SensorModel,
        first: VoxelIndex,
        updates: &OrderedUpdates,
        mut tell: impl FnMut(MortonCode, f64),
    ) {
        self.update_each(model, first, updates, |table, number, place| {
            let brick = &table.bricks[number];
            if let Some(evidence) = brick.get(place, &table.palette) {
                tell(brick.code().voxel(place), evidence.log_odds);
            }
        });
    }

    /// Applies updates of single voxels in their order; passes the brick's number and the position to `visit` after
    /// each.
    fn update_each(
        &mut self,
        model: &SensorModel,
        first: VoxelIndex,
        updates: &OrderedUpdates,
        mut visit: impl FnMut(&Self, usize, usize),
    ) {
        self.palette.use_model(model);
        let first = VoxelKey::from_index(first).0;
        // Cache of brick numbers: rays visit the same few bricks repeatedly. Bricks close to each other have different
        // entries.
        let mut recent = [(u64::MAX, 0); 512];
        for (offset, observation) in updates.iter() {
            let key: [u16; 3] = std::array::from_fn(|k| first[k].wrapping_add(offset[k] as u16));
            let [x, y, z] = key.map(|k| u64::from(k / 8));
            let entry = &mut recent[(x & 7 | (y & 7) << 3 | (z & 7) << 6) as usize];
            let brick = x | y << 16 | z << 32;
            if entry.0 != brick {
                *entry = (brick, self.number_of(VoxelKey(key).morton().brick()));
            }
            let (number, place) = (entry.1, place_of_voxel(key.map(i32::from)));
            self.step(number, place, observation);
            visit(self, number, place);
        }
    }

    /// Applies one update of a voxel of a brick.
    #[inline]
    fn step(&mut self, number: usize, place: usize, observation: Observation) {
        let bound = self.bricks[number].bound();
        match self.bricks[number].update_one(place, observation, &mut self.palette) {
            Some(is_new) => {
                self.len += usize::from(is_new);
                self.note_raised(number, bound);
            }
            None => self.update_rest(number, &mut Rest::of_voxel(place, &observation)),
        }
    }

    /// Inserts voxels of a brick that were not observed before, in Morton order, as position and evidence.
    pub fn insert(&mut self, brick: BrickCode, mut voxels: &[(usize, Evidence)]) {
        if voxels.is_empty() {
            return;
        }
        let number = self.number_of(brick);
        loop {
            let brick = &mut self.bricks[number];
            let (bytes, bound) = (brick.heap_bytes(), brick.bound());
            let done = brick.insert(voxels, &mut self.palette);
            self.len += done;
            self.cell_bytes += brick.heap_bytes() - bytes;
            self.note_raised(number, bound);
            voxels = &voxels[done..];
            if voxels.is_empty() {
                return;
            }
            self.make_room_for(number);
        }
    }

    /// Adds an absent brick, with state numbers of this palette.
    pub(crate) fn add_brick(&mut self, mut brick: Brick) {
        brick.note_max(&self.palette);
        let number = self.number_of(brick.code());
        self.len += brick.observed.iter().map(|word| word.count_ones() as usize).sum::<usize>();
        self.cell_bytes += brick.heap_bytes();
        self.bricks[number] = brick;
        self.note_raised(number, f32::NEG_INFINITY);
    }

    /// Number of a brick; creates the brick if it is absent.
    fn number_of(&mut self, code: BrickCode) -> usize {
        let number = self.directory.entry(Address::of_brick(code));
        if *number == 0 {
            if self.bricks.len() == self.bricks.capacity() {
                // Less slack than the default growth of a vector.
                self.bricks.reserve_exact((self.bricks.len() / 4).max(4));
            }
            self.bricks.push(Brick::new(code));
            *number = self.bricks.len() as u32;
        }
        *number as usize - 1
    }

    fn update_rest(&mut self, number: usize, rest: &mut Rest<'_>) {
        loop {
            let brick = &mut self.bricks[number];
            let (bytes, bound) = (brick.heap_bytes(), brick.bound());
            let (new, done) = brick.update(rest, &mut self.palette);
            self.len += new;
            self.cell_bytes += brick.heap_bytes() - bytes;
            self.note_raised(number, bound);
            match done {
                Ok(()) => return,
                Err(_) => self.make_room_for(number),
            }
        }
    }

    /// Makes new states possible for a brick when the palette is full: drops unused states or, if that is not enough,
    /// stores the brick's evidence without the palette.
    #[cold]
    fn make_room_for(&mut self, number: usize) {
        // At the largest limit, search for unused states only after an eighth of the bricks has stopped using the
        // palette, so that the searches take little time per brick.
        if self.palette.can_grow() || self.made_plain * 8 >= self.bricks.len() {
            let mut in_use = vec![false; self.palette.len()];
            self.bricks.iter().for_each(|brick| brick.mark_states(&mut in_use));
            let numbers = self.palette.retain(&in_use);
            self.bricks.iter_mut().for_each(|brick| brick.renumber_states(&numbers));
            self.made_plain = 0;
            if self.palette.has_room() {
                return;
            }
        }
        let brick = &mut self.bricks[number];
        self.cell_bytes -= brick.heap_bytes();
        brick.make_plain(&self.palette);
        self.cell_bytes += brick.heap_bytes();
        self.made_plain += 1;
    }
}

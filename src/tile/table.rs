use super::brick::{Brick, Rest};
use super::palette::Palette;
use crate::scan::{BrickRuns, BrickUpdate, OrderedUpdates};
use crate::sensor::{Evidence, Observation, SensorModel};
use crate::space::{BrickCode, BrickMask, MortonCode, VoxelIndex, VoxelKey, place_of_voxel, places};
use rustc_hash::FxHashMap;

/// The exact evidence of every observed voxel of a tile: the truth, from which all else is derived.
///
/// Laid out in bricks of 8 x 8 x 8 voxels, in which a voxel is the number of its state in the tile's palette: four
/// to five bytes an observed voxel, all things counted. Where a palette holds too few of the states (intensities
/// that never repeat), bricks keep the evidence itself.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// In order of their first update.
    bricks: Vec<Brick>,
    numbers: FxHashMap<BrickCode, u32>,
    palette: Palette,
    len: usize,
    /// Bytes of the bricks' cells; all else is added in [`Table::bytes`].
    cell_bytes: usize,
    /// Bricks made plain since the palette's states were last looked through.
    made_plain: usize,
}

impl Table {
    /// Number of observed voxels.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether no voxel was observed.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        // A slot of the hash map and its control byte; the map fills up to 7 of 8 slots.
        let slot = size_of::<(BrickCode, u32)>() + 1;
        self.bricks.capacity() * size_of::<Brick>()
            + self.numbers.capacity() * 8 / 7 * slot
            + self.palette.bytes()
            + self.cell_bytes
    }

    /// The evidence of a voxel; `None` if it was never observed.
    pub fn get(&self, code: MortonCode) -> Option<Evidence> {
        self.brick(code.brick())?.get(code.place_in_brick(), &self.palette)
    }

    /// Whether any voxel of a brick was observed.
    pub fn has_brick(&self, brick: BrickCode) -> bool {
        self.numbers.contains_key(&brick)
    }

    /// Applies what one scan says about one brick.
    pub fn update_brick(&mut self, model: &SensorModel, update: &BrickUpdate) {
        self.palette.use_model(model);
        let mut rest = Rest::of(update);
        if update.hits != [0; 8] || update.misses != [0; 8] {
            let number = self.number_of(update.brick);
            self.update_rest(number, &mut rest);
        }
    }

    /// Applies what the rays of a scan say about one brick, where every ray counts.
    pub fn update_runs(&mut self, model: &SensorModel, updates: &BrickRuns) {
        self.palette.use_model(model);
        let number = self.number_of(updates.brick);
        for run in &updates.runs {
            let hit = run.hit.map(Observation::Hit);
            for observation in std::iter::repeat_n(Observation::Miss, run.misses.into()).chain(hit) {
                self.step(number, run.place.into(), observation);
            }
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
        self.palette.use_model(model);
        let first = VoxelKey::from_index(first).0;
        // Rays fan out through the same few bricks again and again: those near each other have each their entry.
        let mut recent = [(u64::MAX, 0); 512];
        for (offset, observation) in updates.iter() {
            let key: [u16; 3] = std::array::from_fn(|k| first[k].wrapping_add(offset[k] as u16));
            let [x, y, z] = key.map(|k| u64::from(k / 8));
            let entry = &mut recent[(x & 7 | (y & 7) << 3 | (z & 7) << 6) as usize];
            let brick = x | y << 16 | z << 32;
            if entry.0 != brick {
                *entry = (brick, self.number_of(VoxelKey(key).morton().brick()));
            }
            self.step(entry.1, place_of_voxel(key.map(i32::from)), observation);
        }
    }

    /// Applies one update of a voxel of a brick.
    #[inline]
    fn step(&mut self, number: usize, place: usize, observation: Observation) {
        match self.bricks[number].update_one(place, observation, &mut self.palette) {
            Some(is_new) => self.len += usize::from(is_new),
            None => self.update_rest(number, &mut Rest::of_voxel(place, &observation)),
        }
    }

    /// Sets voxels of a brick, in Morton order, none of which was observed before: place and evidence.
    pub fn insert(&mut self, brick: BrickCode, mut voxels: &[(usize, Evidence)]) {
        if voxels.is_empty() {
            return;
        }
        let number = self.number_of(brick);
        loop {
            let brick = &mut self.bricks[number];
            let bytes = brick.heap_bytes();
            let done = brick.insert(voxels, &mut self.palette);
            self.len += done;
            self.cell_bytes += brick.heap_bytes() - bytes;
            voxels = &voxels[done..];
            if voxels.is_empty() {
                return;
            }
            self.make_room_for(number);
        }
    }

    /// The bricks that hold an observed voxel, in Morton order.
    pub fn bricks(&self) -> impl Iterator<Item = BrickCode> {
        self.bricks_in_order().map(Brick::code)
    }

    /// The observed voxels of one brick, in Morton order.
    pub fn voxels_of_brick(&self, brick: BrickCode) -> impl Iterator<Item = (MortonCode, Evidence)> {
        self.brick(brick).into_iter().flat_map(|brick| self.voxels_in(brick))
    }

    /// The observed voxels among those of a mask, in Morton order.
    pub fn voxels_of_mask(
        &self,
        brick: BrickCode,
        mask: BrickMask,
    ) -> impl Iterator<Item = (MortonCode, Evidence)> {
        let found = self.brick(brick).into_iter();
        found.flat_map(move |found| {
            places(mask).filter_map(move |place| Some((brick.voxel(place), found.get(place, &self.palette)?)))
        })
    }

    /// The observed voxels in Morton order.
    pub fn iter(&self) -> impl Iterator<Item = (MortonCode, Evidence)> {
        self.bricks_in_order().flat_map(|brick| self.voxels_in(brick))
    }

    fn voxels_in<'a>(&'a self, brick: &'a Brick) -> impl Iterator<Item = (MortonCode, Evidence)> {
        brick.iter(&self.palette).map(|(place, evidence)| (brick.code().voxel(place), evidence))
    }

    fn bricks_in_order(&self) -> impl Iterator<Item = &Brick> {
        let mut codes: Vec<_> = self.numbers.iter().map(|(&code, &number)| (code, number)).collect();
        codes.sort_unstable();
        codes.into_iter().map(|(_, number)| &self.bricks[number as usize])
    }

    fn brick(&self, code: BrickCode) -> Option<&Brick> {
        self.numbers.get(&code).map(|&number| &self.bricks[number as usize])
    }

    /// The number of a brick, which is made if it is not there.
    fn number_of(&mut self, code: BrickCode) -> usize {
        let number = *self.numbers.entry(code).or_insert_with(|| {
            if self.bricks.len() == self.bricks.capacity() {
                // Less slack than a vector gives by itself.
                self.bricks.reserve_exact((self.bricks.len() / 4).max(4));
            }
            self.bricks.push(Brick::new(code));
            (self.bricks.len() - 1) as u32
        });
        number as usize
    }

    fn update_rest(&mut self, number: usize, rest: &mut Rest<'_>) {
        loop {
            let brick = &mut self.bricks[number];
            let bytes = brick.heap_bytes();
            let (new, done) = brick.update(rest, &mut self.palette);
            self.len += new;
            self.cell_bytes += brick.heap_bytes() - bytes;
            match done {
                Ok(()) => return,
                Err(_) => self.make_room_for(number),
            }
        }
    }

    /// Sees to it that a brick can take states that the full palette does not have: drops states no longer in use,
    /// or else lets the brick do without the palette.
    #[cold]
    fn make_room_for(&mut self, number: usize) {
        // At its largest, the palette is looked through again only when enough bricks have left it, so that the
        // effort stays in proportion.
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

    #[cfg(test)]
    pub(super) fn with_palette(palette: Palette) -> Self {
        Self { palette, ..Self::default() }
    }

    /// What [`Table::bytes`] must be, counted anew.
    #[cfg(test)]
    pub(super) fn counted_bytes(&self) -> usize {
        self.bytes() - self.cell_bytes + self.bricks.iter().map(Brick::heap_bytes).sum::<usize>()
    }
}

use super::map::{LocalMap, is_known_free};
use super::page_table::PageTable;
use super::parameters::LocalParameters;
use super::place::place_of;
use super::ray_search::RaySearch;
use super::report::LocalReport;
use super::voxels::Voxel;
use voxtile::maths::logit;
use voxtile::scan::MAX_RAY_STEPS;
use voxtile::space::{Grid, Point, VoxelIndex};

/// Evidence of the current scan (the task buffers of the paper by La, Kang and Lee).
#[derive(Debug, Default)]
pub(super) struct Frame {
    /// Voxels with evidence, in order of arrival.
    touches: Vec<Touch>,
    /// Points in the world frame, if the scan does not provide them in this form.
    pub(super) points: Vec<Point>,
    /// Indices of the points that are not skipped.
    counting: Vec<u32>,
    pages: PageTable,
}

/// Evidence of the current scan for one voxel.
#[derive(Clone, Copy, Debug)]
struct Touch {
    voxel: u32,
    hits: u32,
    misses: u32,
    /// Whether the voxel is new in the map (`B_new` in the paper) or existed before (`B_keep`).
    is_new: bool,
    is_free: bool,
}

impl Frame {
    pub(super) fn bytes(&self) -> usize {
        self.touches.capacity() * size_of::<Touch>()
            + self.points.capacity() * size_of::<Point>()
            + self.counting.capacity() * size_of::<u32>()
            + self.pages.bytes()
    }

    /// Returns the evidence of this scan for a voxel, creating it if necessary.
    #[inline]
    fn touch(&mut self, id: u32, voxel: &mut Voxel) -> &mut Touch {
        let number = voxel.touch().unwrap_or_else(|| {
            let number = self.touches.len() as u32;
            voxel.set_touch(Some(number));
            self.touches.push(Touch { voxel: id, hits: 0, misses: 0, is_new: false, is_free: false });
            number
        });
        &mut self.touches[number as usize]
    }
}

/// Stages of an update before the inflation. Algorithms and equations are those of the paper by La, Kang and Lee.
impl LocalMap {
    /// Input update (Algorithm 1, lines 2 to 19): adds a hit to the voxel of each point that is not skipped.
    pub(super) fn take_hits(
        &mut self,
        origin: Point,
        start: VoxelIndex,
        points: &[Point],
        report: &mut LocalReport,
    ) {
        self.frame.counting.clear();
        // The last block is remembered, because neighbouring points are often in the same block.
        let mut last_block = None;
        for (number, &point) in points.iter().enumerate() {
            let Some(voxel) = self.voxel_of_used_point(origin, start, point, report) else { continue };
            self.frame.counting.push(number as u32);
            let index = voxel.map(|k| k >> 2);
            let block = match last_block {
                Some((last_index, block)) if last_index == index => block,
                _ => self.tree.make_block(index, self.inflation.rules.current()),
            };
            last_block = Some((index, block));
            self.hit(block, place_of(voxel));
        }
    }

    fn hit(&mut self, block: u32, place: usize) {
        let known = self.tree.blocks.get(block).voxels.get(&self.tree.lists, place);
        let id = known.unwrap_or_else(|| {
            let initial = logit(self.applied.initial_probability);
            let id = self.voxels.slab.insert(Voxel::new(block, place, initial));
            self.tree.store(block, place, id);
            id
        });
        let touch = self.frame.touch(id, self.voxels.slab.get_mut(id));
        touch.hits += 1;
        touch.is_new |= known.is_none();
    }

    /// Returns the voxel of a point; counts the point and returns `None` if it is skipped.
    fn voxel_of_used_point(
        &self,
        origin: Point,
        start: VoxelIndex,
        point: Point,
        report: &mut LocalReport,
    ) -> Option<VoxelIndex> {
        let LocalParameters { min_input_range_m, input_range_m, .. } = self.applied;
        let skipped = &mut report.skipped;
        let [x, y, z]: Point = std::array::from_fn(|k| point[k] - origin[k]);
        let squared = x * x + y * y + z * z;
        let voxel = self.voxel_of(point);
        let steps = |voxel: VoxelIndex| (0..3).map(|k| u64::from(start[k].abs_diff(voxel[k]))).sum::<u64>();
        let counter = match voxel {
            _ if !point.iter().all(|x| x.is_finite()) => &mut skipped.not_finite,
            _ if point == origin => &mut skipped.no_return,
            _ if squared > input_range_m * input_range_m => &mut report.beyond_input_range,
            None => &mut skipped.out_of_range,
            _ if squared < min_input_range_m * min_input_range_m => &mut skipped.too_near,
            Some(voxel) if steps(voxel) > MAX_RAY_STEPS => &mut skipped.ray_too_long,
            Some(voxel) => return Some(voxel),
        };
        *counter += 1;
        None
    }

    /// Ray casting (Algorithm 1, line 20): adds a miss to each stored voxel on a ray.
    ///
    /// Runs after all hits, so that the result does not depend on the order of the points.
    pub(super) fn take_misses(&mut self, origin: Point, start: VoxelIndex, points: &[Point]) {
        let Self { grid, tree, voxels, frame, .. } = self;
        let origin = grid.to_voxel_units(origin);
        frame.pages.refill(tree);
        let (counting, pages) = (std::mem::take(&mut frame.counting), std::mem::take(&mut frame.pages));
        for &number in &counting {
            let end = grid.to_voxel_units(points[number as usize]);
            let Some(last) = Grid::voxel_of_units(end) else { continue };
            RaySearch::new(origin, start, end, last).for_each_stored(tree, &pages, end, |id| {
                frame.touch(id, voxels.slab.get_mut(id)).misses += 1;
            });
        }
        (frame.counting, frame.pages) = (counting, pages);
    }

    /// Occupancy check (equations 2 and 3): sums the evidence of each voxel, clamps it and sets the state.
    pub(super) fn check_occupancy(&mut self) {
        let LocalParameters { log_odds, occupied_log_odds, .. } = self.applied;
        for touch in &mut self.frame.touches {
            let voxel = self.voxels.slab.get_mut(touch.voxel);
            let sum = f64::from(touch.hits) * log_odds.hit + f64::from(touch.misses) * log_odds.miss;
            voxel.log_odds = (voxel.log_odds + sum).clamp(log_odds.min, log_odds.max);
            voxel.set_touch(None);
            touch.is_free = is_known_free(&self.applied, voxel.log_odds);
            let (block, place) = voxel.home();
            let is_occupied = voxel.log_odds >= occupied_log_odds;
            if self.tree.set_occupied(block, place, is_occupied) {
                self.inflation.wait(&mut self.tree, block);
            }
        }
    }

    /// Sequential removal (Algorithm 3): moves updated voxels to the end of the history. Removes voxels known to be
    /// free, and the oldest ones above the limit.
    pub(super) fn manage_history(&mut self, report: &mut LocalReport) {
        let touches = std::mem::take(&mut self.frame.touches);
        report.updated = touches.len() as u64;
        let (new, kept) = (|touch: &&Touch| touch.is_new, |touch: &&Touch| !touch.is_new);
        report.new = touches.iter().filter(new).count() as u64;
        for touch in touches.iter().filter(new).chain(touches.iter().filter(kept)) {
            if !touch.is_new {
                self.voxels.unlink(touch.voxel);
            }
            if touch.is_free {
                self.remove(touch.voxel);
                report.freed += 1;
            } else {
                self.voxels.push_newest(touch.voxel);
            }
        }
        self.frame.touches = touches;
        self.frame.touches.clear();
        // Every new voxel may displace an old one. Beyond that, the number of removals is limited: a lowered limit is
        // applied over several updates.
        let most = self.applied.work_per_update.saturating_add(report.new as usize);
        for _ in 0..most {
            let Some(oldest) = self.voxels.oldest().filter(|_| self.is_over_limit()) else { break };
            self.voxels.unlink(oldest);
            self.remove(oldest);
            report.forgotten += 1;
        }
    }

    /// Removes a voxel that has left the history from the occupancy map, and its inflation with it.
    pub(super) fn remove(&mut self, id: u32) {
        let (block, place) = self.voxels.slab.get(id).home();
        self.tree.unstore(block, place);
        if self.tree.set_occupied(block, place, false) {
            self.inflation.wait(&mut self.tree, block);
        }
        self.inflation.may_be_empty(block);
        self.voxels.slab.remove(id);
    }
}

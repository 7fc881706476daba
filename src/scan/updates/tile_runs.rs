use crate::space::BrickCode;

/// Updates of voxels of one tile, any number per voxel: runs by brick.
///
/// The runs of all bricks are in two lists. Most bricks have few runs, and a list for each would take longer to create
/// than to apply.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileRuns {
    /// In Morton order; a brick may occur several times, its earlier runs first.
    bricks: Vec<BrickEnd>,
    runs: Vec<Run>,
    misses: Vec<Misses>,
}

/// End of the runs of a brick; they begin at the end of the previous brick's runs.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BrickEnd {
    brick: BrickCode,
    runs: usize,
    misses: usize,
}

/// Updates of voxels of one brick, any number per voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrickRuns<'a> {
    /// Code of the brick.
    pub brick: BrickCode,
    /// Runs; those of one voxel are in order.
    pub runs: &'a [Run],
    /// Misses that follow the runs, at most once per voxel, in Morton order.
    pub misses: &'a [Misses],
}

/// Consecutive updates of one voxel: misses, then a hit or nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// The voxel's position in its brick's Morton order.
    pub place: u16,
    /// Number of misses before the hit.
    pub misses: u16,
    /// Hit after the misses, if any: its intensity, which some sensor models use.
    pub hit: Option<f32>,
}

/// Misses of one voxel: a run without a hit that takes a third of the memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Misses {
    /// The voxel's position in its brick's Morton order.
    pub place: u16,
    /// Number of misses.
    pub misses: u16,
}

impl Run {
    /// Number of updates.
    pub fn len(&self) -> usize {
        usize::from(self.misses) + usize::from(self.hit.is_some())
    }

    /// Returns whether there is no update.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl From<Misses> for Run {
    fn from(Misses { place, misses }: Misses) -> Self {
        Self { place, misses, hit: None }
    }
}

impl<'a> BrickRuns<'a> {
    /// All updates as runs; those of one voxel are in order.
    pub fn iter(&self) -> impl Iterator<Item = Run> + use<'a> {
        self.runs.iter().copied().chain(self.misses.iter().copied().map(Run::from))
    }

    pub(crate) fn take_first(&mut self) -> Option<Run> {
        if let Some((run, later)) = self.runs.split_first() {
            self.runs = later;
            return Some(*run);
        }
        let (misses, later) = self.misses.split_first()?;
        self.misses = later;
        Some((*misses).into())
    }
}

impl TileRuns {
    /// Appends the runs of a brick that does not precede the last one in Morton order.
    pub fn push(&mut self, BrickRuns { brick, runs, misses }: BrickRuns<'_>) {
        self.runs.extend_from_slice(runs);
        self.misses.extend_from_slice(misses);
        self.bricks.push(BrickEnd { brick, runs: self.runs.len(), misses: self.misses.len() });
    }

    /// Merges the runs of several parts of the rays, given in the order of the rays.
    pub(crate) fn merged(mut parts: Vec<Self>) -> Self {
        if parts.len() == 1 {
            return parts.remove(0);
        }
        let mut bricks: Vec<BrickRuns<'_>> = parts.iter().flat_map(Self::bricks).collect();
        // The sort is stable, so that runs of earlier parts remain first in a brick.
        bricks.sort_by_key(|runs| runs.brick);
        let mut merged = Self::default();
        bricks.into_iter().for_each(|runs| merged.push(runs));
        merged
    }

    /// The runs of each brick, in order.
    pub fn bricks(&self) -> impl Iterator<Item = BrickRuns<'_>> {
        let (mut runs, mut misses) = (&self.runs[..], &self.misses[..]);
        let (mut first_run, mut first_miss) = (0, 0);
        self.bricks.iter().map(move |end| {
            let (of_brick, later) = runs.split_at(end.runs - std::mem::replace(&mut first_run, end.runs));
            runs = later;
            let (passed, later) =
                misses.split_at(end.misses - std::mem::replace(&mut first_miss, end.misses));
            misses = later;
            BrickRuns { brick: end.brick, runs: of_brick, misses: passed }
        })
    }

    /// Number of bricks; a brick that occurs several times is counted as often.
    pub fn brick_count(&self) -> usize {
        self.bricks.len()
    }

    /// Number of updates.
    pub fn len(&self) -> usize {
        let (hits, misses) = self.hits_and_misses();
        (hits + misses) as usize
    }

    /// Returns whether there is no update.
    pub fn is_empty(&self) -> bool {
        self.runs.iter().all(Run::is_empty) && self.misses.iter().all(|passed| passed.misses == 0)
    }

    pub(crate) fn hits_and_misses(&self) -> (u64, u64) {
        let hits = self.runs.iter().filter(|run| run.hit.is_some()).count() as u64;
        let before_hits: u64 = self.runs.iter().map(|run| u64::from(run.misses)).sum();
        (hits, before_hits + self.misses.iter().map(|passed| u64::from(passed.misses)).sum::<u64>())
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        self.bricks.capacity() * size_of::<BrickEnd>()
            + self.runs.capacity() * size_of::<Run>()
            + self.misses.capacity() * size_of::<Misses>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_are_returned_as_pushed() {
        let run = |place, hit| Run { place, misses: 3, hit };
        let (hit, missed) = ([run(5, Some(2.0)), run(5, None)], [Misses { place: 5, misses: 7 }]);
        let bricks = [(3, &hit[..], &missed[..]), (3, &[], &[]), (8, &hit[..1], &[]), (9, &[], &missed)];
        let bricks = bricks.map(|(code, runs, misses)| BrickRuns { brick: BrickCode(code), runs, misses });
        let mut runs = TileRuns::default();
        bricks.into_iter().for_each(|brick| runs.push(brick));
        assert_eq!(runs.bricks().collect::<Vec<_>>(), bricks);
        assert_eq!((runs.hits_and_misses(), runs.len(), runs.is_empty()), ((2, 23), 25, false));
        assert_eq!(bricks[0].iter().collect::<Vec<_>>(), [hit[0], hit[1], run(5, None).with(7)]);
    }

    #[test]
    fn merged_parts_keep_earlier_runs_of_a_brick_first() {
        let part = |codes: &[u64], misses| {
            let mut part = TileRuns::default();
            for &code in codes {
                let misses = [Misses { place: 1, misses }];
                part.push(BrickRuns { brick: BrickCode(code), runs: &[], misses: &misses });
            }
            part
        };
        let merged = TileRuns::merged(vec![part(&[2, 9], 1), part(&[1, 2, 5], 2), part(&[2], 3)]);
        let found: Vec<_> = merged.bricks().map(|brick| (brick.brick.0, brick.misses[0].misses)).collect();
        assert_eq!(found, [(1, 2), (2, 1), (2, 2), (2, 3), (5, 2), (9, 1)]);
        assert!(TileRuns::merged(Vec::new()).is_empty());
    }

    impl Run {
        fn with(self, misses: u16) -> Self {
            Self { misses, ..self }
        }
    }
}

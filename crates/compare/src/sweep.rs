use crate::blocks::BlockIndex;
use rayon::prelude::*;
use voxtile::Result;
use voxtile::scan::Stop;

/// Memory of a block and of the tiles around it in both maps, about.
const BLOCK_BYTES: usize = 32 << 20;

/// Work on blocks in batches: each batch is loaded, then worked on by all cores, and the results are taken in order.
pub(crate) struct Sweep<'a> {
    pub(crate) blocks: &'a [BlockIndex],
    pub(crate) memory_bytes: usize,
    pub(crate) stop: &'a Stop,
    /// Receives the number of blocks done and in total.
    pub(crate) progress: &'a (dyn Fn(u64, u64) + Sync),
}

impl Sweep<'_> {
    /// Does the work.
    ///
    /// # Errors
    ///
    /// Errors of the closures, or a request to stop.
    pub(crate) fn run<L: Sync, T: Send>(
        &self,
        mut load: impl FnMut(&[BlockIndex]) -> Result<L>,
        work: impl Fn(BlockIndex, &L) -> Result<T> + Sync,
        mut take: impl FnMut(BlockIndex, T) -> Result<()>,
    ) -> Result<()> {
        let most = (2 * rayon::current_num_threads()).max(1);
        let together = (self.memory_bytes / BLOCK_BYTES).clamp(1, most);
        let all = self.blocks.len() as u64;
        (self.progress)(0, all);
        let mut done = 0;
        for blocks in self.blocks.chunks(together) {
            self.stop.check()?;
            let loaded = load(blocks)?;
            let results: Vec<Result<T>> = blocks.par_iter().map(|&block| work(block, &loaded)).collect();
            for (&block, result) in blocks.iter().zip(results) {
                take(block, result?)?;
            }
            done += blocks.len() as u64;
            (self.progress)(done, all);
        }
        Ok(())
    }
}

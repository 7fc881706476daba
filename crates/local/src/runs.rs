/// Allocator of runs of equal length, addressed by number. It over-allocates by an eighth at most.
#[derive(Clone, Debug)]
pub(super) struct Runs<T> {
    values: Vec<T>,
    free: Vec<u32>,
}

impl<T> Default for Runs<T> {
    fn default() -> Self {
        Self { values: Vec::new(), free: Vec::new() }
    }
}

impl<T: Copy + Default> Runs<T> {
    /// Allocates an uninitialised run of `len` values and returns its number.
    pub(super) fn take(&mut self, len: usize) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            let used = self.values.len();
            // The capacity grows by an eighth. Doubling would leave a third of it unused on average.
            if self.values.capacity() < used + len {
                self.values.reserve_exact(used / 8 + 1024);
            }
            self.values.resize(used + len, T::default());
            (used / len) as u32
        })
    }

    /// Frees a run.
    pub(super) fn give(&mut self, run: u32) {
        self.free.push(run);
    }

    #[inline]
    pub(super) fn get(&self, run: u32, len: usize) -> &[T] {
        &self.values[run as usize * len..][..len]
    }

    #[inline]
    pub(super) fn get_mut(&mut self, run: u32, len: usize) -> &mut [T] {
        &mut self.values[run as usize * len..][..len]
    }

    /// Returns bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.values.capacity() * size_of::<T>() + self.free.capacity() * size_of::<u32>()
    }
}

/// Values addressed by number, stored in chunks. Growing moves no value and wastes less than a chunk.
#[derive(Clone, Debug)]
pub(super) struct Slab<T> {
    chunks: Vec<Box<[T]>>,
    free: Vec<u32>,
    len: u32,
}

const CHUNK: u32 = 1 << 10;

impl<T> Default for Slab<T> {
    fn default() -> Self {
        Self { chunks: Vec::new(), free: Vec::new(), len: 0 }
    }
}

impl<T: Clone + Default> Slab<T> {
    /// Stores a value and returns its number.
    pub(super) fn insert(&mut self, value: T) -> u32 {
        let id = self.free.pop().unwrap_or_else(|| {
            if self.len.is_multiple_of(CHUNK) {
                self.chunks.push(vec![T::default(); CHUNK as usize].into_boxed_slice());
            }
            self.len += 1;
            self.len - 1
        });
        *self.get_mut(id) = value;
        id
    }

    /// Frees a number; its value is dropped when the number is reused.
    pub(super) fn remove(&mut self, id: u32) {
        self.free.push(id);
    }

    #[inline]
    pub(super) fn get(&self, id: u32) -> &T {
        &self.chunks[(id / CHUNK) as usize][(id % CHUNK) as usize]
    }

    #[inline]
    pub(super) fn get_mut(&mut self, id: u32) -> &mut T {
        &mut self.chunks[(id / CHUNK) as usize][(id % CHUNK) as usize]
    }

    /// Returns bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.chunks.len() * (CHUNK as usize * size_of::<T>() + size_of::<Box<[T]>>())
            + self.free.capacity() * size_of::<u32>()
    }
}

/// Bytes on the heap of a hash table for so many entries: it fills up to 7 of 8 slots, each with a byte of its own.
pub fn hash_table_bytes<Entry>(capacity: usize) -> usize {
    capacity * 8 / 7 * (size_of::<Entry>() + 1)
}

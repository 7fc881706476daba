/// Bytes on the heap of a hash table for `capacity` entries: it fills up to 7 of 8 slots, each with one control byte.
pub fn hash_table_bytes<Entry>(capacity: usize) -> usize {
    capacity * 8 / 7 * (size_of::<Entry>() + 1)
}

use super::Result;
use super::sort::{ExternalSort, Sorted, part};
use std::collections::HashMap;
use std::path::Path;

/// Maximum number of columns in memory. Those of a tile of the map are 10,000 by default.
const MAX_COLUMNS: usize = 1 << 18;

/// Bytes of a record: tile and place of the column, then its content.
const RECORD_BYTES: usize = 26;

/// Occupied voxels of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Column {
    /// Highest and lowest index along z.
    pub(super) highest: i32,
    pub(super) lowest: i32,
    /// Number of voxels, and the sum of their indices along z.
    pub(super) count: u32,
    pub(super) sum: i64,
}

/// Columns with occupied voxels, sorted by tile of an image and place in the tile. Memory does not grow with them.
pub(super) struct SortedColumns {
    /// Columns of the map's tiles that are being read, by tile and place.
    current: HashMap<(u32, u16), Column>,
    /// Tile of the map along x and y.
    map_tile: [i32; 2],
    sort: ExternalSort<RECORD_BYTES>,
}

impl Column {
    pub(super) const EMPTY: Self = Self { highest: i32::MIN, lowest: i32::MAX, count: 0, sum: 0 };

    /// Adds the voxels of another part of the same column.
    pub(super) fn add(&mut self, other: &Self) {
        self.highest = self.highest.max(other.highest);
        self.lowest = self.lowest.min(other.lowest);
        self.count = self.count.saturating_add(other.count);
        self.sum = self.sum.saturating_add(other.sum);
    }
}

impl SortedColumns {
    pub(super) fn new(folder: &Path) -> Self {
        Self { current: HashMap::new(), map_tile: [0; 2], sort: ExternalSort::new(folder) }
    }

    /// Adds the voxel with index `z` to a column. Voxels of a map's tile, and of the tiles above it, arrive together.
    pub(super) fn add(&mut self, tile: u32, place: u16, z: i32, map_tile: [i32; 2]) -> Result<()> {
        if map_tile != self.map_tile || self.current.len() >= MAX_COLUMNS {
            self.spill()?;
            self.map_tile = map_tile;
        }
        let voxel = Column { highest: z, lowest: z, count: 1, sum: i64::from(z) };
        self.current.entry((tile, place)).or_insert(Column::EMPTY).add(&voxel);
        Ok(())
    }

    fn spill(&mut self) -> Result<()> {
        for ((tile, place), column) in self.current.drain() {
            let mut record = [0; RECORD_BYTES];
            record[..4].copy_from_slice(&tile.to_be_bytes());
            record[4..6].copy_from_slice(&place.to_be_bytes());
            record[6..10].copy_from_slice(&column.highest.to_le_bytes());
            record[10..14].copy_from_slice(&column.lowest.to_le_bytes());
            record[14..18].copy_from_slice(&column.count.to_le_bytes());
            record[18..].copy_from_slice(&column.sum.to_le_bytes());
            self.sort.push(record)?;
        }
        Ok(())
    }

    /// Returns the columns in order. A column may have several parts, which follow each other.
    pub(super) fn into_parts(mut self) -> Result<ColumnParts> {
        self.spill()?;
        Ok(ColumnParts { sorted: self.sort.into_sorted()? })
    }
}

/// Parts of columns in the order of tiles and places.
pub(super) struct ColumnParts {
    sorted: Sorted<RECORD_BYTES>,
}

impl ColumnParts {
    /// Returns the tile, the place and the voxels of the next part.
    pub(super) fn next(&mut self) -> Result<Option<(u32, u16, Column)>> {
        let Some(record) = self.sorted.next()? else { return Ok(None) };
        let column = Column {
            highest: i32::from_le_bytes(part(&record, 6)),
            lowest: i32::from_le_bytes(part(&record, 10)),
            count: u32::from_le_bytes(part(&record, 14)),
            sum: i64::from_le_bytes(part(&record, 18)),
        };
        Ok(Some((u32::from_be_bytes(part(&record, 0)), u16::from_be_bytes(part(&record, 4)), column)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_column_follow_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let mut columns = SortedColumns::new(folder.path());
        for (tile, place, z, map_tile) in
            [(7, 65_535, -4, 0), (7, 3, 9, 0), (7, 65_535, 5, 0), (2, 8, 1, 1), (7, 65_535, 70_000, 1)]
        {
            columns.add(tile, place, z, [map_tile, -1]).unwrap();
        }
        let mut parts = columns.into_parts().unwrap();
        let found: Vec<_> = std::iter::from_fn(|| parts.next().unwrap()).collect();
        let places: Vec<_> = found.iter().map(|(tile, place, _)| (*tile, *place)).collect();
        assert_eq!(places, [(2, 8), (7, 3), (7, 65_535), (7, 65_535)]);
        let mut whole = Column::EMPTY;
        found[2..].iter().for_each(|(_, _, part)| whole.add(part));
        assert_eq!(whole, Column { highest: 70_000, lowest: -4, count: 3, sum: 70_001 });
    }
}

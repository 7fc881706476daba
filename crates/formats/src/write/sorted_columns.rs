use super::Result;
use super::row::RowLayers;
use super::sort::{ExternalSort, Sorted, part};
use std::collections::HashMap;
use std::path::Path;

/// Maximum number of columns in memory. Those of a tile of the map are 10,000 by default.
const MAX_COLUMNS: usize = 1 << 18;

/// Bytes of a record: tile and place of the column, then its content.
const RECORD_BYTES: usize = 40;

/// Occupied voxels of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Column {
    /// Highest and lowest index along z.
    pub(super) highest: i32,
    pub(super) lowest: i32,
    /// Number of voxels, and the sum of their indices along z.
    pub(super) count: u32,
    pub(super) sum: i64,
    /// Colour, intensity and class of the highest voxel.
    pub(super) top: RowLayers,
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
    pub(super) const EMPTY: Self =
        Self { highest: i32::MIN, lowest: i32::MAX, count: 0, sum: 0, top: RowLayers::NONE };

    /// Creates the column of the voxel with index `z`.
    fn of(z: i32, layers: &RowLayers) -> Self {
        // Others are not stored.
        Self {
            highest: z,
            lowest: z,
            count: 1,
            sum: i64::from(z),
            top: RowLayers { time_ns: None, stored_intensity: None, ..*layers },
        }
    }

    /// Adds the voxels of another part of the same column.
    pub(super) fn add(&mut self, other: &Self) {
        if other.highest > self.highest {
            (self.highest, self.top) = (other.highest, other.top);
        }
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
    pub(super) fn add(
        &mut self,
        tile: u32,
        place: u16,
        z: i32,
        layers: &RowLayers,
        map_tile: [i32; 2],
    ) -> Result<()> {
        if map_tile != self.map_tile || self.current.len() >= MAX_COLUMNS {
            self.spill()?;
            self.map_tile = map_tile;
        }
        self.current.entry((tile, place)).or_insert(Column::EMPTY).add(&Column::of(z, layers));
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
            record[18..26].copy_from_slice(&column.sum.to_le_bytes());
            record[26..].copy_from_slice(&bytes_of(&column.top));
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

/// Encodes colour, intensity and class.
fn bytes_of(layers: &RowLayers) -> [u8; 14] {
    let mut bytes = [0; 14];
    if let Some(colour) = layers.colour {
        bytes[0] = 1;
        bytes[1..4].copy_from_slice(&colour);
    }
    bytes[4..12].copy_from_slice(&layers.intensity.unwrap_or(f64::NAN).to_le_bytes());
    if let Some(class) = layers.class {
        bytes[12..].copy_from_slice(&[1, class]);
    }
    bytes
}

/// Decodes the bytes of [`bytes_of`].
fn layers_of(bytes: &[u8; 14]) -> RowLayers {
    let intensity = f64::from_le_bytes(part(bytes, 4));
    RowLayers {
        colour: (bytes[0] == 1).then(|| part(bytes, 1)),
        intensity: (!intensity.is_nan()).then_some(intensity),
        class: (bytes[12] == 1).then_some(bytes[13]),
        ..RowLayers::NONE
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
            top: layers_of(&part(&record, 26)),
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
        let layers = |z: i32| RowLayers {
            colour: Some([z as u8, 2, 3]),
            intensity: Some(f64::from(z)),
            class: Some(z as u8),
            ..RowLayers::NONE
        };
        for (tile, place, z, map_tile) in
            [(7, 65_535, -4, 0), (7, 3, 9, 0), (7, 65_535, 5, 0), (2, 8, 1, 1), (7, 65_535, 70_000, 1)]
        {
            columns.add(tile, place, z, &layers(z), [map_tile, -1]).unwrap();
        }
        let mut parts = columns.into_parts().unwrap();
        let found: Vec<_> = std::iter::from_fn(|| parts.next().unwrap()).collect();
        let places: Vec<_> = found.iter().map(|(tile, place, _)| (*tile, *place)).collect();
        assert_eq!(places, [(2, 8), (7, 3), (7, 65_535), (7, 65_535)]);
        let mut whole = Column::EMPTY;
        found[2..].iter().for_each(|(_, _, part)| whole.add(part));
        let top = layers(70_000);
        assert_eq!(whole, Column { highest: 70_000, lowest: -4, count: 3, sum: 70_001, top });
        assert_eq!(layers_of(&bytes_of(&RowLayers::NONE)), RowLayers::NONE);
    }
}

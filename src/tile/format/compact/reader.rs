use super::column_reader::ColumnReader;
use super::group_columns::Columns;
use super::group_filter::GroupFilter;
use super::group_reader::{GroupReader, TakeBricks};
use super::head::Head;
use super::input::Input;
use super::table_builder::TableBuilder;
use crate::error::DecodeError;
use crate::space::VoxelBox;
use crate::tile::Table;
use crate::tile::format::gather::FilteredVoxels;
use crate::tile::table::Palette;
use std::io::{self, Read};

/// Reader of tables in compact form. It reuses its buffers: 0.4 MB, and up to 1.5 MB more after a table in which almost
/// every voxel had a state of its own.
pub struct CompactReader {
    column_reader: ColumnReader,
    columns: Columns,
}

impl CompactReader {
    /// Creates a reader.
    ///
    /// # Errors
    ///
    /// Returns errors from zstd.
    pub fn new() -> io::Result<Self> {
        Ok(Self { column_reader: ColumnReader::new()?, columns: Columns::default() })
    }

    /// Reads a table of `bytes` bytes that belongs to the tile of `voxels`. Damaged bytes cannot add voxels outside the
    /// tile, or take more memory than the tile could need.
    ///
    /// # Errors
    ///
    /// Fails if the input violates the format; the error contains the offset of the part. Examples are a wrong magic or
    /// version, inconsistent lengths and counts, bricks out of order or of another tile, duplicate or invalid states,
    /// bytes after the end, a wrong checksum.
    pub fn read(
        &mut self,
        input: &mut impl Read,
        bytes: u64,
        voxels: &VoxelBox,
    ) -> Result<Table, DecodeError> {
        self.read_into(input, bytes, voxels, TableBuilder::new)
    }

    /// Reads all groups into a consumer that is created from the codebook's palette.
    fn read_into<T: TakeBricks>(
        &mut self,
        input: &mut impl Read,
        bytes: u64,
        voxels: &VoxelBox,
        begin: impl FnOnce(Palette) -> T,
    ) -> Result<T::Made, DecodeError> {
        let mut input = Input::of_table(input, bytes)?;
        let Head { header, index, codebook, .. } = Head::read(voxels, &mut self.column_reader, &mut input)?;
        let mut groups = GroupReader::new(&header, voxels, begin(codebook.palette()?));
        let mut read = |groups: &mut GroupReader<'_, T>, announced| {
            groups.read(announced, &mut self.columns, &mut self.column_reader, &mut input)
        };
        match index {
            Some(index) => index.all_announced().try_for_each(|group| read(&mut groups, Some(group)))?,
            None => {
                while !groups.has_all_bricks() {
                    read(&mut groups, None)?;
                }
            }
        }
        groups.check_is_all()?;
        input.end()?;
        Ok(groups.made())
    }
}

/// Reads one table, see [`CompactReader::read`].
///
/// # Errors
///
/// Same errors as [`CompactReader::read`].
pub fn read_compact(input: &mut impl Read, bytes: u64, voxels: &VoxelBox) -> Result<Table, DecodeError> {
    CompactReader::new()?.read(input, bytes, voxels)
}

/// Reads the observed voxels of a table whose log-odds are at least `from`, in Morton order, without building the
/// table.
///
/// # Errors
///
/// Same errors as [`CompactReader::read`].
pub(in crate::tile::format) fn filter_compact(
    input: &mut impl Read,
    bytes: u64,
    voxels: &VoxelBox,
    from: f64,
) -> Result<FilteredVoxels, DecodeError> {
    CompactReader::new()?.read_into(input, bytes, voxels, |palette| GroupFilter::new(palette, from))
}

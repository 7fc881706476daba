use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::{Error, Result};
use ::parquet::basic::{Compression, ZstdLevel};
use ::parquet::data_type::{DataType, DoubleType, FloatType, Int32Type};
use ::parquet::errors::{ParquetError, Result as ParquetResult};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::parser::parse_message_type;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of rows to collect before they are written column by column.
const GROUP_ROWS: usize = 1 << 20;

const SCHEMA: &str = "message voxels {
    required double x; required double y; required double z;
    required double log_odds; required float probability; required int32 count;
    required int32 tile_x; required int32 tile_y; required int32 tile_z;
}";

/// Writer of an Apache Parquet table.
pub(super) struct ParquetSink {
    path: PathBuf,
    writer: SerializedFileWriter<OutFile>,
    rows: Vec<VoxelRow>,
}

impl ParquetSink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        let refused = |error| refused(path, error);
        let schema = parse_message_type(SCHEMA).map_err(refused)?;
        let mut notes = vec![("resolution_m", head.resolution_m.to_string())];
        notes.extend(options.crs.clone().map(|crs| ("crs", crs)));
        let notes = notes.into_iter().map(|(key, value)| KeyValue::new(key.to_owned(), value)).collect();
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(concat!("voxtile-clouds ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_key_value_metadata(Some(notes))
            .build();
        let out = OutFile::create(path)?;
        let writer =
            SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties)).map_err(refused)?;
        Ok(Self { path: path.to_owned(), writer, rows: Vec::new() })
    }

    fn write_group(&mut self) -> Result<()> {
        if !self.rows.is_empty() {
            write_group(&mut self.writer, &self.rows).map_err(|error| refused(&self.path, error))?;
            self.rows.clear();
        }
        Ok(())
    }
}

fn write_group(writer: &mut SerializedFileWriter<OutFile>, rows: &[VoxelRow]) -> ParquetResult<()> {
    let mut group = writer.next_row_group()?;
    for k in 0..3 {
        column::<DoubleType>(&mut group, rows, |row| row.center_m[k])?;
    }
    column::<DoubleType>(&mut group, rows, |row| row.log_odds)?;
    column::<FloatType>(&mut group, rows, |row| row.probability as f32)?;
    column::<Int32Type>(&mut group, rows, |row| row.observation_count)?;
    for k in 0..3 {
        column::<Int32Type>(&mut group, rows, |row| row.tile[k])?;
    }
    group.close()?;
    Ok(())
}

/// Writes the next column of the schema.
fn column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, OutFile>,
    rows: &[VoxelRow],
    value: impl Fn(&VoxelRow) -> T::T,
) -> ParquetResult<()> {
    let missing = || ParquetError::General("the schema has too few columns".to_owned());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    let values: Vec<T::T> = rows.iter().map(value).collect();
    column.typed::<T>().write_batch(&values, None, None)?;
    column.close()
}

impl VoxelSink for ParquetSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        self.rows.push(*voxel);
        if self.rows.len() >= GROUP_ROWS {
            self.write_group()?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.write_group()?;
        let Self { path, writer, .. } = *self;
        writer.into_inner().map_err(|error| refused(&path, error))?.finish()
    }
}

fn refused(path: &Path, error: ParquetError) -> Error {
    Error::io(path, "write", std::io::Error::other(error))
}

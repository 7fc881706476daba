use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::{Error, Result};
use ::parquet::basic::{Compression, ZstdLevel};
use ::parquet::data_type::{DataType, DoubleType, FloatType, Int32Type, Int64Type};
use ::parquet::errors::{ParquetError, Result as ParquetResult};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::parser::parse_message_type;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::Layers;

/// Number of rows to collect before they are written column by column.
const GROUP_ROWS: usize = 1 << 20;

const VOXEL_COLUMNS: &str = "required double x; required double y; required double z;
    required double log_odds; required float probability; required int32 count;
    required int32 tile_x; required int32 tile_y; required int32 tile_z;";

/// Columns of the layers of a map. They are null for voxels without a value.
fn layer_columns(layers: &Layers) -> String {
    let columns = [
        (
            layers.colour,
            "optional int32 red (INTEGER(8,false)); optional int32 green (INTEGER(8,false));
             optional int32 blue (INTEGER(8,false));",
        ),
        (layers.intensity_max.is_some(), "optional double intensity;"),
        (layers.class, "optional int32 class (INTEGER(8,false));"),
        (layers.time, "optional int64 first_time_ns; optional int64 last_time_ns;"),
    ];
    columns.into_iter().filter(|(is_written, _)| *is_written).map(|(_, columns)| columns).collect()
}

/// Writer of an Apache Parquet table.
pub(super) struct ParquetSink {
    path: PathBuf,
    writer: SerializedFileWriter<OutFile>,
    layers: Layers,
    rows: Vec<VoxelRow>,
}

impl ParquetSink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        let refused = |error| refused(path, error);
        let layers = head.layers;
        let schema = format!("message voxels {{ {VOXEL_COLUMNS} {} }}", layer_columns(&layers));
        let schema = parse_message_type(&schema).map_err(refused)?;
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
        Ok(Self { path: path.to_owned(), writer, layers, rows: Vec::new() })
    }

    fn write_group(&mut self) -> Result<()> {
        if !self.rows.is_empty() {
            write_group(&mut self.writer, &self.layers, &self.rows)
                .map_err(|error| refused(&self.path, error))?;
            self.rows.clear();
        }
        Ok(())
    }
}

fn write_group(
    writer: &mut SerializedFileWriter<OutFile>,
    layers: &Layers,
    rows: &[VoxelRow],
) -> ParquetResult<()> {
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
    if layers.colour {
        for k in 0..3 {
            optional::<Int32Type>(&mut group, rows, |row| Some(row.layers.colour?[k].into()))?;
        }
    }
    if layers.intensity_max.is_some() {
        optional::<DoubleType>(&mut group, rows, |row| row.layers.intensity)?;
    }
    if layers.class {
        optional::<Int32Type>(&mut group, rows, |row| row.layers.class.map(i32::from))?;
    }
    if layers.time {
        for k in 0..2 {
            optional::<Int64Type>(&mut group, rows, |row| Some(row.layers.time_ns?[k]))?;
        }
    }
    group.close()?;
    Ok(())
}

/// Writes the next column of the schema, without nulls.
fn column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, OutFile>,
    rows: &[VoxelRow],
    value: impl Fn(&VoxelRow) -> T::T,
) -> ParquetResult<()> {
    let values: Vec<T::T> = rows.iter().map(value).collect();
    write_column::<T>(group, &values, None)
}

/// Writes the next column of the schema. `None` is null.
fn optional<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, OutFile>,
    rows: &[VoxelRow],
    value: impl Fn(&VoxelRow) -> Option<T::T>,
) -> ParquetResult<()> {
    let (mut values, mut levels) = (Vec::new(), Vec::with_capacity(rows.len()));
    for row in rows {
        let value = value(row);
        levels.push(i16::from(value.is_some()));
        values.extend(value);
    }
    write_column::<T>(group, &values, Some(&levels))
}

/// Writes the next column of the schema. The levels are 1 where there is a value.
fn write_column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, OutFile>,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> ParquetResult<()> {
    let missing = || ParquetError::General("the schema has too few columns".to_owned());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    column.typed::<T>().write_batch(values, levels, None)?;
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

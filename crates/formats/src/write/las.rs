use super::las_layout::{EXTRA_BYTES, LasLayout, common_vlrs, not_compressed, vlr};
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::{Error, Result};
use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
use std::path::{Path, PathBuf};

/// Writer of LAS 1.4 or LAZ. Points are in the order of the voxels.
pub(super) struct LasSink {
    path: PathBuf,
    layout: LasLayout,
    vlrs: Vec<::las::raw::Vlr>,
    points: Points,
}

enum Points {
    Plain(OutFile),
    Compressed(Box<LasZipCompressor<'static, OutFile>>),
}

impl LasSink {
    pub(super) fn plain(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        Self::create(head, path, options, false)
    }

    pub(super) fn compressed(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        Self::create(head, path, options, true)
    }

    fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions, is_compressed: bool) -> Result<Self> {
        let (layout, mut vlrs) = (LasLayout::of(head, options)?, common_vlrs(options)?);
        let mut out = OutFile::create(path)?;
        let points = if is_compressed {
            let laz = laz_vlr(&layout, path, LazVlrBuilder::with_fixed_chunk_size, 50_000)?;
            vlrs.insert(0, laz_record(path, &laz)?);
            layout.write_head(&mut out, true, &vlrs, None)?;
            let compressor = LasZipCompressor::new(out, laz).map_err(|error| not_compressed(path, error))?;
            Points::Compressed(Box::new(compressor))
        } else {
            layout.write_head(&mut out, false, &vlrs, None)?;
            Points::Plain(out)
        };
        Ok(Self { path: path.to_owned(), layout, vlrs, points })
    }
}

/// Returns the LASzip description of the compressed points.
pub(super) fn laz_vlr(
    layout: &LasLayout,
    path: &Path,
    with_chunks: fn(LazVlrBuilder, u32) -> LazVlrBuilder,
    chunk_size: u32,
) -> Result<LazVlr> {
    let items = LazItemRecordBuilder::default_for_point_format_id(layout.point_format(), EXTRA_BYTES);
    let items = items.map_err(|error| not_compressed(path, error))?;
    Ok(with_chunks(LazVlrBuilder::new(items), chunk_size).build())
}

/// Returns the LASzip record.
pub(super) fn laz_record(path: &Path, laz: &LazVlr) -> Result<::las::raw::Vlr> {
    let mut data = Vec::new();
    laz.write_to(&mut data).map_err(|error| Error::io(path, "write", error))?;
    vlr(LazVlr::USER_ID, LazVlr::RECORD_ID, "http://laszip.org", data)
}

impl VoxelSink for LasSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let point = self.layout.point(voxel)?;
        let point = &point[..self.layout.point_bytes()];
        match &mut self.points {
            Points::Plain(out) => out.write(point),
            Points::Compressed(compressor) => {
                compressor.compress_one(point).map_err(|error| Error::io(&self.path, "write", error))
            }
        }
    }

    fn finish(self: Box<Self>) -> Result<()> {
        let (mut out, is_compressed) = match self.points {
            Points::Plain(out) => (out, false),
            Points::Compressed(mut compressor) => {
                compressor.done().map_err(|error| Error::io(&self.path, "write", error))?;
                (compressor.into_inner(), true)
            }
        };
        self.layout.write_head(&mut out, is_compressed, &self.vlrs, None)?;
        out.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;

    #[test]
    fn points_round_trip_with_and_without_compression() {
        let folder = tempfile::tempdir().unwrap();
        let rows: Vec<_> = (0..300).map(|k| row([k - 150, 7 * k, -k], 0.9)).collect();
        for is_compressed in [false, true] {
            let path = folder.path().join(if is_compressed { "a.laz" } else { "a.las" });
            let mut options = WriteOptions::for_path(&path);
            options.crs = Some("LOCAL_CS[\"hall\"]".to_owned());
            let mut sink =
                Box::new(LasSink::create(&head_of(&rows), &path, &options, is_compressed).unwrap());
            for row in &rows {
                sink.put(row).unwrap();
            }
            sink.finish().unwrap();
            let mut reader = ::las::Reader::from_path(&path).unwrap();
            assert_eq!(reader.header().number_of_points(), 300);
            assert!(reader.header().has_wkt_crs());
            let data = reader.read_points(1000).unwrap();
            for (point, row) in data.points().zip(&rows) {
                let point = point.unwrap();
                assert_eq!([point.x, point.y, point.z], row.center_m);
                assert_eq!(point.extra_bytes[..8], row.log_odds.to_le_bytes());
                assert_eq!(point.extra_bytes[8..], 4_i32.to_le_bytes());
            }
            assert_eq!(data.points().count(), 300);
        }
    }
}

use super::Result;
use super::options::WriteOptions;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::spool::Spool;
use super::zip_store::ZipStore;
use std::io::Read;
use std::path::Path;

/// Writer of columns as NumPy arrays in an archive. Each column is stored in a temporary file until the archive is
/// written.
pub(super) struct NpzSink {
    zip: ZipStore,
    columns: Vec<Column>,
    /// Bytes of one value.
    bytes: Vec<u8>,
}

/// Appends the bytes of a voxel's value.
type AppendValue = fn(&VoxelRow, &mut Vec<u8>);

/// Time stamp of a voxel without one; NumPy's `datetime64` reads it as NaT.
const NO_TIME_NS: i64 = i64::MIN;

struct Column {
    name: &'static str,
    append: AppendValue,
    /// Header of the `.npy` file: type and shape.
    head: Vec<u8>,
    crc: crc32fast::Hasher,
    spool: Spool,
}

impl NpzSink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        Self::in_zip(ZipStore::create(path)?, head, options)
    }

    fn in_zip(zip: ZipStore, head: &VoxelsHead, options: &WriteOptions) -> Result<Self> {
        let layers = head.layers;
        let columns: [(bool, &str, &str, &str, AppendValue); 8] = [
            (true, "xyz.npy", "<f8", ", 3", |row, to| {
                to.extend(row.center_m.map(f64::to_le_bytes).as_flattened())
            }),
            (true, "log_odds.npy", "<f8", ",", |row, to| to.extend(row.log_odds.to_le_bytes())),
            (true, "probability.npy", "<f4", ",", |row, to| {
                to.extend((row.probability as f32).to_le_bytes())
            }),
            (true, "count.npy", "<i4", ",", |row, to| to.extend(row.observation_count.to_le_bytes())),
            (layers.colour, "colour.npy", "|u1", ", 3", |row, to| {
                to.extend(row.layers.colour.unwrap_or_default())
            }),
            (layers.intensity_max.is_some(), "intensity.npy", "<f8", ",", |row, to| {
                to.extend(row.layers.intensity.unwrap_or(f64::NAN).to_le_bytes());
            }),
            (layers.class, "class.npy", "|u1", ",", |row, to| to.push(row.layers.class.unwrap_or_default())),
            (layers.time, "time_ns.npy", "<i8", ", 2", |row, to| {
                to.extend(row.layers.time_ns.unwrap_or([NO_TIME_NS; 2]).map(i64::to_le_bytes).as_flattened());
            }),
        ];
        let columns = columns.into_iter().filter(|(is_written, ..)| *is_written);
        let columns = columns.map(|(_, name, of, more, append)| {
            let head = npy_head(of, &format!("({}{more})", head.voxels));
            Column::new(name, append, head, &options.scratch_folder)
        });
        Ok(Self { zip, columns: columns.collect::<Result<_>>()?, bytes: Vec::new() })
    }
}

impl VoxelSink for NpzSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        for column in &mut self.columns {
            self.bytes.clear();
            (column.append)(voxel, &mut self.bytes);
            column.write(&self.bytes)?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        for column in self.columns {
            let bytes = column.head.len() as u64 + column.spool.len();
            let mut data = column.spool.into_reader()?;
            let parts: &mut [&mut dyn Read] = &mut [&mut column.head.as_slice(), data.file()];
            self.zip.entry(column.name, column.crc.finalize(), bytes, parts)?;
        }
        self.zip.finish()
    }
}

impl Column {
    fn new(name: &'static str, append: AppendValue, head: Vec<u8>, scratch_folder: &Path) -> Result<Self> {
        let mut crc = crc32fast::Hasher::new();
        crc.update(&head);
        Ok(Self { name, append, head, crc, spool: Spool::new(scratch_folder)? })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.crc.update(bytes);
        self.spool.write(bytes)
    }
}

/// Returns the header of a `.npy` file, version 1.0: a Python dictionary literal, padded to a multiple of 64 bytes.
pub(super) fn npy_head(of: &str, shape: &str) -> Vec<u8> {
    let mut words = format!("{{'descr': '{of}', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + words.len() + 1) % 64 != 0 {
        words.push(' ');
    }
    words.push('\n');
    let mut head = b"\x93NUMPY\x01\x00".to_vec();
    head.extend((words.len() as u16).to_le_bytes());
    head.extend(words.as_bytes());
    head
}

#[cfg(test)]
mod tests {
    use super::super::RowLayers;
    use super::super::testing::{head_of, row};
    use super::*;
    use voxtile::Layers;

    fn archive(zip64_from: u64) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let head = VoxelsHead {
            voxels: 2,
            resolution_m: 0.5,
            bounds_m: [[0.0; 3], [1.0; 3]],
            occupied_log_odds: 0.0,
            layers: Layers::NONE,
        };
        let zip = ZipStore::create(&path).unwrap().with_zip64_from(zip64_from);
        let mut sink = Box::new(NpzSink::in_zip(zip, &head, &WriteOptions::for_path(&path)).unwrap());
        for x in [0.25, 0.75] {
            let voxel = VoxelRow {
                index: [(2.0 * x) as i32, 0, 0],
                center_m: [x, 0.25, 0.25],
                probability: 0.7,
                log_odds: 0.85,
                observation_count: 3,
                tile: [0; 3],
                layers: RowLayers::default(),
            };
            sink.put(&voxel).unwrap();
        }
        sink.finish().unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn layers_are_arrays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let layers = Layers { colour: true, intensity_max: Some(1.0), class: true, time: true, shape: true };
        let mut rows = [row([0; 3], 0.9), row([1, 0, 0], 0.9)];
        rows[0].layers = RowLayers {
            colour: Some([1, 2, 3]),
            intensity: Some(0.25),
            stored_intensity: None,
            class: Some(9),
            time_ns: Some([-5, 7]),
        };
        let head = VoxelsHead { layers, ..head_of(&rows) };
        let mut sink = Box::new(NpzSink::create(&head, &path, &WriteOptions::for_path(&path)).unwrap());
        rows.iter().for_each(|row| sink.put(row).unwrap());
        sink.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let array = |name: &str, length: usize| {
            let at = bytes.windows(name.len()).position(|part| part == name.as_bytes()).unwrap() + name.len();
            let head = usize::from(bytes[at + 8]) + 256 * usize::from(bytes[at + 9]) + 10;
            bytes[at + head..at + head + length].to_vec()
        };
        assert_eq!(array("colour.npy", 6), [1, 2, 3, 0, 0, 0]);
        assert_eq!(array("intensity.npy", 16), [0.25_f64, f64::NAN].map(f64::to_le_bytes).as_flattened());
        assert_eq!(array("class.npy", 2), [9, 0]);
        let times = [-5, 7, i64::MIN, i64::MIN].map(i64::to_le_bytes);
        assert_eq!(array("time_ns.npy", 32), times.as_flattened());
    }

    #[test]
    fn headers_are_multiples_of_64_bytes() {
        for rows in [0_u64, 7, 1 << 40] {
            let head = npy_head("<f8", &format!("({rows}, 3)"));
            assert_eq!(head.len() % 64, 0);
            assert_eq!(usize::from(head[8]) + 256 * usize::from(head[9]) + 10, head.len());
            assert!(head[10..].starts_with(b"{'descr': '<f8', 'fortran_order': False, 'shape': ("));
            assert!(head.starts_with(b"\x93NUMPY\x01\x00") && head.ends_with(b"\n"));
        }
    }

    #[test]
    fn entry_checksums_are_correct() {
        let bytes = archive(u64::from(u32::MAX));
        let at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(at(0), 0x0403_4b50);
        let (crc, size, name) = (at(14), at(22) as usize, at(26) as usize);
        let data = &bytes[30 + name..30 + name + size];
        assert_eq!(&bytes[30..30 + name], b"xyz.npy");
        assert_eq!(crc32fast::hash(data), crc);
        assert_eq!(size, 128 + 48);
        assert_eq!(data[128..136], 0.25_f64.to_le_bytes());
    }

    #[test]
    fn large_archives_use_zip64() {
        let bytes = archive(100);
        // The 64-bit end record and its locator precede the classic end record.
        let end = bytes.len() - 22;
        assert_eq!(bytes[end..end + 4], 0x0605_4b50_u32.to_le_bytes());
        assert_eq!(bytes[end - 20..end - 16], 0x0706_4b50_u32.to_le_bytes());
        let record = u64::from_le_bytes(bytes[end - 12..end - 4].try_into().unwrap()) as usize;
        assert_eq!(bytes[record..record + 4], 0x0606_4b50_u32.to_le_bytes());
        assert_eq!(bytes[18..26], [255; 8]);
    }
}

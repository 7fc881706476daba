//! Writes LAS and LAZ files byte by byte.

use laz::record::{RecordCompressor, SequentialPointRecordCompressor};
use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
use std::io::{Cursor, Seek, SeekFrom, Write};

/// LAS file with points on a slope, one every 0.01 s.
#[derive(Clone)]
pub struct Las {
    pub minor: u8,
    pub format: u8,
    pub points: usize,
    /// Point counts in the header.
    pub legacy: u32,
    pub large: u64,
    pub encoding: u16,
    pub scales: [f64; 3],
    pub offsets: [f64; 3],
    /// Records before the points: user ID, record ID, data.
    pub records: Vec<(&'static str, u16, Vec<u8>)>,
    /// GPS time of the first point.
    pub start_s: f64,
    /// Red, green and blue of a point.
    pub colour: fn(usize) -> [u16; 3],
    pub class: fn(usize) -> u8,
    /// Number of the return and number of returns of the pulse.
    pub returns: fn(usize) -> [u8; 2],
}

/// Compression of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Packing {
    /// One stream without chunks and chunk table, as in old LASzip versions.
    PointWise,
    /// Chunks with this many points.
    Chunked(u32),
}

impl Las {
    /// Creates a file with a correct header.
    pub fn new(minor: u8, format: u8, points: usize) -> Self {
        let is_old = minor < 4;
        Self {
            minor,
            format,
            points,
            legacy: if is_old { points as u32 } else { 0 },
            large: points as u64,
            encoding: 1,
            scales: [0.01; 3],
            offsets: [500_000.0, 4_180_000.0, 0.0],
            records: Vec::new(),
            start_s: 1000.0,
            colour: |_| [0; 3],
            class: |_| 0,
            returns: |_| [1, 1],
        }
    }

    pub fn point_bytes(&self) -> usize {
        [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67][self.format as usize]
    }

    /// Returns the integer coordinates of a point.
    pub fn whole(k: usize) -> [i32; 3] {
        [100 + 7 * k as i32, 200 - 3 * k as i32, 50 + (k % 40) as i32 * 25]
    }

    pub fn place(&self, k: usize) -> [f64; 3] {
        let whole = Self::whole(k);
        std::array::from_fn(|axis| self.scales[axis] * f64::from(whole[axis]) + self.offsets[axis])
    }

    pub fn point(&self, k: usize) -> Vec<u8> {
        let mut point = vec![0; self.point_bytes()];
        point[..12].copy_from_slice(Self::whole(k).map(i32::to_le_bytes).as_flattened());
        point[12..14].copy_from_slice(&(k as u16).to_le_bytes());
        let [number, count] = (self.returns)(k);
        point[14] = number | count << if self.format < 6 { 3 } else { 4 };
        point[if self.format < 6 { 15 } else { 16 }] = (self.class)(k);
        let colour_at = match self.format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        };
        if let Some(at) = colour_at {
            point[at..at + 6].copy_from_slice((self.colour)(k).map(u16::to_le_bytes).as_flattened());
        }
        let time_at = match self.format {
            0 | 2 => return point,
            1..=5 => 20,
            _ => 22,
        };
        point[time_at..time_at + 8].copy_from_slice(&(self.start_s + 0.01 * k as f64).to_le_bytes());
        point
    }

    /// Returns the bytes before the points.
    pub fn head(&self, is_compressed: bool) -> Vec<u8> {
        let header_bytes = [227, 227, 227, 235, 375, 393][self.minor as usize];
        let mut head = vec![0; header_bytes];
        let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, b"LASF");
        put(6, &self.encoding.to_le_bytes());
        put(24, &[1, self.minor]);
        put(94, &(header_bytes as u16).to_le_bytes());
        let records: usize = self.records.iter().map(|(_, _, data)| 54 + data.len()).sum();
        put(96, &((header_bytes + records) as u32).to_le_bytes());
        put(100, &(self.records.len() as u32).to_le_bytes());
        put(104, &[self.format | if is_compressed { 0x80 } else { 0 }]);
        put(105, &(self.point_bytes() as u16).to_le_bytes());
        put(107, &self.legacy.to_le_bytes());
        for axis in 0..3 {
            let places: Vec<f64> = (0..self.points).map(|k| self.place(k)[axis]).collect();
            let bound = |pick: fn(f64, f64) -> f64| places.iter().copied().reduce(pick).unwrap_or(0.0);
            put(131 + 8 * axis, &self.scales[axis].to_le_bytes());
            put(155 + 8 * axis, &self.offsets[axis].to_le_bytes());
            put(179 + 16 * axis, &bound(f64::max).to_le_bytes());
            put(187 + 16 * axis, &bound(f64::min).to_le_bytes());
        }
        if self.minor >= 4 {
            put(247, &self.large.to_le_bytes());
        }
        for (user, id, data) in &self.records {
            let mut record = vec![0; 54];
            record[2..2 + user.len()].copy_from_slice(user.as_bytes());
            record[18..20].copy_from_slice(&id.to_le_bytes());
            record[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
            head.extend(record);
            head.extend(data);
        }
        head
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.head(false);
        (0..self.points).for_each(|k| bytes.extend(self.point(k)));
        bytes
    }

    /// Returns the file with compressed points.
    pub fn packed(&self, packing: Packing) -> Vec<u8> {
        let items = LazItemRecordBuilder::default_for_point_format_id(self.format, 0).unwrap();
        let chunk_size = match packing {
            Packing::PointWise => 50_000,
            Packing::Chunked(points) => points,
        };
        let laz = LazVlrBuilder::new(items.clone()).with_fixed_chunk_size(chunk_size).build();
        let mut description = Vec::new();
        laz.write_to(&mut description).unwrap();
        if packing == Packing::PointWise {
            // LASzip 1.2: compressor type 1, chunks of 0 points.
            description[0] = 1;
            description[4..8].copy_from_slice(&[1, 2, 0, 0]);
            description[12..16].fill(0);
        }
        let mut file = self.clone();
        file.records.insert(0, (LazVlr::USER_ID, LazVlr::RECORD_ID, description));
        let mut out = Cursor::new(file.head(true));
        out.seek(SeekFrom::End(0)).unwrap();
        match packing {
            Packing::PointWise => {
                let mut points = SequentialPointRecordCompressor::new(Vec::new());
                points.set_fields_from(&items).unwrap();
                (0..self.points).for_each(|k| points.compress_next(&self.point(k)).unwrap());
                points.done().unwrap();
                out.write_all(&points.into_inner()).unwrap();
            }
            Packing::Chunked(_) => {
                let mut points = LasZipCompressor::new(&mut out, laz).unwrap();
                (0..self.points).for_each(|k| points.compress_one(&self.point(k)).unwrap());
                points.done().unwrap();
            }
        }
        out.into_inner()
    }
}

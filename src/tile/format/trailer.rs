use crate::error::{DecodeError, FormatError};
use crate::space::TileIndex;
use std::io::Read;

/// Size of the trailer in bytes, without the parameters after it.
pub const TRAILER_BYTES: usize = 72;

/// Maximum size of parameters that are read, in bytes.
const MAX_PARAMETERS_BYTES: u64 = 1 << 16;

/// "VXTR", little-endian.
const MAGIC: u32 = 0x5254_5856;
const VERSION: u32 = 1;

/// Trailer of `iwlo_meta.bin`, and front part of `tile.vxt`: map, tile and scan number of the file, and checksums of
/// the tile's files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trailer {
    /// Id of the map.
    pub map_id: [u8; 16],
    /// Index of the tile.
    pub tile: TileIndex,
    /// Number of the last scan in the map when the file was written.
    pub scan_number: u64,
    /// CRC-32 of header and entries, or of the compact form.
    pub table_crc: u32,
    /// CRC-32 of the tile's `octree.bt`; with compact storage, of the layers after the table, or 0.
    pub octree_crc: u32,
    /// Size of the tile's `octree.bt` in bytes; with compact storage, of the layers after the table.
    pub octree_bytes: u64,
    /// Parameters of the map as text, stored after the trailer, so that a map can be rebuilt from its tiles.
    pub parameters: String,
}

impl Trailer {
    /// Returns the trailer as bytes with a CRC-32, followed by the parameters.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; TRAILER_BYTES];
        bytes[0..4].copy_from_slice(&MAGIC.to_le_bytes());
        bytes[4..8].copy_from_slice(&VERSION.to_le_bytes());
        bytes[8..24].copy_from_slice(&self.map_id);
        for (axis, index) in self.tile.to_array().into_iter().enumerate() {
            bytes[24 + 4 * axis..28 + 4 * axis].copy_from_slice(&index.to_le_bytes());
        }
        bytes[36..44].copy_from_slice(&self.scan_number.to_le_bytes());
        bytes[44..48].copy_from_slice(&self.table_crc.to_le_bytes());
        bytes[48..52].copy_from_slice(&self.octree_crc.to_le_bytes());
        bytes[52..60].copy_from_slice(&self.octree_bytes.to_le_bytes());
        bytes[60..64].copy_from_slice(&(self.parameters.len() as u32).to_le_bytes());
        bytes[64..68].copy_from_slice(&crc32fast::hash(self.parameters.as_bytes()).to_le_bytes());
        let crc = crc32fast::hash(&bytes[..68]);
        bytes[68..].copy_from_slice(&crc.to_le_bytes());
        bytes.extend_from_slice(self.parameters.as_bytes());
        bytes
    }

    /// Size in bytes, including the parameters.
    pub fn bytes(&self) -> u64 {
        (TRAILER_BYTES + self.parameters.len()) as u64
    }

    /// Reads the trailer and its parameters, which start at `offset` of a file, `bytes` bytes before its end. The layers
    /// may follow.
    ///
    /// # Errors
    ///
    /// Fails if the length, magic number, version or checksum is wrong.
    pub fn read(input: &mut impl Read, offset: u64, bytes: u64) -> Result<Self, DecodeError> {
        if bytes < TRAILER_BYTES as u64 {
            let reason = "there must be none or a voxtile trailer";
            let reason = format!("{bytes} bytes follow the last entry; {reason}");
            return Err(FormatError::at_offset(offset, reason).into());
        }
        let fixed = Fixed::read(input, offset)?;
        if bytes < fixed.all_bytes() {
            let (found, wanted) = (bytes - TRAILER_BYTES as u64, fixed.parameters_bytes());
            let reason = format!("{found} bytes of parameters instead of {wanted}");
            return Err(FormatError::at_offset(offset + 60, reason).into());
        }
        fixed.with_parameters(input, offset)
    }

    /// Reads the trailer and its parameters from the start of a file of `file_bytes` bytes.
    ///
    /// # Errors
    ///
    /// Fails if the length, magic number, version or checksum is wrong.
    pub fn read_in_front(input: &mut impl Read, file_bytes: u64) -> Result<Self, DecodeError> {
        let too_short = |wanted: u64| {
            let reason = format!("{file_bytes} bytes are too few for a front part of {wanted} bytes");
            Err(FormatError::at_offset(0, reason).into())
        };
        if file_bytes < TRAILER_BYTES as u64 {
            return too_short(TRAILER_BYTES as u64);
        }
        let fixed = Fixed::read(input, 0)?;
        if file_bytes < fixed.all_bytes() {
            return too_short(fixed.all_bytes());
        }
        fixed.with_parameters(input, 0)
    }
}

/// Fixed part of a trailer, with checksum, magic number and version checked.
struct Fixed([u8; TRAILER_BYTES]);

impl Fixed {
    fn read(input: &mut impl Read, offset: u64) -> Result<Self, DecodeError> {
        let wrong = |at, reason: &str| Err(FormatError::at_offset(offset + at, reason).into());
        let mut bytes = [0; TRAILER_BYTES];
        input.read_exact(&mut bytes)?;
        let fixed = Self(bytes);
        if fixed.u32_at(68) != crc32fast::hash(&bytes[..68]) {
            return wrong(0, "the trailer does not match its checksum");
        }
        if (fixed.u32_at(0), fixed.u32_at(4)) != (MAGIC, VERSION) {
            return wrong(0, "not a trailer of version 1");
        }
        if u64::from(fixed.parameters_bytes()) > MAX_PARAMETERS_BYTES {
            return wrong(60, "the parameters are too long");
        }
        Ok(fixed)
    }

    fn parameters_bytes(&self) -> u32 {
        self.u32_at(60)
    }

    fn all_bytes(&self) -> u64 {
        TRAILER_BYTES as u64 + u64::from(self.parameters_bytes())
    }

    fn with_parameters(self, input: &mut impl Read, offset: u64) -> Result<Trailer, DecodeError> {
        let mut parameters = vec![0; self.parameters_bytes() as usize];
        input.read_exact(&mut parameters)?;
        let is_whole = self.u32_at(64) == crc32fast::hash(&parameters);
        let Some(parameters) = String::from_utf8(parameters).ok().filter(|_| is_whole) else {
            let reason = "the parameters do not match their checksum";
            return Err(FormatError::at_offset(offset + TRAILER_BYTES as u64, reason).into());
        };
        let [x, y, z] = [24, 28, 32].map(|at| self.u32_at(at) as i32);
        Ok(Trailer {
            map_id: std::array::from_fn(|k| self.0[8 + k]),
            tile: TileIndex::new(x, y, z),
            scan_number: self.u64_at(36),
            table_crc: self.u32_at(44),
            octree_crc: self.u32_at(48),
            octree_bytes: self.u64_at(52),
            parameters,
        })
    }

    fn u32_at(&self, at: usize) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|k| self.0[at + k]))
    }

    fn u64_at(&self, at: usize) -> u64 {
        u64::from_le_bytes(std::array::from_fn(|k| self.0[at + k]))
    }
}

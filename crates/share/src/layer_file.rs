use super::codec::{Header, MAX_VOXELS_PER_PACKET, Packet};
use super::set::VoxelSet;
use super::set_range::SetRange;
use std::io::{self, Read, Write};
use voxtile::space::{Grid, VoxelIndex};
use voxtile::{DecodeError, FormatError};

/// First bytes of a layer file.
const LABEL: &[u8; 16] = b"voxtile-layer-1\n";

/// Maximum size of a packet in a layer file, in bytes.
const MAX_PACKET_BYTES: usize = 60_000;
/// Voxels per packet. They usually take far less than the maximum size.
const VOXELS_PER_PACKET: usize = MAX_VOXELS_PER_PACKET / 4;

/// Writes a layer: label, resolution, tile size, packets of content with their lengths, an empty packet, and the
/// digest.
///
/// # Errors
///
/// Errors of `out`.
pub fn write_layer(layer: &mut VoxelSet, out: &mut impl Write) -> io::Result<()> {
    out.write_all(LABEL)?;
    for length_m in [layer.grid().resolution_m(), layer.grid().tile_size_m()] {
        out.write_all(&length_m.to_bits().to_le_bytes())?;
    }
    let mut voxels = layer.iter();
    loop {
        let some: Vec<VoxelIndex> = voxels.by_ref().take(VOXELS_PER_PACKET).collect();
        write_some(&some, out)?;
        if some.is_empty() {
            break;
        }
    }
    drop(voxels);
    out.write_all(&layer.digest().to_bytes())
}

/// Writes voxels in one packet, or in several if they do not fit.
fn write_some(voxels: &[VoxelIndex], out: &mut impl Write) -> io::Result<()> {
    let header = Header { epoch: 0, sequence: 0 };
    let packet = Packet::Content { header, range: SetRange::ALL, voxels: voxels.to_vec() };
    match packet.encode() {
        Ok(bytes) if bytes.len() <= MAX_PACKET_BYTES => {
            out.write_all(&(bytes.len() as u16).to_le_bytes())?;
            out.write_all(&bytes)
        }
        _ if voxels.len() > 1 => {
            let (front, back) = voxels.split_at(voxels.len() / 2);
            write_some(front, out)?;
            write_some(back, out)
        }
        Ok(_) => Err(io::Error::other("one voxel does not fit into a packet")),
        Err(error) => Err(io::Error::other(error)),
    }
}

/// Reads a layer of at most `max_voxels` voxels.
///
/// # Errors
///
/// Bytes that are not a layer file, a wrong digest, too many voxels, errors of `input`.
pub fn read_layer(input: &mut impl Read, max_voxels: u64) -> Result<VoxelSet, DecodeError> {
    read_layer_within(input, max_voxels, usize::MAX)
}

/// Reads a layer like [`read_layer`], with a memory limit in bytes. One packet may exceed the limit.
///
/// # Errors
///
/// As for [`read_layer`], and a layer that exceeds the limit.
pub fn read_layer_within(
    input: &mut impl Read,
    max_voxels: u64,
    max_bytes: usize,
) -> Result<VoxelSet, DecodeError> {
    let mut label = [0; 16];
    input.read_exact(&mut label)?;
    if label != *LABEL {
        return Err(FormatError::at_offset(0, "this is not a voxtile layer file").into());
    }
    let mut lengths_m = [0.0; 2];
    for length_m in &mut lengths_m {
        let mut bits = [0; 8];
        input.read_exact(&mut bits)?;
        *length_m = f64::from_bits(u64::from_le_bytes(bits));
    }
    let grid = Grid::new(lengths_m[0], lengths_m[1])
        .map_err(|error| FormatError::at_offset(LABEL.len() as u64, error.to_string()))?;
    let mut layer = VoxelSet::new(grid);
    let mut offset = LABEL.len() as u64 + 16;
    loop {
        let mut length = [0; 2];
        input.read_exact(&mut length)?;
        let mut bytes = vec![0; usize::from(u16::from_le_bytes(length))];
        input.read_exact(&mut bytes)?;
        let voxels =
            content_of(&bytes).map_err(|error| FormatError { at: error.at + offset + 2, ..error })?;
        offset += 2 + bytes.len() as u64;
        if voxels.is_empty() {
            break;
        }
        put_all(&mut layer, &voxels, max_voxels, offset)?;
        if layer.memory_bytes() > max_bytes {
            let reason = format!("the layer exceeds its memory limit of {max_bytes} bytes");
            return Err(FormatError::at_offset(offset, reason).into());
        }
    }
    let mut digest = [0; 32];
    input.read_exact(&mut digest)?;
    if layer.digest().to_bytes() != digest {
        return Err(FormatError::at_offset(offset, "the digest does not match the voxels").into());
    }
    Ok(layer)
}

fn content_of(bytes: &[u8]) -> Result<Vec<VoxelIndex>, FormatError> {
    match Packet::decode(bytes)? {
        Packet::Content { voxels, .. } => Ok(voxels),
        _ => Err(FormatError::at_offset(0, "a layer file contains a packet of an unexpected type")),
    }
}

fn put_all(layer: &mut VoxelSet, voxels: &[VoxelIndex], max: u64, offset: u64) -> Result<(), FormatError> {
    for &voxel in voxels {
        layer.put(voxel, true);
    }
    if layer.len() > max {
        return Err(FormatError::at_offset(offset, format!("the layer has more than {max} voxels")));
    }
    Ok(())
}

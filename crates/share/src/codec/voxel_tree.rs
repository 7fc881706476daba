use super::MAX_VOXELS_PER_PACKET;
use super::bit_coder::{BitReader, BitWriter, Bits};
use super::bytes::{Reader, put_signed};
use super::context::{ChildContext, direction_context};
use super::neighbors::{Faces, around};
use voxtile::space::{LAST_VOXEL_INDEX, VoxelIndex};
use voxtile::{Error, FormatError, Result};

/// Voxel that is added to a set or removed from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Update {
    /// Index of the voxel.
    pub voxel: VoxelIndex,
    /// Whether the voxel is added.
    pub is_in: bool,
}

/// Maximum number of octree levels above the voxels: the cube of a packet has an edge of at most 2^20 voxels.
const MAX_LEVELS: u32 = 20;

/// Voxels of a packet in their bounding cube: the Morton code of each, and whether it is added.
pub(super) struct Cube {
    origin: VoxelIndex,
    levels: u32,
    voxels: Vec<(u64, bool)>,
}

/// Modes in the first byte: all voxels are added, all are removed, or some of each.
const ALL_ADDED: u8 = 1;
const ALL_REMOVED: u8 = 2;
const MIXED: u8 = 3;

/// Encodes distinct voxels, given in any order. `docs/sharing.md` specifies the format.
///
/// # Errors
///
/// More than [`MAX_VOXELS_PER_PACKET`] voxels, voxels that are about a million voxels apart or more, or an index above
/// [`LAST_VOXEL_INDEX`].
pub fn encode_updates(updates: &[Update]) -> Result<Vec<u8>> {
    if updates.is_empty() {
        return Ok(vec![0]);
    }
    let cube = Cube::of(updates)?;
    let added = updates.iter().filter(|update| update.is_in).count();
    let mode = match added {
        0 => ALL_REMOVED,
        _ if added == updates.len() => ALL_ADDED,
        _ => MIXED,
    };
    let mut bytes = vec![mode << 5 | cube.levels as u8];
    // The origin is the corner of a brick, so its coordinates are multiples of 8.
    cube.origin.iter().for_each(|k| put_signed(&mut bytes, i64::from(k >> 3)));
    let mut writer = BitWriter::new();
    let walked = walk(&mut writer, cube.levels, mode == MIXED, &cube.voxels);
    debug_assert!(walked.is_ok(), "writing cannot fail");
    bytes.extend(writer.finish());
    Ok(bytes)
}

/// Decodes the bytes of [`encode_updates`]. `offset` is the position of the bytes in their packet, for errors.
///
/// # Errors
///
/// Bytes that are not valid updates, more than [`MAX_VOXELS_PER_PACKET`] voxels, or an index above
/// [`LAST_VOXEL_INDEX`]. Decoded voxels can always be encoded again.
pub fn decode_updates(bytes: &[u8], offset: u64) -> std::result::Result<Vec<Update>, FormatError> {
    let mut reader = Reader::new(bytes, offset);
    let first = reader.byte()?;
    let (mode, levels) = (first >> 5, u32::from(first & 31));
    if first == 0 && reader.rest().is_empty() {
        return Ok(Vec::new());
    }
    if !(ALL_ADDED..=MIXED).contains(&mode) || levels > MAX_LEVELS {
        return Err(reader.error(format!("invalid first byte {first} of an octree")));
    }
    let mut origin = [0_i32; 3];
    for k in &mut origin {
        let corner = reader.signed()?.checked_mul(8).and_then(|corner| i32::try_from(corner).ok());
        *k = corner.ok_or_else(|| reader.error("the voxel indices are out of range"))?;
    }
    let mut bits = BitReader::new(reader.rest());
    let voxels = walk(&mut bits, levels, mode == MIXED, &[])?;
    if !bits.is_used_up() {
        return Err(reader.error("unexpected bytes after the last voxel"));
    }
    let update = |(code, is_in): (u64, bool)| {
        let is_in = if mode == MIXED { is_in } else { mode == ALL_ADDED };
        // The cube may exceed the range of indices, but its voxels must not.
        let voxel = voxel_in(origin, gather(code))
            .ok_or_else(|| reader.error(format!("a voxel index above the maximum of {LAST_VOXEL_INDEX}")))?;
        Ok(Update { voxel, is_in })
    };
    voxels.into_iter().map(update).collect()
}

impl Cube {
    pub(super) fn of(updates: &[Update]) -> Result<Self> {
        if updates.len() > MAX_VOXELS_PER_PACKET {
            let reason = format!("{} voxels; the maximum is {MAX_VOXELS_PER_PACKET}", updates.len());
            return Err(Error::argument("voxels of a packet", reason));
        }
        let corner = |pick: fn(i32, i32) -> i32, from: i32| {
            let corner = updates
                .iter()
                .fold([from; 3], |corner, update| std::array::from_fn(|k| pick(corner[k], update.voxel[k])));
            corner as VoxelIndex
        };
        let origin = corner(i32::min, i32::MAX).map(|k| k & !7);
        let last = corner(i32::max, i32::MIN);
        let extent = (0..3).map(|k| i64::from(last[k]) - i64::from(origin[k])).max().unwrap_or(0);
        let levels = 64 - extent.leading_zeros();
        if last.iter().any(|&k| k > LAST_VOXEL_INDEX) {
            let reason = format!("{last:?} is above the maximum index of {LAST_VOXEL_INDEX}");
            return Err(Error::argument("voxels of a packet", reason));
        }
        if levels > MAX_LEVELS {
            return Err(Error::argument(
                "voxels of a packet",
                "they are a million voxels apart or more; use several packets",
            ));
        }
        let place = |update: &Update| {
            let local = std::array::from_fn(|k| (i64::from(update.voxel[k]) - i64::from(origin[k])) as u32);
            (spread(local), update.is_in)
        };
        let mut voxels: Vec<(u64, bool)> = updates.iter().map(place).collect();
        voxels.sort_unstable();
        voxels.dedup_by_key(|(code, _)| *code);
        Ok(Self { origin, levels, voxels })
    }

    pub(super) fn walk(&self, bits: &mut impl Bits) -> std::result::Result<(), FormatError> {
        walk(bits, self.levels, self.voxels.iter().any(|(_, is_in)| !is_in), &self.voxels).map(drop)
    }
}

/// Codes the octree of a cube level by level, each level in Morton order: one bit per child, then one bit per voxel if
/// `is_mixed`. Returns the voxels. `known` has the voxels to write; a reader passes none.
fn walk(
    bits: &mut impl Bits,
    levels: u32,
    is_mixed: bool,
    known: &[(u64, bool)],
) -> std::result::Result<Vec<(u64, bool)>, FormatError> {
    let mut nodes = vec![0_u64];
    for level in (0..levels).rev() {
        let mut children = Vec::with_capacity(2 * nodes.len());
        let mut masks = Vec::with_capacity(nodes.len());
        // Only for a writer: the voxels of the nodes that are not yet written.
        let mut rest = known;
        for number in 0..nodes.len() {
            let wanted = take_mask(&mut rest, nodes[number], level);
            let faces = Faces::of(&nodes, number, levels - level - 1);
            let mask = code_children(bits, level, &faces, &masks, wanted)?;
            children.extend(
                (0..8).filter(|child| mask >> child & 1 == 1).map(|child| nodes[number] << 3 | child),
            );
            masks.push(mask);
        }
        if children.len() > MAX_VOXELS_PER_PACKET {
            let reason = format!("more than {MAX_VOXELS_PER_PACKET} voxels in a packet");
            return Err(FormatError::at_offset(0, reason));
        }
        nodes = children;
    }
    code_directions(bits, levels, is_mixed, &nodes, known)
}

/// For a writer: returns the children of a node that hold voxels, and skips these voxels in `rest`.
fn take_mask(rest: &mut &[(u64, bool)], node: u64, level: u32) -> u8 {
    let mut mask = 0;
    while let Some((code, _)) = rest.first()
        && code >> (3 * level + 3) == node
    {
        mask |= 1 << (code >> (3 * level) & 7);
        *rest = &rest[1..];
    }
    mask
}

fn code_children(
    bits: &mut impl Bits,
    level: u32,
    faces: &Faces,
    masks: &[u8],
    wanted: u8,
) -> std::result::Result<u8, FormatError> {
    let mut mask = 0_u8;
    for child in 0..8 {
        // A node has at least one child, so the last bit may be implied.
        let is_certain = child == 7 && mask == 0;
        let context = child_context(level, child, faces, masks, mask);
        let bit = is_certain || bits.bit(context.number(), wanted >> child & 1 == 1)?;
        mask |= u8::from(bit) << child;
    }
    Ok(mask)
}

fn child_context(level: u32, child: usize, faces: &Faces, masks: &[u8], mask: u8) -> ChildContext {
    let full_siblings = mask.count_ones() as usize;
    let mut context = ChildContext { level, child, full_siblings, ..ChildContext::default() };
    for axis in 0..3 {
        let facing = child ^ 1 << axis;
        let mut is_full = mask >> facing & 1 == 1;
        if let Some(neighbor) = faces.0[axis][child >> axis & 1] {
            match masks.get(neighbor) {
                Some(of_neighbor) => {
                    let is_there = of_neighbor >> facing & 1 == 1;
                    context.full_neighbors += usize::from(is_there);
                    context.is_neighbor_along_z |= axis == 2 && is_there;
                }
                None => context.likely_neighbors += 1,
            }
        }
        is_full &= facing < child;
        context.full_neighbors += usize::from(is_full);
        context.is_neighbor_along_z |= axis == 2 && is_full;
    }
    context
}

fn code_directions(
    bits: &mut impl Bits,
    levels: u32,
    is_mixed: bool,
    codes: &[u64],
    known: &[(u64, bool)],
) -> std::result::Result<Vec<(u64, bool)>, FormatError> {
    let mut voxels: Vec<(u64, bool)> = Vec::with_capacity(codes.len());
    let mut previous = 2;
    for (number, &code) in codes.iter().enumerate() {
        let mut is_in = true;
        if is_mixed {
            let (mut added, mut removed) = (0, 0);
            for neighbor in around(code, levels).filter(|&neighbor| neighbor < code) {
                if let Ok(place) = voxels.binary_search_by_key(&neighbor, |(code, _)| *code) {
                    *(if voxels[place].1 { &mut added } else { &mut removed }) += 1;
                }
            }
            let wanted = known.get(number).is_some_and(|(_, is_in)| *is_in);
            is_in = bits.bit(direction_context(previous, added, removed), wanted)?;
            previous = usize::from(is_in);
        }
        voxels.push((code, is_in));
    }
    Ok(voxels)
}

/// Returns the voxel at a position in a cube; `None` if its index is out of range.
fn voxel_in(origin: VoxelIndex, local: [u32; 3]) -> Option<VoxelIndex> {
    let mut voxel = origin;
    for (k, local) in voxel.iter_mut().zip(local) {
        *k = k.checked_add_unsigned(local).filter(|&k| k <= LAST_VOXEL_INDEX)?;
    }
    Some(voxel)
}

/// Moves bit `k` of x, y and z to bits `3k`, `3k + 1` and `3k + 2`.
fn spread(local: [u32; 3]) -> u64 {
    let bits =
        |k: usize| (0..MAX_LEVELS).map(move |bit| u64::from(local[k] >> bit & 1) << (3 * bit + k as u32));
    (0..3).flat_map(bits).sum()
}

fn gather(code: u64) -> [u32; 3] {
    std::array::from_fn(|k| {
        (0..MAX_LEVELS).map(|bit| ((code >> (3 * bit + k as u32) & 1) as u32) << bit).sum()
    })
}

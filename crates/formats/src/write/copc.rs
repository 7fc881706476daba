use super::copc_levels::{Levels, NodeKey, morton};
use super::las::{laz_record, laz_vlr};
use super::las_layout::{LasLayout, MAX_POINT_BYTES, common_vlrs, not_compressed, padded, vlr};
use super::lattice::Lattice;
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::sort::{ExternalSort, part};
use super::{Error, Result};
use ::las::raw::Vlr;
use laz::LasZipCompressor;
use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

/// Size of a record in the first sort: a 96-bit Morton code and a point.
const CODED_BYTES: usize = 12 + MAX_POINT_BYTES;
/// Size of a record in the second sort: a level, then a record of the first sort.
const LEVELLED_BYTES: usize = 1 + CODED_BYTES;
const NODE_BYTES: usize = 32;

/// Writer of LAZ with levels of detail (COPC 1.0). Points are sorted into the nodes of an octree, one chunk per node.
pub(super) struct CopcSink {
    out: OutFile,
    head: VoxelsHead,
    layout: LasLayout,
    /// Records that describe fields and coordinates.
    common: Vec<Vlr>,
    scratch_folder: PathBuf,
    points: ExternalSort<CODED_BYTES>,
    cube: Option<Cube>,
}

/// Cube of the octree in world coordinates.
struct Cube {
    lattice: Lattice,
    lowest: [i64; 3],
    levels: Levels,
}

/// Location of a node's points in the file.
#[derive(Default)]
struct Chunk {
    offset: u64,
    bytes: u64,
    points: u64,
}

impl CopcSink {
    pub(super) fn create(head: &VoxelsHead, path: &std::path::Path, options: &WriteOptions) -> Result<Self> {
        Ok(Self {
            layout: LasLayout::of(head, options)?,
            out: OutFile::create(path)?,
            head: head.clone(),
            common: common_vlrs(options)?,
            scratch_folder: options.scratch_folder.clone(),
            points: ExternalSort::new(&options.scratch_folder),
            cube: None,
        })
    }
}

impl Cube {
    fn around(head: &VoxelsHead, first: &VoxelRow) -> Self {
        let lattice = Lattice::of(first, head.resolution_m);
        let [lowest, highest] = head.bounds_m.map(|corner| lattice.index_at(corner));
        let longest = (0..3).map(|k| highest[k].saturating_sub(lowest[k]).saturating_add(1)).max();
        let levels = Levels::around(longest.and_then(|longest| u64::try_from(longest).ok()).unwrap_or(1));
        Self { lattice, lowest, levels }
    }

    fn code(&self, voxel: &VoxelRow) -> Result<u128> {
        let mut index = [0; 3];
        for (k, inside_index) in index.iter_mut().enumerate() {
            let at = i64::from(voxel.index[k]) - self.lowest[k];
            let inside = u32::try_from(at).ok().filter(|&at| f64::from(at) < self.levels.edge_voxels());
            *inside_index = inside.ok_or_else(|| {
                let reason = format!("voxel {:?} is outside of the announced bounds", voxel.index);
                Error::argument("COPC", reason)
            })?;
        }
        Ok(morton(index))
    }

    /// Returns the COPC info record, which is first in the file.
    fn info(&self, resolution_m: f64, hierarchy: u64, hierarchy_bytes: u64) -> Vec<u8> {
        let half = 0.5 * self.levels.edge_voxels() * resolution_m;
        let [x, y, z] = self.lattice.corner_m(self.lowest).map(|corner| corner + half);
        let spacing = self.levels.spacing_voxels() * resolution_m;
        let mut info: Vec<u8> = [x, y, z, half, spacing].into_iter().flat_map(f64::to_le_bytes).collect();
        info.extend(hierarchy.to_le_bytes());
        info.extend(hierarchy_bytes.to_le_bytes());
        // No GPS times; reserved bytes.
        info.resize(160, 0);
        info
    }
}

impl VoxelSink for CopcSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let cube = self.cube.get_or_insert_with(|| Cube::around(&self.head, voxel));
        let mut record = [0; CODED_BYTES];
        record[..12].copy_from_slice(&part::<12>(&cube.code(voxel)?.to_be_bytes(), 4));
        record[12..].copy_from_slice(&self.layout.point(voxel)?);
        self.points.push(record)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        let Self { mut out, head, layout, common, scratch_folder, points, cube } = *self;
        let Some(cube) = cube else {
            return Err(Error::argument("COPC", "there are no voxels; an octree needs at least one"));
        };
        let path = out.path().to_owned();
        let refused = |error| Error::io(&path, "write", error);
        let laz = laz_vlr(&layout, &path, |builder, _| builder.with_variable_chunk_size(), 0)?;
        let mut vlrs = vec![
            vlr("copc", 1, "COPC info VLR", cube.info(head.resolution_m, 0, 0))?,
            laz_record(&path, &laz)?,
        ];
        vlrs.extend(common);
        layout.write_head(&mut out, true, &vlrs, None)?;

        let mut compressor = LasZipCompressor::new(out, laz).map_err(|error| not_compressed(&path, error))?;
        compressor.reserve_offset_to_chunk_table().map_err(refused)?;
        let mut place = compressor.get_mut().stream_position().map_err(refused)?;
        let table_at = place - 8;
        let mut nodes: BTreeMap<NodeKey, Chunk> = BTreeMap::new();
        let mut last: Option<NodeKey> = None;
        let mut sorted = by_level(points, &cube.levels, &scratch_folder)?.into_sorted()?;
        while let Some(record) = sorted.next()? {
            let [level] = part(&record, 0);
            let key = cube.levels.node(level, code_of(part(&record, 1)));
            if last != Some(key) {
                if let Some(node) = last.and_then(|last| nodes.get_mut(&last)) {
                    compressor.finish_current_chunk().map_err(refused)?;
                    let end = compressor.get_mut().stream_position().map_err(refused)?;
                    (node.bytes, place) = (end - place, end);
                }
                nodes.insert(key, Chunk { offset: place, ..Chunk::default() });
                last = Some(key);
            }
            compressor
                .compress_one(&part::<MAX_POINT_BYTES>(&record, 13)[..layout.point_bytes()])
                .map_err(refused)?;
            if let Some(node) = nodes.get_mut(&key) {
                node.points += 1;
            }
        }
        compressor.done().map_err(refused)?;
        let mut out = compressor.into_inner();
        // The chunk table follows the last chunk, and its offset precedes the first one.
        let mut table = [0; 8];
        out.seek(SeekFrom::Start(table_at)).map_err(refused)?;
        out.read_exact(&mut table).map_err(refused)?;
        if let Some(node) = last.and_then(|last| nodes.get_mut(&last)) {
            node.bytes = u64::from_le_bytes(table).saturating_sub(place);
        }

        let evlr = out.seek(SeekFrom::End(0)).map_err(refused)?;
        let page = hierarchy(nodes)?;
        let mut record = vec![0; 2];
        record.extend(padded::<16>("copc"));
        record.extend(1000_u16.to_le_bytes());
        record.extend((page.len() as u64).to_le_bytes());
        record.extend(padded::<32>("EPT Hierarchy"));
        out.write(&record)?;
        out.write(&page)?;
        let info = cube.info(head.resolution_m, evlr + record.len() as u64, page.len() as u64);
        if let Some(first) = vlrs.first_mut() {
            *first = vlr("copc", 1, "COPC info VLR", info)?;
        }
        layout.write_head(&mut out, true, &vlrs, Some(evlr))?;
        out.finish()
    }
}

fn code_of(bytes: [u8; 12]) -> u128 {
    bytes.iter().fold(0, |code, &byte| code << 8 | u128::from(byte))
}

/// Sorts points by level, then in Morton order, so that the points of a node are consecutive.
fn by_level(
    points: ExternalSort<CODED_BYTES>,
    levels: &Levels,
    scratch_folder: &std::path::Path,
) -> Result<ExternalSort<LEVELLED_BYTES>> {
    let mut levelled = ExternalSort::new(scratch_folder);
    let mut sorted = points.into_sorted()?;
    let mut before = None;
    while let Some(point) = sorted.next()? {
        let code = code_of(part(&point, 0));
        let mut record = [0; LEVELLED_BYTES];
        record[0] = levels.level(before, code);
        record[1..].copy_from_slice(&point);
        levelled.push(record)?;
        before = Some(code);
    }
    Ok(levelled)
}

/// Returns a single hierarchy page with all nodes. Nodes without own points are included, because readers traverse
/// them.
fn hierarchy(mut nodes: BTreeMap<NodeKey, Chunk>) -> Result<Vec<u8>> {
    let keys: Vec<NodeKey> = nodes.keys().copied().collect();
    for (mut level, mut place) in keys {
        while level > 0 {
            (level, place) = (level - 1, place.map(|k| k / 2));
            nodes.entry((level, place)).or_default();
        }
    }
    let mut page = Vec::with_capacity(nodes.len() * NODE_BYTES);
    for ((level, place), chunk) in nodes {
        let too_large = |_| Error::argument("COPC", "a node is too large for the format");
        let (bytes, points) = (i32::try_from(chunk.bytes), i32::try_from(chunk.points));
        page.extend(i32::from(level).to_le_bytes());
        page.extend(place.map(u32::to_le_bytes).as_flattened());
        page.extend(chunk.offset.to_le_bytes());
        page.extend(bytes.map_err(too_large)?.to_le_bytes());
        page.extend(points.map_err(too_large)?.to_le_bytes());
    }
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;

    #[test]
    fn every_voxel_is_in_one_node() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.copc.laz");
        // A slope of 200 voxels: three levels.
        let rows: Vec<_> =
            (0..200).flat_map(|x| (0..200).map(move |y| row([x - 100, y, x / 3], 0.9))).collect();
        let mut sink =
            Box::new(CopcSink::create(&head_of(&rows), &path, &WriteOptions::for_path(&path)).unwrap());
        rows.iter().for_each(|row| sink.put(row).unwrap());
        sink.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
        assert_eq!(&bytes[377..381], b"copc");
        // The info record follows the file header and its own header.
        let (page, page_bytes) = (u64_at(375 + 54 + 40), u64_at(375 + 54 + 48));
        let i32_at = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let mut by_level = [0; 3];
        for node in (page..page + page_bytes).step_by(NODE_BYTES) {
            by_level[i32_at(node) as usize] += i32_at(node + 28);
        }
        assert_eq!(by_level.iter().sum::<i32>(), 40_000);
        assert_eq!(by_level[0], 50 * 50);
        // One chunk per node in file order, read by the library.
        let mut reader = ::las::Reader::from_path(&path).unwrap();
        let data = reader.read_points(50_000).unwrap();
        let mut found: Vec<[i64; 3]> = data
            .points()
            .map(|point| point.unwrap())
            .map(|point| [point.x, point.y, point.z].map(|m| (m / 0.5).floor() as i64))
            .collect();
        let mut expected: Vec<_> = rows.iter().map(|row| row.index.map(i64::from)).collect();
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected);
    }
}

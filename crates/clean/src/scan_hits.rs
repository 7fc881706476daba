use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use voxtile::mapper::KeptScan;
use voxtile::scan::{ScanPoints, Stop, is_hit};
use voxtile::space::{Grid, Point, TileBox, VoxelIndex};
use voxtile::{Aabb, Error, Result};
use voxtile_scratch::ScratchFile;

/// Maximum number of parts of a scan, each of which has a buffer.
const MAX_PARTS: u64 = 256;
/// Length of a hit in the temporary file.
const HIT_BYTES: usize = 20;
/// Number of hits that are written at once.
const HITS_AT_ONCE: usize = 1024;
/// Bit of the number of a point in the temporary file: the point may be marked.
const MAY_MOVE: u64 = 1 << 63;

/// Hit of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) voxel: VoxelIndex,
    /// Number of the point in the scan.
    pub(crate) number: u64,
    /// Whether the point may be marked: it is in the region, and in the part of the scan, not only near it.
    pub(crate) may_move: bool,
}

impl Hit {
    fn to_bytes(self) -> [u8; HIT_BYTES] {
        let mut bytes = [0; HIT_BYTES];
        let (voxel, number) = bytes.split_at_mut(12);
        for (bytes, index) in voxel.chunks_exact_mut(4).zip(self.voxel) {
            bytes.copy_from_slice(&index.to_le_bytes());
        }
        number.copy_from_slice(&(self.number | if self.may_move { MAY_MOVE } else { 0 }).to_le_bytes());
        bytes
    }

    fn from_bytes(bytes: &[u8; HIT_BYTES]) -> Self {
        let [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3, number @ ..] = *bytes;
        let voxel = [[x0, x1, x2, x3], [y0, y1, y2, y3], [z0, z1, z2, z3]].map(i32::from_le_bytes);
        let number = u64::from_le_bytes(number);
        Self { voxel, number: number & !MAY_MOVE, may_move: number & MAY_MOVE != 0 }
    }
}

/// Hits of a scan in the order of the points, read from the scan at each use.
#[derive(Debug)]
pub(crate) struct HitReader<'a> {
    pub(crate) scan: &'a KeptScan,
    pub(crate) grid: Grid,
    /// Box outside of which no point may be marked.
    pub(crate) region: Option<Aabb>,
    /// Tiles outside of which hits are ignored.
    pub(crate) tiles: Option<TileBox>,
    pub(crate) stop: &'a Stop,
}

impl HitReader<'_> {
    /// # Errors
    ///
    /// Damage, an I/O error, an error of `take`, or a request to stop.
    fn for_each(&self, mut take: impl FnMut(Hit) -> Result<()>) -> Result<()> {
        let (rays, origin, mut number) = (self.scan.rays(), self.scan.origin(), 0);
        let mut take_all = |points: &[Point]| {
            for &point in points {
                if is_hit(rays, origin, point)
                    && let Some(voxel) = self.grid.voxel_of(point)
                    && self.tiles.is_none_or(|tiles| tiles.contains(self.grid.tile_of_voxel(voxel)))
                {
                    let may_move = self.region.is_none_or(|region| region.contains(point));
                    take(Hit { voxel, number, may_move })?;
                }
                number += 1;
            }
            self.stop.check()
        };
        let mut taken = Ok(());
        self.scan.for_each_chunk(0..self.scan.len(), &mut |points, _| {
            taken = take_all(points);
            taken.is_ok()
        })?;
        taken
    }
}

/// Hits of a scan, divided along x into parts of whole tiles if there are many.
#[derive(Debug)]
pub(crate) struct ScanHits<'a> {
    all: HitReader<'a>,
    split: Option<SplitHits>,
}

impl<'a> ScanHits<'a> {
    /// Divides a scan of more than `max_points` points into parts of about so many points, in a temporary file in
    /// `folder`. Each part also has the hits up to `margin` voxels along x outside of its tiles.
    ///
    /// # Errors
    ///
    /// Damage, an I/O error, or a request to stop.
    pub(crate) fn of(all: HitReader<'a>, margin: i32, max_points: u64, folder: &Path) -> Result<Self> {
        let points = all.scan.len() as u64;
        let split = match points > max_points {
            true => Some(SplitHits::of(&all, margin, max_points.max(points / MAX_PARTS), folder)?),
            false => None,
        };
        Ok(Self { all, split })
    }

    /// Number of parts, at least one.
    pub(crate) fn parts(&self) -> usize {
        self.split.as_ref().map_or(1, |split| split.parts.len())
    }

    /// Passes the hits of a part.
    ///
    /// # Errors
    ///
    /// Damage, an I/O error, or a request to stop.
    pub(crate) fn for_each(&mut self, part: usize, mut take: impl FnMut(Hit)) -> Result<()> {
        match &mut self.split {
            Some(split) => {
                self.all.stop.check()?;
                split.for_each(part, take)
            }
            None => self.all.for_each(|hit| {
                take(hit);
                Ok(())
            }),
        }
    }
}

/// Hits of the parts of a scan, in an unnamed temporary file.
#[derive(Debug)]
struct SplitHits {
    folder: PathBuf,
    file: ScratchFile,
    parts: Vec<Part>,
}

#[derive(Debug, Default)]
struct Part {
    /// Highest tile index along x. Parts are in order, and the last has no limit.
    last_tile_x: i32,
    /// Offsets and lengths in the file.
    chunks: Vec<(u64, usize)>,
    /// Hits that are not yet in the file.
    buffer: Vec<u8>,
}

impl SplitHits {
    fn of(all: &HitReader<'_>, margin: i32, max_points: u64, folder: &Path) -> Result<Self> {
        let tile_x = |x: i32| all.grid.tile_of_voxel([x, 0, 0]).x;
        let mut counts = BTreeMap::<i32, u64>::new();
        all.for_each(|hit| {
            *counts.entry(tile_x(hit.voxel[0])).or_default() += 1;
            Ok(())
        })?;
        let file = ScratchFile::in_folder(folder)
            .map_err(|error| Error::io(folder, "create a temporary file in", error))?;
        let mut split = Self { folder: folder.to_owned(), file, parts: parts_of(&counts, max_points) };
        all.for_each(|hit| {
            let x = hit.voxel[0];
            let own = split.part_of(tile_x(x));
            let first = split.part_of(tile_x(x.saturating_sub(margin)));
            let last = split.part_of(tile_x(x.saturating_add(margin)));
            (first..=last)
                .try_for_each(|part| split.push(part, Hit { may_move: hit.may_move && part == own, ..hit }))
        })?;
        (0..split.parts.len()).try_for_each(|part| split.write(part))?;
        Ok(split)
    }

    fn part_of(&self, tile_x: i32) -> usize {
        self.parts.partition_point(|part| part.last_tile_x < tile_x)
    }

    fn push(&mut self, part: usize, hit: Hit) -> Result<()> {
        let buffer = &mut self.parts[part].buffer;
        buffer.extend_from_slice(&hit.to_bytes());
        if buffer.len() < HITS_AT_ONCE * HIT_BYTES { Ok(()) } else { self.write(part) }
    }

    fn write(&mut self, part: usize) -> Result<()> {
        let Part { chunks, buffer, .. } = &mut self.parts[part];
        let offset = self.file.len();
        self.file
            .append(buffer)
            .map_err(|error| Error::io(&self.folder, "write a temporary file in", error))?;
        chunks.push((offset, buffer.len()));
        buffer.clear();
        Ok(())
    }

    fn for_each(&mut self, part: usize, mut take: impl FnMut(Hit)) -> Result<()> {
        for &(offset, length) in &self.parts[part].chunks {
            let bytes: io::Result<&[u8]> = self.file.bytes(offset, length);
            let bytes = bytes.map_err(|error| Error::io(&self.folder, "read a temporary file in", error))?;
            bytes.as_chunks().0.iter().for_each(|hit| take(Hit::from_bytes(hit)));
        }
        Ok(())
    }
}

/// Divides tiles along x, with their numbers of hits, into parts of at most `max_points` hits if possible.
fn parts_of(counts: &BTreeMap<i32, u64>, max_points: u64) -> Vec<Part> {
    let (mut parts, mut points) = (Vec::new(), 0);
    for (&x, &count) in counts {
        if points > 0 && points + count > max_points {
            parts.push(Part { last_tile_x: x - 1, ..Part::default() });
            points = 0;
        }
        points += count;
    }
    parts.push(Part { last_tile_x: i32::MAX, ..Part::default() });
    parts
}

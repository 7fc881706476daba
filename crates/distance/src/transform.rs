use crate::bits::Bits;
use crate::cap::Cap;
use crate::extent::Extent;
use crate::line::{Column, FAR_LINE, LANES, Line};
use crate::row_squares::RowSquares;
use rayon::prelude::*;

/// Separable distance transform of a box: the squared distance of each voxel to the nearest marked voxel, up to a cap.
///
/// ```text
/// bits of the box and of its surroundings within the cap
///   -> squared distance along x           row_squares   for each plane
///   -> least sum with that along y        planes        for the box along x and y, the surroundings along z
///   -> least sum with that along z        lines         for the box
/// ```
///
/// The cap bounds how far each pass looks. So the passes compare whole lines, 32 voxels at a time, in 16 bits.
#[derive(Debug)]
pub(crate) struct Transform {
    extent: Extent,
    cap: Cap,
    squares: RowSquares,
    /// Lines along x of a row.
    chunks: usize,
    /// Result of the passes along x and y: by z of the surroundings, y, chunk.
    planes: Vec<Line>,
    /// Result: by y, z, chunk.
    lines: Vec<Line>,
}

/// Reads the bits of a row of the surroundings, given its y and z.
pub(crate) trait Rows: Sync {
    fn read(&self, y: usize, z: usize, row: &mut [u64]);
}

impl<F: Fn(usize, usize, &mut [u64]) + Sync> Rows for F {
    fn read(&self, y: usize, z: usize, row: &mut [u64]) {
        self(y, z, row);
    }
}

/// Buffers of one plane.
struct Plane {
    row: Vec<u64>,
    /// Squared distances along x, by y of the surroundings, chunk.
    along_x: Vec<Line>,
    column: Column,
}

impl Transform {
    pub(crate) fn new(extent: Extent, cap: Cap) -> Self {
        let [x, y, z] = extent.size;
        let chunks = x.div_ceil(LANES);
        Self {
            extent,
            cap,
            squares: RowSquares::new(cap),
            chunks,
            planes: vec![FAR_LINE; chunks * y * (z + 2 * cap.reach)],
            lines: vec![FAR_LINE; chunks * y * z],
        }
    }

    /// Bytes of memory of a transform, without its bits.
    pub(crate) fn bytes_of(size: [usize; 3], cap: Cap) -> usize {
        let [x, y, z] = size;
        let row_bytes = x.div_ceil(LANES) * size_of::<Line>();
        let plane_bytes = row_bytes * (y + 2 * cap.reach) * rayon::current_num_threads();
        row_bytes * y * (2 * z + 2 * cap.reach) + plane_bytes
    }

    fn new_plane(&self) -> Plane {
        let around = self.extent.grown(self.cap.reach);
        Plane {
            row: vec![0; Bits::words_per_row(around.size[0])],
            along_x: vec![FAR_LINE; self.chunks * around.size[1]],
            column: Column::default(),
        }
    }

    /// Computes all distances.
    pub(crate) fn compute(&mut self, rows: &impl Rows) {
        let mut planes = std::mem::take(&mut self.planes);
        let [_, y_edge, z_edge] = self.extent.size;
        let [all_y, all_z] = [y_edge, z_edge].map(|edge| vec![true; edge]);
        let plane_lines = (self.chunks * y_edge).max(1);
        planes.par_chunks_mut(plane_lines).enumerate().for_each_init(
            || self.new_plane(),
            |buffers, (z, plane)| self.compute_plane(rows, z, buffers, &all_y, plane),
        );
        let mut lines = std::mem::take(&mut self.lines);
        let row_lines = (self.chunks * z_edge).max(1);
        lines.par_chunks_mut(row_lines).enumerate().for_each_init(Column::default, |column, (y, lines)| {
            for chunk in 0..self.chunks {
                self.compute_column(&planes, y, chunk, column, &all_z, lines);
            }
        });
        (self.planes, self.lines) = (planes, lines);
    }

    /// Computes again what depends on changed rows: `is_changed` has a flag for each row of the surroundings, by z,
    /// then y.
    pub(crate) fn update(&mut self, rows: &impl Rows, is_changed: &[bool]) {
        let [_, y_edge, z_edge] = self.extent.size;
        let reach = self.cap.reach;
        let (y_around, plane_lines) = (y_edge + 2 * reach, (self.chunks * y_edge).max(1));
        let mut planes = std::mem::take(&mut self.planes);
        // Whether a line of the planes has changed, in the order of the planes.
        let mut has_changed = vec![false; planes.len()];
        let per_plane = planes.par_chunks_mut(plane_lines).zip(has_changed.par_chunks_mut(plane_lines));
        per_plane.zip(is_changed.par_chunks(y_around.max(1))).enumerate().for_each_init(
            || (self.new_plane(), Vec::new(), Vec::new()),
            |(buffers, wanted, before), (z, ((plane, has_changed), is_changed))| {
                if !within_reach(is_changed.iter().copied(), reach, wanted) {
                    return;
                }
                before.clear();
                before.extend_from_slice(plane);
                self.compute_plane(rows, z, buffers, wanted, plane);
                for ((before, after), flag) in before.iter().zip(&*plane).zip(has_changed) {
                    *flag = before != after;
                }
            },
        );
        let mut lines = std::mem::take(&mut self.lines);
        let row_lines = (self.chunks * z_edge).max(1);
        lines.par_chunks_mut(row_lines).enumerate().for_each_init(
            || (Column::default(), Vec::new()),
            |(column, wanted), (y, lines)| {
                for chunk in 0..self.chunks {
                    let flags = has_changed[y * self.chunks + chunk..].iter().step_by(plane_lines).copied();
                    if within_reach(flags, reach, wanted) {
                        self.compute_column(&planes, y, chunk, column, wanted, lines);
                    }
                }
            },
        );
        (self.planes, self.lines) = (planes, lines);
    }

    /// Passes along x and y of one plane, for the wanted y.
    fn compute_plane(
        &self,
        rows: &impl Rows,
        z: usize,
        buffers: &mut Plane,
        wanted: &[bool],
        plane: &mut [Line],
    ) {
        let Plane { row, along_x, column } = buffers;
        let around = self.extent.grown(self.cap.reach);
        let mut has_bits = false;
        for y in 0..around.size[1] {
            rows.read(y, z, row);
            let lines = &mut along_x[y * self.chunks..(y + 1) * self.chunks];
            if row.iter().all(|word| *word == 0) {
                lines.fill(FAR_LINE);
                continue;
            }
            has_bits = true;
            // Also beyond the edge of the box: with `FAR` there, searches would end later.
            self.squares.fill(row, around.size[0], lines.as_flattened_mut());
        }
        for chunk in 0..self.chunks {
            if has_bits {
                column.fill((0..around.size[1]).map(|y| &along_x[y * self.chunks + chunk]));
            }
            let is_far = !has_bits || !column.has_live();
            for (y, _) in wanted.iter().enumerate().filter(|(_, is_wanted)| **is_wanted) {
                let line = if is_far { FAR_LINE } else { column.least_around(y + self.cap.reach, self.cap) };
                plane[y * self.chunks + chunk] = line;
            }
        }
    }

    /// Pass along z of one column, for the wanted z.
    fn compute_column(
        &self,
        planes: &[Line],
        y: usize,
        chunk: usize,
        column: &mut Column,
        wanted: &[bool],
        lines: &mut [Line],
    ) {
        let y_edge = self.extent.size[1];
        let around = wanted.len() + 2 * self.cap.reach;
        column.fill((0..around).map(|z| &planes[(z * y_edge + y) * self.chunks + chunk]));
        let is_far = !column.has_live();
        for (z, _) in wanted.iter().enumerate().filter(|(_, is_wanted)| **is_wanted) {
            let line = if is_far { FAR_LINE } else { column.least_around(z + self.cap.reach, self.cap) };
            lines[z * self.chunks + chunk] = line;
        }
    }

    /// The squared distances, by y, z and chunk.
    pub(crate) fn lines(&self) -> &[Line] {
        &self.lines
    }

    pub(crate) fn into_lines(self) -> Vec<Line> {
        self.lines
    }
}

/// Sets for each position whether any of the flags from it to `2 * reach` further is set. Returns whether any flag is.
fn within_reach(flags: impl Iterator<Item = bool>, reach: usize, out: &mut Vec<bool>) -> bool {
    out.clear();
    let mut last = None;
    for (position, flag) in flags.enumerate() {
        if flag {
            last = Some(position);
        }
        if let Some(first) = position.checked_sub(2 * reach) {
            out.push(last.is_some_and(|last| last >= first));
        }
    }
    last.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::random_scans::Random;

    #[test]
    fn positions_within_reach_of_a_flag_are_found() {
        let mut random = Random(2);
        for _ in 0..200 {
            let (reach, edge) = (random.below(5) as usize, random.below(20) as usize);
            let flags: Vec<bool> = (0..edge + 2 * reach).map(|_| random.below(6) == 0).collect();
            let mut out = Vec::new();
            assert_eq!(within_reach(flags.iter().copied(), reach, &mut out), flags.contains(&true));
            let expected: Vec<bool> =
                (0..edge).map(|position| flags[position..=position + 2 * reach].contains(&true)).collect();
            assert_eq!(out, expected);
        }
    }
}

/// Voxels along the edge of a brick.
pub(super) const BRICK: usize = 32;
/// Edge including the layer of neighbours on both sides.
const EDGE: usize = BRICK + 2;

/// Occupied voxels of a brick and of the layer around it, so that faces between two bricks are correct in both.
pub(super) struct Brick {
    /// Colour and [`OCCUPIED`], or [`EMPTY`].
    cells: Vec<u32>,
}

const EMPTY: u32 = 0;
/// Mark of occupied voxels above the three bytes of their colours.
const OCCUPIED: u32 = 1 << 24;

/// Rectangle between occupied voxels of one colour and other voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quad {
    /// Corners in voxels from the brick's lower corner, counter-clockwise as seen from outside.
    pub(super) corners: [[u8; 3]; 4],
    pub(super) colour: [u8; 3],
}

impl Brick {
    pub(super) fn new() -> Self {
        Self { cells: vec![EMPTY; EDGE * EDGE * EDGE] }
    }

    pub(super) fn clear(&mut self) {
        self.cells.fill(EMPTY);
    }

    /// Adds a voxel. Index 0 is the layer below the brick, index 1 the first voxel of the brick.
    pub(super) fn insert(&mut self, place: [u8; 3], [red, green, blue]: [u8; 3]) {
        if let Some(voxel) = self.cells.get_mut(at(place.map(usize::from))) {
            *voxel = OCCUPIED | u32::from_be_bytes([0, red, green, blue]);
        }
    }

    fn cell(&self, place: [usize; 3]) -> u32 {
        self.cells.get(at(place)).copied().unwrap_or(EMPTY)
    }

    /// Emits the surface of the brick's own voxels as few rectangles.
    pub(super) fn quads(&self, emit: &mut dyn FnMut(Quad)) {
        let mut mask = [[EMPTY; BRICK]; BRICK];
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (is_upper, layer) in [false, true].into_iter().flat_map(|up| (0..BRICK).map(move |k| (up, k)))
            {
                let mut is_empty = true;
                for (row, line) in mask.iter_mut().enumerate() {
                    for (column, exposed) in line.iter_mut().enumerate() {
                        let mut place = [0; 3];
                        (place[axis], place[u], place[v]) = (layer + 1, column + 1, row + 1);
                        let mut neighbor = place;
                        neighbor[axis] = if is_upper { layer + 2 } else { layer };
                        *exposed = if self.cell(neighbor) == EMPTY { self.cell(place) } else { EMPTY };
                        is_empty &= *exposed == EMPTY;
                    }
                }
                if is_empty {
                    continue;
                }
                let height = if is_upper { layer + 1 } else { layer };
                rectangles(&mut mask, &mut |[u0, v0], [u1, v1], cell| {
                    let corner = |at_u: usize, at_v: usize| {
                        let mut corner = [0; 3];
                        (corner[axis], corner[u], corner[v]) = (height as u8, at_u as u8, at_v as u8);
                        corner
                    };
                    let mut corners = [corner(u0, v0), corner(u1, v0), corner(u1, v1), corner(u0, v1)];
                    if !is_upper {
                        corners.reverse();
                    }
                    let [_, red, green, blue] = cell.to_be_bytes();
                    emit(Quad { corners, colour: [red, green, blue] });
                });
            }
        }
    }
}

fn at([x, y, z]: [usize; 3]) -> usize {
    (z * EDGE + y) * EDGE + x
}

/// Covers the cells that are not empty with rectangles of equal cells, row by row: first extended in width, then in
/// height.
fn rectangles(mask: &mut [[u32; BRICK]; BRICK], emit: &mut dyn FnMut([usize; 2], [usize; 2], u32)) {
    for row in 0..BRICK {
        let mut column = 0;
        while column < BRICK {
            let cell = mask[row][column];
            if cell == EMPTY {
                column += 1;
                continue;
            }
            let end = (column..BRICK).find(|&k| mask[row][k] != cell).unwrap_or(BRICK);
            let is_full = |line: &[u32; BRICK]| line[column..end].iter().all(|&other| other == cell);
            let top = (row..BRICK).find(|&k| !is_full(&mask[k])).unwrap_or(BRICK);
            mask[row..top].iter_mut().for_each(|line| line[column..end].fill(EMPTY));
            emit([column, row], [end, top], cell);
            column = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(quad: &Quad) -> usize {
        let [a, b, c, _] = quad.corners;
        let length = |p: [u8; 3], q: [u8; 3]| (0..3).map(|k| usize::from(p[k].abs_diff(q[k]))).sum::<usize>();
        length(a, b) * length(b, c)
    }

    #[test]
    fn a_full_brick_has_six_faces() {
        let mut brick = Brick::new();
        for x in 1..=BRICK as u8 {
            for y in 1..=BRICK as u8 {
                (1..=BRICK as u8).for_each(|z| brick.insert([x, y, z], [0; 3]));
            }
        }
        let mut quads = Vec::new();
        brick.quads(&mut |quad| quads.push(quad));
        assert_eq!(quads.len(), 6);
        assert!(quads.iter().all(|quad| area(quad) == BRICK * BRICK));
    }

    #[test]
    fn neighbours_of_the_brick_hide_faces() {
        let mut brick = Brick::new();
        brick.insert([1, 5, 5], [9; 3]);
        brick.insert([0, 5, 5], [200; 3]);
        let mut quads = Vec::new();
        brick.quads(&mut |quad| quads.push(quad));
        assert_eq!(quads.iter().map(area).sum::<usize>(), 5);
        assert!(quads.iter().all(|quad| quad.corners.iter().any(|corner| corner[0] == 1)));
    }

    #[test]
    fn faces_of_different_colours_are_apart() {
        let mut brick = Brick::new();
        for x in 1..=4 {
            brick.insert([x, 7, 7], if x == 3 { [1, 2, 3] } else { [0; 3] });
        }
        let mut quads = Vec::new();
        brick.quads(&mut |quad| quads.push(quad));
        let area_of =
            |colour: [u8; 3]| quads.iter().filter(|quad| quad.colour == colour).map(area).sum::<usize>();
        assert_eq!((area_of([1, 2, 3]), area_of([0; 3])), (4, 14));
        // Both ends, and three rectangles along each of four sides.
        assert_eq!(quads.len(), 2 + 3 * 4);
    }
}

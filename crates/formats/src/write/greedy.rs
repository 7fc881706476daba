/// Voxels along the edge of a brick.
pub(super) const BRICK: usize = 32;
/// Edge including the layer of neighbours on both sides.
const EDGE: usize = BRICK + 2;

/// Occupied voxels of a brick and of the layer around it, so that faces between two bricks are correct in both.
pub(super) struct Brick {
    occupied: Vec<bool>,
}

/// Rectangle between occupied and other voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quad {
    /// Corners in voxels from the brick's lower corner, counter-clockwise as seen from outside.
    pub(super) corners: [[u8; 3]; 4],
}

impl Brick {
    pub(super) fn new() -> Self {
        Self { occupied: vec![false; EDGE * EDGE * EDGE] }
    }

    pub(super) fn clear(&mut self) {
        self.occupied.fill(false);
    }

    /// Adds a voxel. Index 0 is the layer below the brick, index 1 the first voxel of the brick.
    pub(super) fn insert(&mut self, place: [u8; 3]) {
        if let Some(voxel) = self.occupied.get_mut(at(place.map(usize::from))) {
            *voxel = true;
        }
    }

    fn has(&self, place: [usize; 3]) -> bool {
        self.occupied.get(at(place)).copied().unwrap_or(false)
    }

    /// Emits the surface of the brick's own voxels as few rectangles.
    pub(super) fn quads(&self, emit: &mut dyn FnMut(Quad)) {
        let mut mask = [[false; BRICK]; BRICK];
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (is_upper, layer) in [false, true].into_iter().flat_map(|up| (0..BRICK).map(move |k| (up, k)))
            {
                let mut is_empty = true;
                for (row, line) in mask.iter_mut().enumerate() {
                    for (column, is_exposed) in line.iter_mut().enumerate() {
                        let mut place = [0; 3];
                        (place[axis], place[u], place[v]) = (layer + 1, column + 1, row + 1);
                        let mut neighbor = place;
                        neighbor[axis] = if is_upper { layer + 2 } else { layer };
                        *is_exposed = self.has(place) && !self.has(neighbor);
                        is_empty &= !*is_exposed;
                    }
                }
                if is_empty {
                    continue;
                }
                let height = if is_upper { layer + 1 } else { layer };
                rectangles(&mut mask, &mut |[u0, v0], [u1, v1]| {
                    let corner = |at_u: usize, at_v: usize| {
                        let mut corner = [0; 3];
                        (corner[axis], corner[u], corner[v]) = (height as u8, at_u as u8, at_v as u8);
                        corner
                    };
                    let mut corners = [corner(u0, v0), corner(u1, v0), corner(u1, v1), corner(u0, v1)];
                    if !is_upper {
                        corners.reverse();
                    }
                    emit(Quad { corners });
                });
            }
        }
    }
}

fn at([x, y, z]: [usize; 3]) -> usize {
    (z * EDGE + y) * EDGE + x
}

/// Covers the set cells with rectangles, row by row: first extended in width, then in height.
fn rectangles(mask: &mut [[bool; BRICK]; BRICK], emit: &mut dyn FnMut([usize; 2], [usize; 2])) {
    for row in 0..BRICK {
        let mut column = 0;
        while column < BRICK {
            if !mask[row][column] {
                column += 1;
                continue;
            }
            let end = (column..BRICK).find(|&k| !mask[row][k]).unwrap_or(BRICK);
            let is_full = |line: &[bool; BRICK]| line[column..end].iter().all(|&is_set| is_set);
            let top = (row..BRICK).find(|&k| !is_full(&mask[k])).unwrap_or(BRICK);
            mask[row..top].iter_mut().for_each(|line| line[column..end].fill(false));
            emit([column, row], [end, top]);
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
                (1..=BRICK as u8).for_each(|z| brick.insert([x, y, z]));
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
        brick.insert([1, 5, 5]);
        brick.insert([0, 5, 5]);
        let mut quads = Vec::new();
        brick.quads(&mut |quad| quads.push(quad));
        assert_eq!(quads.iter().map(area).sum::<usize>(), 5);
        assert!(quads.iter().all(|quad| quad.corners.iter().any(|corner| corner[0] == 1)));
    }
}

/// Bits of x in a Morton code. The bits of y and z are one and two positions higher.
const X_BITS: u64 = 0x1249_2492_4924_9249;

/// Indices of a node's face neighbours in the list of its level: for each axis, the lower and the upper neighbour.
pub(super) struct Faces(pub(super) [[Option<usize>; 2]; 3]);

impl Faces {
    /// `nodes` are the Morton codes of a level in ascending order; each has `levels` levels.
    pub(super) fn of(nodes: &[u64], number: usize, levels: u32) -> Self {
        let code = nodes[number];
        Self(std::array::from_fn(|axis| {
            let find = |neighbor: Option<u64>| nodes.binary_search(&neighbor?).ok();
            let [below, above] = axis_neighbors(code, axis, levels);
            let others = code & !(X_BITS << axis);
            [find(below.map(|part| part | others)), find(above.map(|part| part | others))]
        }))
    }
}

/// Returns the bits of one axis of a code, decremented and incremented. An element is `None` if it would be outside of
/// the cube.
fn axis_neighbors(code: u64, axis: usize, levels: u32) -> [Option<u64>; 2] {
    let axis_bits = (X_BITS << axis) & ((1 << (3 * levels)) - 1);
    let part = code & axis_bits;
    let below = (part != 0).then(|| part.wrapping_sub(1) & axis_bits);
    let above = (part != axis_bits).then(|| (part | !axis_bits).wrapping_add(1) & axis_bits);
    [below, above]
}

/// Returns the codes of the up to 26 cells around a cell.
pub(super) fn around(code: u64, levels: u32) -> impl Iterator<Item = u64> {
    let parts: [[Option<u64>; 3]; 3] = std::array::from_fn(|axis| {
        let [below, above] = axis_neighbors(code, axis, levels);
        [below, Some(code & (X_BITS << axis)), above]
    });
    (0..27).filter(|&cell| cell != 13).filter_map(move |cell: usize| {
        Some(parts[0][cell % 3]? | parts[1][cell / 3 % 3]? | parts[2][cell / 9]?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_around_match_plain_coordinates() {
        let code = |[x, y, z]: [i64; 3]| {
            (0..3).map(|k| ((x >> k & 1) | (y >> k & 1) << 1 | (z >> k & 1) << 2) << (3 * k)).sum::<i64>()
                as u64
        };
        let cells: Vec<[i64; 3]> = (0..512).map(|n| [n & 7, n >> 3 & 7, n >> 6]).collect();
        for &cell in &cells {
            let mut found: Vec<u64> = around(code(cell), 3).collect();
            let is_near =
                |other: &&[i64; 3]| **other != cell && (0..3).all(|k| (other[k] - cell[k]).abs() <= 1);
            let mut expected: Vec<u64> = cells.iter().filter(is_near).map(|&other| code(other)).collect();
            found.sort_unstable();
            expected.sort_unstable();
            assert_eq!(found, expected);
        }
    }
}

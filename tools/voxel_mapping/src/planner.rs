use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use voxtile::space::Point;
use voxtile::{Queries, UnknownAs};
use voxtile_local::{LocalState, LocalView, Obstacle};

/// Between the nodes of the search.
const STEP_M: f64 = 0.4;
/// Nodes that a search looks at before it gives up.
const MAX_NODES: usize = 60_000;
/// Heights between which is flown.
const HEIGHTS_M: [f64; 2] = [1.0, 4.0];

/// A node of the search, in steps from its beginning.
type Node = [i32; 3];

/// A plain A* search over a grid of 26 neighbors, among voxels that are not inflated; what is unknown is free. The path
/// is then drawn tight. `None` if there is no way.
pub fn plan(view: &LocalView, from: Point, to: Point) -> Option<Vec<Point>> {
    let point = |node: Node| std::array::from_fn(|k| from[k] + f64::from(node[k]) * STEP_M);
    // In whole hundredths of a step, so that nodes can be ordered.
    let ahead = |node: Node| (distance_m(point(node), to) / STEP_M * 100.0) as u32;
    let mut open = BinaryHeap::from([(Reverse(ahead([0; 3])), [0; 3])]);
    let mut best: HashMap<Node, (u32, Node)> = HashMap::from([([0; 3], (0, [0; 3]))]);
    let mut closed = std::collections::HashSet::new();
    while let Some((_, node)) = open.pop() {
        if distance_m(point(node), to) <= STEP_M {
            return Some(tightened(view, way_to(&best, node).into_iter().map(point).collect()));
        }
        if !closed.insert(node) {
            continue;
        }
        if closed.len() > MAX_NODES {
            return None;
        }
        let cost = best[&node].0;
        for step in neighbors() {
            let next: Node = std::array::from_fn(|k| node[k] + step[k]);
            let at = point(next);
            if at[2] < HEIGHTS_M[0] || at[2] > HEIGHTS_M[1] || view.state_at(at) != LocalState::None {
                continue;
            }
            let length = f64::from(step.iter().map(|k| k * k).sum::<i32>()).sqrt();
            let cost = cost + (length * 100.0) as u32;
            // Out of an inflated voxel any step leads; otherwise none through one.
            let is_known = best.get(&next).is_some_and(|(known, _)| *known <= cost);
            if !is_known && (node == [0; 3] || is_free(view, point(node), at)) {
                best.insert(next, (cost, node));
                open.push((Reverse(cost + ahead(next)), next));
            }
        }
    }
    None
}

fn neighbors() -> impl Iterator<Item = Node> {
    (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]).filter(|step| *step != [0; 3])
}

fn way_to(best: &HashMap<Node, (u32, Node)>, mut node: Node) -> Vec<Node> {
    let mut way = vec![node];
    while node != [0; 3] {
        node = best[&node].1;
        way.push(node);
    }
    way.reverse();
    way
}

/// The path without the corners that can be cut.
fn tightened(view: &LocalView, path: Vec<Point>) -> Vec<Point> {
    let mut tight = vec![path[0]];
    let mut at = 0;
    while at + 1 < path.len() {
        let next = (at + 1..path.len()).rev().find(|&k| k == at + 1 || is_free(view, path[at], path[k]));
        at = next.unwrap_or(at + 1);
        tight.push(path[at]);
    }
    tight
}

/// Whether a straight line meets no inflated voxel.
pub fn is_free(view: &LocalView, from: Point, to: Point) -> bool {
    let way = view.obstacles(Obstacle::Inflated).cast_segment(from, to, UnknownAs::Free);
    matches!(way, Ok(None))
}

pub fn distance_m(a: Point, b: Point) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use voxtile::space::Point;
use voxtile::{Queries, UnknownAs};
use voxtile_local::{LocalState, LocalView, Obstacle};

/// Distance between the nodes of the search.
const STEP_M: f64 = 0.4;
/// Maximum number of nodes of a search.
const MAX_NODES: usize = 60_000;
/// Minimum and maximum flight height.
const HEIGHTS_M: [f64; 2] = [1.0, 4.0];

/// A node of the search, in steps from the start.
type Node = [i32; 3];

/// Plans with A* on a grid of 26 neighbors, among voxels that are not inflated; unknown voxels are free. Shortcuts then
/// straighten the path. Returns `None` if there is no path.
pub fn plan(view: &LocalView, from: Point, to: Point) -> Option<Vec<Point>> {
    let point = |node: Node| std::array::from_fn(|k| from[k] + f64::from(node[k]) * STEP_M);
    // In hundredths of a step, as integers, so that nodes can be ordered.
    let ahead = |node: Node| (distance_m(point(node), to) / STEP_M * 100.0) as u32;
    let mut open = BinaryHeap::from([(Reverse(ahead([0; 3])), [0; 3])]);
    let mut best: HashMap<Node, (u32, Node)> = HashMap::from([([0; 3], (0, [0; 3]))]);
    let mut closed = std::collections::HashSet::new();
    while let Some((_, node)) = open.pop() {
        if distance_m(point(node), to) <= STEP_M {
            return Some(tightened(view, path_to(&best, node).into_iter().map(point).collect()));
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
            // The start may be in an inflated voxel. Later steps must not cross one.
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

fn path_to(best: &HashMap<Node, (u32, Node)>, mut node: Node) -> Vec<Node> {
    let mut path = vec![node];
    while node != [0; 3] {
        node = best[&node].1;
        path.push(node);
    }
    path.reverse();
    path
}

/// Removes corners that can be cut.
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

/// Returns whether a segment crosses no inflated voxel.
pub fn is_free(view: &LocalView, from: Point, to: Point) -> bool {
    let path = view.obstacles(Obstacle::Inflated).cast_segment(from, to, UnknownAs::Free);
    matches!(path, Ok(None))
}

pub fn distance_m(a: Point, b: Point) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

use super::node_key::NodeKey;
use super::scheme::Scheme;
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;
use voxtile::MapConfig;
use voxtile::sensor::Evidence;
use voxtile::tile::Tile;

/// Kind of the voxels of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Occupied, by the map's threshold.
    Occupied,
    /// Observed, and below the threshold.
    Free,
    /// Never observed, next to a free voxel of the same tile: the boundary of the unknown (frontier).
    Unknown,
}

/// One voxel of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    /// Position in the node: z in bits 16 to 23, y in 8 to 15, x in 0 to 7. Cells are sorted by it.
    pub(super) place: u32,
    /// Log-odds, from 0 to 255 on a [`Scale`].
    pub(super) value: u8,
    /// `round(16 log2(1 + n))` of the number of observations.
    pub(super) count: u8,
}

/// Voxels of a node, sorted by position.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Cells {
    pub(super) cells: Vec<Cell>,
    /// Number of the last scan that may have changed these voxels; 0 if unknown.
    pub(super) last_scan: u64,
}

/// Linear mapping of log-odds from `least` to `most` to values from 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) least: f64,
    pub(super) most: f64,
}

impl Scale {
    /// Returns the scale for a kind of voxels: from the occupancy threshold to the maximum log-odds for occupied
    /// voxels, from the minimum to the threshold for others.
    pub(super) fn of(config: &MapConfig, kind: Kind) -> Self {
        let [min, max] = config.sensor_model.limits();
        let threshold = config.occupied_log_odds();
        let (least, most) = match kind {
            Kind::Occupied => (threshold, max),
            Kind::Free | Kind::Unknown => (min, threshold),
        };
        Self { least, most: if most > least { most } else { least + 1.0 } }
    }

    fn value(self, log_odds: f64) -> u8 {
        (255.0 * (log_odds - self.least) / (self.most - self.least)).round() as u8
    }
}

fn count_of(observations: i32) -> u8 {
    (16.0 * (1.0 + f64::from(observations.max(0))).log2()).round() as u8
}

pub(super) fn place(cell: [i64; 3]) -> u32 {
    cell.iter().rev().fold(0, |place, &k| place << 8 | (k as u32 & 0xff))
}

/// Returns the position along x, y and z.
pub(super) fn axes(place: u32) -> [i64; 3] {
    [0, 8, 16].map(|shift| i64::from(place >> shift & 0xff))
}

impl Cells {
    /// Returns the positions of the voxels in the node.
    pub(super) fn positions(&self) -> impl Iterator<Item = [u8; 3]> {
        self.cells.iter().map(|cell| axes(cell.place).map(|at| at as u8))
    }

    /// Returns the voxels of a kind in a node that is a tile or a part of one.
    pub(super) fn of_tile(
        scheme: Scheme,
        key: NodeKey,
        tile: &Tile,
        config: &MapConfig,
        kind: Kind,
        last_scan: u64,
    ) -> Self {
        let (first, edges) = (scheme.first_voxel(key), scheme.edges(key));
        let own = |voxel: [i32; 3]| {
            let cell = [0, 1, 2].map(|k| (i64::from(voxel[k]) - first[k]) >> key.level);
            (0..3).all(|k| cell[k] >= 0 && cell[k] < edges[k]).then_some(cell)
        };
        let (threshold, scale) = (config.occupied_log_odds(), Scale::of(config, kind));
        let mut cells = Vec::new();
        match kind {
            Kind::Unknown => {
                let unknown = unknown_next_to_free(tile, threshold);
                cells.extend(unknown.into_iter().filter_map(own).map(|cell| Cell {
                    place: place(cell),
                    value: 0,
                    count: 0,
                }));
            }
            _ => {
                let is_wanted =
                    |evidence: &Evidence| (evidence.log_odds >= threshold) == (kind == Kind::Occupied);
                for voxel in tile.voxels().filter(|voxel| is_wanted(&voxel.evidence)) {
                    if let Some(cell) = own(voxel.index) {
                        let value = scale.value(voxel.evidence.log_odds);
                        let count = count_of(voxel.evidence.observation_count);
                        cells.push(Cell { place: place(cell), value, count });
                    }
                }
            }
        }
        Self { cells: merged(cells), last_scan }
    }

    /// Returns the occupied voxels of all nodes of a tile: of the tile itself and of each block of it.
    pub(super) fn of_nodes_of_tile(
        scheme: Scheme,
        tile: &Tile,
        config: &MapConfig,
        last_scan: u64,
    ) -> BTreeMap<NodeKey, Self> {
        let index = tile.index();
        let keys = scheme.nodes_of_tile(index).into_iter();
        let mut nodes: BTreeMap<_, _> =
            keys.map(|key| (key, Self { cells: Vec::new(), last_scan })).collect();
        let (threshold, scale) = (config.occupied_log_odds(), Scale::of(config, Kind::Occupied));
        for voxel in tile.voxels_from(threshold) {
            let value = scale.value(voxel.evidence.log_odds);
            let count = count_of(voxel.evidence.observation_count);
            for level in 0..=scheme.tile_level() {
                let (key, at) = scheme.node_of_voxel(index, voxel.index, level);
                if let Some(node) = nodes.get_mut(&key) {
                    node.cells.push(Cell { place: place(at), value, count });
                }
            }
        }
        for node in nodes.values_mut() {
            node.cells = merged(std::mem::take(&mut node.cells));
        }
        nodes
    }

    /// Adds the voxels of a child node. Each maps to one or two coarser voxels, which keep the maximum value. Call
    /// [`Cells::sort`] after the last child.
    pub(super) fn add_child(&mut self, scheme: Scheme, own: NodeKey, child: NodeKey, cells: &Self) {
        for cell in &cells.cells {
            let coarser = scheme.coarser(own, child, axes(cell.place));
            self.cells.extend(coarser.map(|at| Cell { place: place(at), ..*cell }));
        }
        self.cells = merged(std::mem::take(&mut self.cells));
        self.last_scan = self.last_scan.max(cells.last_scan);
    }

    /// Returns the lowest and the highest position along each axis; `None` without voxels.
    pub(super) fn bounds(&self) -> Option<[[u8; 3]; 2]> {
        let mut bounds = None;
        for cell in &self.cells {
            let at = axes(cell.place).map(|k| k as u8);
            let [low, high] = bounds.get_or_insert([at; 2]);
            for k in 0..3 {
                low[k] = low[k].min(at[k]);
                high[k] = high[k].max(at[k]);
            }
        }
        bounds
    }
}

/// Sorts cells and merges those of one position, keeping the maximum values.
fn merged(mut cells: Vec<Cell>) -> Vec<Cell> {
    cells.sort_unstable_by_key(|cell| cell.place);
    cells.dedup_by(|later, kept| {
        let is_same = later.place == kept.place;
        if is_same {
            kept.value = kept.value.max(later.value);
            kept.count = kept.count.max(later.count);
        }
        is_same
    });
    cells
}

/// Returns the voxels of a tile that were never observed and have a free neighbour in the tile.
fn unknown_next_to_free(tile: &Tile, threshold: f64) -> FxHashSet<[i32; 3]> {
    let bounds = tile.voxel_box();
    let mut unknown = FxHashSet::default();
    for voxel in tile.voxels().filter(|voxel| voxel.evidence.log_odds < threshold) {
        for k in 0..3 {
            for step in [-1, 1] {
                let mut neighbor = voxel.index;
                neighbor[k] = neighbor[k].saturating_add(step);
                if bounds.contains(neighbor) && tile.evidence(neighbor).is_none() {
                    unknown.insert(neighbor);
                }
            }
        }
    }
    unknown
}

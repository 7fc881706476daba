use crate::components::Sums;
use crate::voxel_class::VoxelClass;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use voxtile::{Aabb, Grid, Point, VoxelIndex};

/// Result of [`compare`](crate::compare()).
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// Tolerance in voxels along each axis.
    pub tolerance_voxels: u32,
    /// Voxels of the smallest cluster that is listed.
    pub min_voxels: u64,
    /// Least log-odds of an occupied voxel of a change; their negative is the largest of a free one.
    pub certain_log_odds: f64,
    /// Counts of the occupied voxels of the earlier map.
    pub before: EpochCounts,
    /// Counts of the occupied voxels of the later map.
    pub after: EpochCounts,
    /// Clusters of voxels that vanished.
    pub vanished: Clusters,
    /// Clusters of voxels that appeared.
    pub appeared: Clusters,
    /// The listed clusters, the largest first.
    pub changes: Vec<Change>,
    /// Number of the change of each part of it in a block, by the lowest voxel of the part.
    #[serde(skip)]
    pub(crate) change_of_part: FxHashMap<VoxelIndex, u32>,
}

impl Comparison {
    /// Number of voxels of a class, small clusters included; unchanged voxels are those of the later map.
    pub fn voxels_of(&self, class: VoxelClass) -> u64 {
        match class {
            VoxelClass::Unchanged => self.after.unchanged,
            VoxelClass::Appeared => self.after.changed,
            VoxelClass::Vanished => self.before.changed,
            VoxelClass::NotSeenBefore => self.after.not_seen - self.after.hidden.unwrap_or(0),
            VoxelClass::NotSeenAfter => self.before.not_seen - self.before.hidden.unwrap_or(0),
            VoxelClass::HiddenBefore => self.after.hidden.unwrap_or(0),
            VoxelClass::HiddenAfter => self.before.hidden.unwrap_or(0),
            VoxelClass::UncertainAppeared => self.after.uncertain,
            VoxelClass::UncertainVanished => self.before.uncertain,
        }
    }
}

/// Counts of the occupied voxels of a map that is compared with another one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct EpochCounts {
    /// All occupied voxels.
    pub occupied: u64,
    /// Occupied in the other map too, within the tolerance.
    pub unchanged: u64,
    /// Seen free in the other map: vanished or appeared.
    pub changed: u64,
    /// Unknown in the other map.
    pub not_seen: u64,
    /// Of these, those that were hidden from the other map's sensor: from all positions within its range something was
    /// in front. `None` if the positions are not known.
    pub hidden: Option<u64>,
    /// Seen free in the other map, but one of the maps has too little evidence, or the other one has not observed all
    /// six neighbors.
    pub uncertain: u64,
}

impl EpochCounts {
    /// Share of the occupied voxels that the other map has seen, 0 to 1; 1 for a map without any.
    pub fn seen_share(&self) -> f64 {
        match self.occupied {
            0 => 1.0,
            all => (all - self.not_seen.min(all)) as f64 / all as f64,
        }
    }
}

impl std::ops::AddAssign for EpochCounts {
    fn add_assign(&mut self, other: Self) {
        self.occupied += other.occupied;
        self.unchanged += other.unchanged;
        self.changed += other.changed;
        self.not_seen += other.not_seen;
        self.hidden = self.hidden.zip(other.hidden).map(|(own, other)| own + other);
        self.uncertain += other.uncertain;
    }
}

/// Counts of clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Clusters {
    /// Clusters that are listed.
    pub clusters: u64,
    /// Their voxels.
    pub voxels: u64,
    /// Clusters with fewer voxels than the least.
    pub small_clusters: u64,
    /// Their voxels.
    pub small_voxels: u64,
}

impl Clusters {
    pub(crate) fn new<'a>(listed: impl Iterator<Item = &'a Sums>, [clusters, voxels]: [u64; 2]) -> Self {
        let (small_clusters, small_voxels) = (clusters, voxels);
        let empty = Self { small_clusters, small_voxels, ..Self::default() };
        listed.fold(empty, |all, sums| Self {
            clusters: all.clusters + 1,
            voxels: all.voxels + sums.voxels,
            ..all
        })
    }
}

/// Direction of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ChangeKind {
    /// Occupied in the earlier map, seen free in the later one.
    Vanished,
    /// Seen free in the earlier map, occupied in the later one.
    Appeared,
}

impl ChangeKind {
    /// Name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vanished => "vanished",
            Self::Appeared => "appeared",
        }
    }
}

/// Cluster of voxels that share faces, edges or corners, and vanished or appeared.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Change {
    /// Number, from 1 on: by the number of voxels, then by the lowest voxel.
    pub number: u32,
    /// Direction.
    pub kind: ChangeKind,
    /// Number of voxels.
    pub voxels: u64,
    /// Volume of the voxels in cubic metres. Of most things only the surface is seen, so it is less than theirs.
    pub volume_m3: f64,
    /// Box of the voxels in metres.
    pub bounds_m: Aabb,
    /// Mean of the centers in metres.
    pub center_m: Point,
    /// Mean colour of the points that hit it; `None` without this layer.
    pub colour: Option<[u8; 3]>,
    /// Class of most points that hit it; `None` without this layer.
    pub class: Option<u8>,
    /// Time stamps of the first and last scan that hit it, in nanoseconds; `None` without this layer.
    pub time_ns: Option<[i64; 2]>,
}

impl Change {
    pub(crate) fn of(number: u32, kind: ChangeKind, sums: &Sums, grid: &Grid) -> Self {
        let layers = sums.layers.as_deref();
        Self {
            number,
            kind,
            voxels: sums.voxels,
            volume_m3: sums.voxels as f64 * grid.resolution_m().powi(3),
            bounds_m: bounds_m(sums, grid),
            center_m: center_m(sums, grid),
            colour: layers.and_then(|layers| layers.mean_colour()),
            class: layers.and_then(|layers| layers.class()),
            time_ns: layers.and_then(|layers| layers.time).map(|time| [time.first_ns, time.last_ns]),
        }
    }
}

/// Box of voxels in metres.
pub(crate) fn bounds_m(sums: &Sums, grid: &Grid) -> Aabb {
    Aabb {
        min: sums.min.map(|k| grid.corner_m(k)),
        max: sums.max.map(|k| grid.corner_m(k.saturating_add(1))),
    }
}

/// Mean of the centers of voxels in metres.
pub(crate) fn center_m(sums: &Sums, grid: &Grid) -> Point {
    sums.total.map(|total| (total as f64 / sums.voxels.max(1) as f64 + 0.5) * grid.resolution_m())
}

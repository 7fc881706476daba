use serde::{Deserialize, Serialize};

/// Time for voxtile to build a map from the whole stream.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct BuildOutcome {
    /// Scans in the stream.
    pub scans: u64,
    /// Number of builds for the mean times.
    pub builds: u32,
    /// CPU seconds of the process (all threads) per build.
    pub cpu_s: f64,
    /// Wall time per build, in seconds.
    pub wall_s: f64,
}

/// Memory of a map of voxtile.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct MemoryOutcome {
    /// Voxels in the map.
    pub voxels: u64,
    /// Bytes that the map reports after the last scan.
    pub bytes: u64,
    /// Growth of the process while the scans are inserted, in bytes.
    pub resident_bytes: u64,
    /// Bytes that the map reports with all octrees up to date.
    pub synced_bytes: u64,
    /// The same, after all octrees are up to date, in bytes.
    pub synced_resident_bytes: u64,
}

/// Results of point queries.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct QuestionsOutcome {
    /// Points anywhere in the bounding box of the known voxels.
    pub anywhere: Answers,
    /// Centers of known voxels.
    pub known: Answers,
}

/// Results for one file of points.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Answers {
    /// CPU nanoseconds per query, on one thread.
    pub ns: f64,
    /// Number of known points.
    pub known: u64,
    /// Number of occupied points.
    pub occupied: u64,
}

/// Results of a run of OctoMap.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct OctomapOutcome {
    /// Scans inserted.
    pub scans: u64,
    /// CPU seconds of all insertions.
    pub cpu_s: f64,
    /// Wall time of all insertions, in seconds.
    pub wall_s: f64,
    /// Number of finest voxels in the tree.
    pub voxels: u64,
    /// Bytes from `memoryUsage`.
    pub bytes: u64,
    /// Growth of the process during the insertions, in bytes.
    pub resident_bytes: u64,
    /// Results of queries, if any.
    pub questions: Option<QuestionsOutcome>,
    /// Wall time of `writeBinary` in seconds, if requested.
    pub write_s: Option<f64>,
}

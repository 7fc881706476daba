use serde::{Deserialize, Serialize};

/// How long voxtile takes to build a map from the whole stream.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct BuildOutcome {
    /// Scans in the stream.
    pub scans: u64,
    /// Builds that the times are the mean of.
    pub builds: u32,
    /// CPU seconds of the process, all threads, a build.
    pub cpu_s: f64,
    /// Seconds on the clock, a build.
    pub wall_s: f64,
}

/// What a map of voxtile weighs.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct MemoryOutcome {
    /// Voxels that the map knows.
    pub voxels: u64,
    /// Bytes that the map counts, after the last scan.
    pub bytes: u64,
    /// Bytes by which the process had grown then since before the first scan.
    pub resident_bytes: u64,
    /// Bytes that the map counts with all octrees up to date.
    pub synced_bytes: u64,
    /// Bytes by which the process had grown then.
    pub synced_resident_bytes: u64,
}

/// How a map answered questions for points.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct QuestionsOutcome {
    /// Points anywhere in the bounding box of the known voxels.
    pub anywhere: Answers,
    /// Centers of known voxels.
    pub known: Answers,
}

/// The answers to one file of points.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Answers {
    /// Nanoseconds of CPU a question; asked on one thread.
    pub ns: f64,
    /// How many of the points were known.
    pub known: u64,
    /// How many of the points were occupied.
    pub occupied: u64,
}

/// Everything OctoMap is asked for, in one run.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct OctomapOutcome {
    /// Scans inserted.
    pub scans: u64,
    /// CPU seconds of all insertions.
    pub cpu_s: f64,
    /// Seconds on the clock of all insertions.
    pub wall_s: f64,
    /// Finest voxels that the tree knows.
    pub voxels: u64,
    /// What `memoryUsage` says.
    pub bytes: u64,
    /// Bytes by which the process grew during the insertions.
    pub resident_bytes: u64,
    /// Answers, if there were questions.
    pub questions: Option<QuestionsOutcome>,
    /// Seconds on the clock of `writeBinary`, if it was asked for.
    pub write_s: Option<f64>,
}

/// Which voxels a frame holds: the three ways of the paper's figure 4. What is lost beyond them is mended by catch-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExportPolicy {
    /// What changed since the last frame. Least bytes.
    #[default]
    LastFrame,
    /// What changed in the last so many frames, at least 1: for links without a way back.
    Ring(usize),
    /// The whole set, every time.
    Everything,
}

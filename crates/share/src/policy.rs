/// The voxels that a frame holds: the three policies of the paper's figure 4. Anti-entropy repairs what a policy loses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExportPolicy {
    /// What changed since the last frame. The fewest bytes.
    #[default]
    LastFrame,
    /// What changed in the last so many frames, at least 1: for links without a back channel.
    Ring(usize),
    /// The whole set, every time.
    Everything,
}

/// Choice of the voxels in a frame: the three policies of the paper's figure 4. Anti-entropy repairs what a policy
/// misses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExportPolicy {
    /// Voxels that changed since the last frame. Needs the fewest bytes.
    #[default]
    LastFrame,
    /// Voxels that changed in the last N frames, with N at least 1. For links without a back channel.
    Ring(usize),
    /// The whole set in every frame.
    Everything,
}

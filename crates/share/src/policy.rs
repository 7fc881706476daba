/// Choice of the voxels in a frame: the three policies in figure 4 of the paper by La, Kang and Lee. Receivers detect
/// the voxels that a policy misses, and request them.
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

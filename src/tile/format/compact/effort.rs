/// Trade-off between time and size of the [compact form](super::write_compact) of a table. Readers accept both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompactEffort {
    /// For tiles in memory.
    #[default]
    Fast,
    /// For files: some percent smaller, but takes several times as long.
    Small,
}

impl CompactEffort {
    /// The zstd levels to try. A higher one finds more repetitions, but occasionally takes more space.
    pub(super) const fn levels(self) -> &'static [i32] {
        match self {
            Self::Fast => &[1],
            Self::Small => &[5, 1],
        }
    }
}

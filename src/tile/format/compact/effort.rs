/// How much time the [compact form](super::write_compact) of a table may take. Any reader reads the result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompactEffort {
    /// For tiles in memory.
    #[default]
    Fast,
    /// For files: some percent smaller in several times the time.
    Small,
}

impl CompactEffort {
    /// The zstd levels that are tried. A higher one finds more repetitions, which now and then takes more space.
    pub(super) const fn levels(self) -> &'static [i32] {
        match self {
            Self::Fast => &[1],
            Self::Small => &[5, 1],
        }
    }
}

/// How much time the [compact form](super::write_compact) of a table may take to be made. It is read the same way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompactEffort {
    /// For tiles that wait in memory.
    #[default]
    Fast,
    /// For files: some percent smaller, several times the time.
    Small,
}

impl CompactEffort {
    /// The levels of zstd that are tried. A higher one finds more repetitions, which now and then takes more space than
    /// to find none.
    pub(super) const fn levels(self) -> &'static [i32] {
        match self {
            Self::Fast => &[1],
            Self::Small => &[5, 1],
        }
    }
}

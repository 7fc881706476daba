use voxtile::Clearing;

/// Which misses of a scan change a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClearingRule {
    /// All, as in OctoMap.
    Octomap,
    /// All but those near surfaces, which only make unknown voxels free.
    Guarded,
}

impl From<ClearingRule> for Clearing {
    fn from(rule: ClearingRule) -> Self {
        match rule {
            ClearingRule::Octomap => Self::Octomap,
            ClearingRule::Guarded => Self::guarded(),
        }
    }
}

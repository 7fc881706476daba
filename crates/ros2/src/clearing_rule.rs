use voxtile::Clearing;

/// Rule that selects which misses of a scan clear known voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClearingRule {
    /// All misses, as in OctoMap.
    Octomap,
    /// Misses away from surfaces. Misses near surfaces only make unknown voxels free.
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

use super::map_editor::edit;
use super::table_change::changed;
use crate::error::{Error, Result};
use crate::maths::exp2;
use crate::sensor::Evidence;
use crate::store::MapPath;
use serde::Serialize;

/// Rule for the decay of evidence: multiplies the log-odds of every voxel by `2^(-n / halflife)`, where `n` is the
/// number of scans since the last decay, or since the beginning. Observation counts are unchanged.
///
/// So older evidence becomes less certain with each scan, regardless of where that scan was taken, and new scans
/// outweigh it sooner. A map does not record when a voxel was last observed, so the rule depends only on the number of
/// scans, and not on caching or flushes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Decay {
    /// Half-life in scans.
    pub halflife_scans: f64,
    /// Number of scans to use instead of those since the last decay.
    pub scans: Option<u64>,
    /// Voxels with a smaller absolute log-odds after the decay become unknown; 0 keeps all.
    pub forget_below: f64,
}

/// Result of [`decay`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Decayed {
    /// Number of scans that the factor was computed from.
    pub scans: u64,
    /// Factor by which log-odds were multiplied.
    pub factor: f64,
    /// Number of voxels in the map now.
    pub voxels: u64,
    /// Number of voxels that became unknown.
    pub voxels_forgotten: u64,
    /// Number of tiles in the map now.
    pub tiles: u64,
    /// Number of tiles that lost all voxels and were removed from the map.
    pub tiles_removed: u64,
}

/// Lower limit of the absolute log-odds after a decay. As `f32`, which octrees store, smaller values would become 0,
/// and free voxels would count as occupied.
const MIN_LOG_ODDS: f64 = f32::MIN_POSITIVE as f64;

impl Decay {
    /// Returns the rule with a half-life in scans.
    pub fn new(halflife_scans: f64) -> Self {
        Self { halflife_scans, scans: None, forget_below: 0.0 }
    }

    /// Sets the number of scans.
    pub fn with_scans(self, scans: u64) -> Self {
        Self { scans: Some(scans), ..self }
    }

    /// Sets the absolute log-odds below which voxels become unknown.
    pub fn with_forget_below(self, forget_below: f64) -> Self {
        Self { forget_below, ..self }
    }

    /// Returns the factor of log-odds after `scans` scans. It is computed in `f64` by the pure-Rust `libm`, so it has
    /// the same bits on every machine.
    pub fn factor(&self, scans: u64) -> f64 {
        exp2(-(scans as f64) / self.halflife_scans)
    }

    /// Applies a factor to a voxel's evidence. Returns `None` if the voxel becomes unknown.
    pub fn faded(&self, evidence: Evidence, factor: f64) -> Option<Evidence> {
        let least = evidence.log_odds.abs().min(MIN_LOG_ODDS);
        let faded = (evidence.log_odds * factor).abs().max(least);
        (faded >= self.forget_below)
            .then_some(Evidence { log_odds: faded.copysign(evidence.log_odds), ..evidence })
    }

    fn check(&self) -> Result<()> {
        if !(self.halflife_scans > 0.0 && self.halflife_scans.is_finite()) {
            let reason = format!("{} is not a number of scans above 0", self.halflife_scans);
            return Err(Error::argument("halflife", reason));
        }
        if !(self.forget_below >= 0.0 && self.forget_below.is_finite()) {
            let reason = format!("{} is not a log-odds value of at least 0", self.forget_below);
            return Err(Error::argument("forget_below", reason));
        }
        Ok(())
    }
}

/// Applies a decay to a map, in place and in one commit. The map records the last decay. Without new scans, a repeated
/// call changes nothing, except if [`Decay::scans`] is set.
///
/// `progress` receives the number of tiles done and in total.
///
/// # Errors
///
/// No map, another writer, an invalid rule, a damaged tile, or an I/O error. The map is unchanged then.
pub fn decay(map: impl Into<MapPath>, decay: &Decay, mut progress: impl FnMut(u64, u64)) -> Result<Decayed> {
    let (disk, map) = map.into().into_parts();
    let map = &*map;
    decay.check()?;
    edit(disk, map, |editor| {
        let now = editor.scan_number();
        let last = editor.ext().map_or(0, |ext| ext.decayed_scan);
        let scans = decay.scans.unwrap_or(now.saturating_sub(last));
        let factor = decay.factor(scans);
        let tiles = editor.tiles();
        let mut decayed = Decayed { scans, factor, tiles: tiles.len() as u64, ..Decayed::default() };
        if scans == 0 && decay.forget_below == 0.0 && editor.ext().is_some() {
            let versions = tiles.iter().filter_map(|&tile| editor.version(tile));
            decayed.voxels = versions.map(|version| version.voxels).sum();
            return Ok(decayed);
        }
        for (done, &tile) in (0..).zip(&tiles) {
            progress(done, tiles.len() as u64);
            let before = editor.table(tile)?;
            let mut has_changed = false;
            let after = changed(&before, |_, evidence| {
                let after = decay.faded(evidence, factor);
                has_changed |=
                    after.is_none_or(|after| after.log_odds.to_bits() != evidence.log_odds.to_bits());
                after
            });
            decayed.voxels += after.len() as u64;
            decayed.voxels_forgotten += (before.len() - after.len()) as u64;
            decayed.tiles_removed += u64::from(after.is_empty());
            drop(before);
            if has_changed {
                editor.replace(tile, &after)?;
            }
        }
        progress(tiles.len() as u64, tiles.len() as u64);
        decayed.tiles -= decayed.tiles_removed;
        if scans > 0 || decayed.voxels_forgotten > 0 {
            editor.commit("decay", |ext| ext.decayed_scan = now)?;
        }
        Ok(decayed)
    })
}

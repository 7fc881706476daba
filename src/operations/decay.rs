use super::map_editor::edit;
use super::table_change::changed;
use crate::error::{Error, Result};
use crate::maths::exp2;
use crate::sensor::Evidence;
use crate::store::MapPath;
use serde::Serialize;

/// How evidence fades: the log-odds of every voxel times `2^(-n / halflife)`, where `n` is the number of scans that the
/// map has taken since its evidence last faded, or since its beginning. Counts of observations stay.
///
/// So what was seen becomes less certain the more scans have come after, wherever they looked; new scans outweigh it
/// sooner. The rule knows nothing of when a voxel was last seen, because a map does not: it depends on the number of
/// scans alone, and not on how the map was kept in memory or when it was flushed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Decay {
    /// After so many scans log-odds are half of what they were.
    pub halflife_scans: f64,
    /// Takes so many scans in place of those that came since the last time.
    pub scans: Option<u64>,
    /// Voxels whose log-odds then are nearer to 0 than this become unknown; 0 keeps all.
    pub forget_below: f64,
}

/// What a decay did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Decayed {
    /// The number of scans for which evidence faded.
    pub scans: u64,
    /// What log-odds were multiplied by.
    pub factor: f64,
    /// Voxels that the map has.
    pub voxels: u64,
    /// Voxels that are unknown now and were not before.
    pub voxels_forgotten: u64,
    /// Tiles that the map has.
    pub tiles: u64,
    /// Tiles that lost all of their voxels, and are no longer part of the map.
    pub tiles_removed: u64,
}

/// Log-odds do not fade below this: as `f32`, which octrees have, they would become 0, and what is free would count as
/// occupied.
const MIN_LOG_ODDS: f64 = f32::MIN_POSITIVE as f64;

impl Decay {
    /// The rule with a half-life in scans.
    pub fn new(halflife_scans: f64) -> Self {
        Self { halflife_scans, scans: None, forget_below: 0.0 }
    }

    /// The same for a number of scans.
    pub fn with_scans(self, scans: u64) -> Self {
        Self { scans: Some(scans), ..self }
    }

    /// The same, and log-odds nearer to 0 than this are forgotten.
    pub fn with_forget_below(self, forget_below: f64) -> Self {
        Self { forget_below, ..self }
    }

    /// What log-odds are multiplied by after so many scans. In `f64`, from the pure-Rust `libm`: the same bits on every
    /// machine.
    pub fn factor(&self, scans: u64) -> f64 {
        exp2(-(scans as f64) / self.halflife_scans)
    }

    /// A voxel's evidence after it has faded by a factor; `None` if it is forgotten.
    pub fn faded(&self, evidence: Evidence, factor: f64) -> Option<Evidence> {
        let least = evidence.log_odds.abs().min(MIN_LOG_ODDS);
        let faded = (evidence.log_odds * factor).abs().max(least);
        (faded >= self.forget_below)
            .then_some(Evidence { log_odds: faded.copysign(evidence.log_odds), ..evidence })
    }

    fn check(&self) -> Result<()> {
        if !(self.halflife_scans > 0.0 && self.halflife_scans.is_finite()) {
            let reason = format!("{} is no number of scans above 0", self.halflife_scans);
            return Err(Error::argument("halflife", reason));
        }
        if !(self.forget_below >= 0.0 && self.forget_below.is_finite()) {
            let reason = format!("{} is no log-odds of at least 0", self.forget_below);
            return Err(Error::argument("forget_below", reason));
        }
        Ok(())
    }
}

/// Lets the evidence of a map fade, in place and in one commit: all of it has faded, or nothing. The map remembers how
/// far, so that asking again at once changes nothing, unless it names a number of scans.
///
/// `progress` is told the tiles done and all.
///
/// # Errors
///
/// No map there, another writer, a rule that makes no sense, a damaged tile, a disk that refuses; the map is as before
/// then.
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
            let after = changed(&before, |evidence| {
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

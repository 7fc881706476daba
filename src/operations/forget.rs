use super::map_editor::edit;
use super::table_change::changed;
use crate::error::{Error, Result};
use crate::store::MapPath;
use serde::Serialize;
use std::time::Duration;

/// Rule for forgetting what was not seen for some time: occupied voxels whose last hit is too old become unknown. Free
/// voxels remain, and so do occupied ones without a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct MaxAge {
    /// Largest time since the last hit.
    pub age: Duration,
    /// Time from which ages count, in nanoseconds since the epoch of the time stamps. Default: the last hit of the map.
    pub now_ns: Option<i64>,
}

/// Result of [`forget_old`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Forgotten {
    /// Hits before this time were too old, in nanoseconds; `None` for a map without any time.
    pub oldest_ns: Option<i64>,
    /// Number of voxels in the map now.
    pub voxels: u64,
    /// Number of voxels that became unknown.
    pub voxels_forgotten: u64,
    /// Number of occupied voxels without a time, which remain.
    pub voxels_without_time: u64,
    /// Number of tiles in the map now.
    pub tiles: u64,
    /// Number of tiles that lost all voxels and were removed from the map.
    pub tiles_removed: u64,
}

impl MaxAge {
    /// Returns the rule with a largest time since the last hit.
    pub fn new(age: Duration) -> Self {
        Self { age, now_ns: None }
    }

    /// Sets the time from which ages count, in nanoseconds.
    pub fn with_now(self, now_ns: i64) -> Self {
        Self { now_ns: Some(now_ns), ..self }
    }
}

/// Forgets occupied voxels that no scan has hit for some time, in place and in one commit. The map needs the layer time.
///
/// `progress` receives the number of tiles done and in total.
///
/// # Errors
///
/// No map, a map without the layer, another writer, a damaged tile, or an I/O error. The map is unchanged then.
pub fn forget_old(
    map: impl Into<MapPath>,
    rule: &MaxAge,
    mut progress: impl FnMut(u64, u64),
) -> Result<Forgotten> {
    let (disk, map) = map.into().into_parts();
    edit(disk, &map, |editor| {
        if !editor.config().layers().time {
            let reason = "the map has no layer time: build it with `layers` time; a map that keeps its scans gets layers \
                          by `voxtile remap MAP -o NEW --layers time`";
            return Err(Error::argument("older_than", reason));
        }
        let tiles = editor.tiles();
        let mut forgotten = Forgotten { tiles: tiles.len() as u64, ..Forgotten::default() };
        let mut now_ns = rule.now_ns;
        if now_ns.is_none() {
            for &tile in &tiles {
                let table = editor.table(tile)?;
                let newest = table.layers().and_then(|layers| layers.last_ns());
                now_ns = now_ns.max(newest);
            }
        }
        // An age has at most 94 bits.
        let age_ns = rule.age.as_nanos() as i128;
        forgotten.oldest_ns = now_ns.map(|now_ns| (i128::from(now_ns) - age_ns).max(i64::MIN.into()) as i64);
        let threshold = editor.config().occupied_log_odds();
        for (done, &tile) in (0..).zip(&tiles) {
            progress(done, tiles.len() as u64);
            let before = editor.table(tile)?;
            let after = changed(&before, |voxel, evidence| {
                if evidence.log_odds < threshold {
                    return Some(evidence);
                }
                let time = before.layers_of(voxel).and_then(|layers| layers.time);
                forgotten.voxels_without_time += u64::from(time.is_none());
                let is_old = time.is_some_and(|time| Some(time.last_ns) < forgotten.oldest_ns);
                (!is_old).then_some(evidence)
            });
            forgotten.voxels += after.len() as u64;
            let lost = (before.len() - after.len()) as u64;
            forgotten.voxels_forgotten += lost;
            forgotten.tiles_removed += u64::from(after.is_empty());
            drop(before);
            if lost > 0 {
                editor.replace(tile, &after)?;
            }
        }
        progress(tiles.len() as u64, tiles.len() as u64);
        forgotten.tiles -= forgotten.tiles_removed;
        if forgotten.voxels_forgotten > 0 {
            editor.commit("decay", |_| ())?;
        }
        Ok(forgotten)
    })
}

use super::answers::name_of;
use super::map_state::{MapState, QueryMap, Shown};
use super::node_cache;
use super::route::{At, MapId};
use voxtile_pipeline::{AnyMap, MapAt, open_any_map};

use crate::view::Progress;
use anyhow::Context;
use parking_lot::{Mutex, RwLock};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant, SystemTime};
use tokio::sync::watch;
use voxtile::mapper::MapView;
use voxtile::operations::snapshots;
use voxtile::store::SnapshotName;
use voxtile_pipeline::place::place_of;
use voxtile_render::levels::{Levels, NodeStore};

/// Map that is shown while other processes may write it.
pub struct ServedMap {
    path: PathBuf,
    at: MapAt,
    name: String,
    store: Arc<NodeStore>,
    now: RwLock<Arc<MapState>>,
    /// List of snapshots, and the state of the files when it was read.
    listed: Mutex<Option<(Stamp, Arc<Vec<Listed>>)>>,
    /// Snapshots in use, the most recently used last.
    snapshots: Mutex<Vec<(Listed, Arc<MapState>)>>,
    /// Receives the progress of the first read of all tiles.
    progress: Progress,
}

/// Snapshot of the map. Its flush number distinguishes it from a deleted one of the same name.
#[derive(Clone, PartialEq)]
pub struct Listed {
    pub name: String,
    pub flush_number: u64,
    pub tiles: u64,
}

/// Work that a request may trigger.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Makes {
    Nothing,
    /// Levels of snapshots, built for one request at a time to bound memory and avoid duplicate work.
    Levels,
}

/// Result of looking up a state.
pub enum Found<T> {
    Here(T),
    /// Its levels must be built first.
    NotMade,
    Nothing,
}

/// Interval of checks for a new flush.
const POLL_INTERVAL: Duration = Duration::from_millis(500);
/// Number of tiles of a large map that are read before the first coarse view is shown.
const FIRST_TILES: usize = 512;
/// Factor by which the number of tiles grows from one incomplete state to the next.
const GROWTH: usize = 4;
/// Minimum interval between incomplete states.
const SHOW_EVERY: Duration = Duration::from_secs(1);
/// Binary logarithm of the number of tiles per axis whose coarse nodes are built together.
const GROUP: u32 = 3;
/// Maximum number of snapshots with levels in memory.
const SNAPSHOTS_KEPT: usize = 4;

/// Detects flushes and changes of snapshots: length and time of the log, the metadata, and the folder of snapshots.
#[derive(PartialEq)]
struct Stamp([Option<(u64, SystemTime)>; 3]);

impl Stamp {
    fn of(map: &Path) -> Self {
        Self(["commits.log", "metadata.json", "snapshots"].map(|name| {
            let metadata = std::fs::metadata(map.join(name)).ok()?;
            Some((metadata.len(), metadata.modified().ok()?))
        }))
    }
}

impl ServedMap {
    /// Opens a map; [`ServedMap::follow`] builds its levels.
    pub fn open(path: &Path, is_kept: bool, progress: Progress) -> anyhow::Result<Self> {
        let map = open_any_map(path).with_context(|| format!("cannot show {}", path.display()))?;
        let id = match &map {
            AnyMap::Map(map) => map.metadata().ext.as_ref().map(|ext| ext.map_id.clone()),
            AnyMap::Octree(_) => None,
        };
        let store = Arc::new(node_cache::open(id.as_deref().filter(|_| is_kept))?);
        let levels = Levels::build(&map, &[], 0, &store, &|_| true)?;
        let levels = levels.context("the levels of a map without tiles")?;
        let pending_tiles = map.tile_indices().len() as u64;
        let now = MapState {
            map,
            levels,
            store: store.clone(),
            generation: 0,
            pending_tiles,
            overview: OnceLock::new(),
        };
        Ok(Self {
            path: path.to_owned(),
            at: MapAt::of(path)?,
            name: name_of(path),
            store,
            now: RwLock::new(Arc::new(now)),
            listed: Mutex::default(),
            snapshots: Mutex::default(),
            progress,
        })
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the current state.
    pub fn now(&self) -> Arc<MapState> {
        self.now.read().clone()
    }

    /// Returns the time of the last flush by any process; `None` for OctoMap files, snapshots and maps in a bucket.
    pub fn flushed_at(&self) -> Option<SystemTime> {
        let log = self.at.map.join("commits.log");
        let is_current = self.at.snapshot.is_none() && matches!(self.now().map, AnyMap::Map(_));
        is_current.then(|| std::fs::metadata(log).ok()?.modified().ok())?
    }

    /// Returns the snapshots that can be shown; none if the map itself was opened as a snapshot.
    pub fn snapshots(&self) -> Arc<Vec<Listed>> {
        let is_map = self.at.snapshot.is_none() && matches!(self.now().map, AnyMap::Map(_));
        if !is_map {
            return Arc::default();
        }
        // Taken before the list is read, so that a snapshot created in between is found next time.
        let stamp = Stamp::of(&self.at.map);
        if let Some((at, listed)) = &*self.listed.lock()
            && *at == stamp
        {
            return listed.clone();
        }
        // The list may be readable next time.
        let Ok(found) = place_of(&self.at.map).and_then(snapshots) else { return Arc::default() };
        let whole = found.into_iter().filter(|info| info.damage.is_none());
        let listed =
            whole.map(|info| Listed { name: info.name, flush_number: info.flush_number, tiles: info.tiles });
        let listed = Arc::new(listed.collect::<Vec<_>>());
        *self.listed.lock() = Some((stamp, listed.clone()));
        listed
    }

    /// Returns the state, or the change between two states, that a URL names.
    pub fn shown(&self, id: &MapId, makes: Makes) -> voxtile::Result<Found<Shown>> {
        let after = match self.state(&id.at, makes)? {
            Found::Here(state) => state,
            Found::NotMade => return Ok(Found::NotMade),
            Found::Nothing => return Ok(Found::Nothing),
        };
        let Some(since) = &id.since else { return Ok(Found::Here(Shown::State(after))) };
        Ok(match self.state(since, makes)? {
            Found::Here(before) => Found::Here(Shown::Change { before, after }),
            Found::NotMade => Found::NotMade,
            Found::Nothing => Found::Nothing,
        })
    }

    /// Returns the map that a URL names for queries, without waiting for levels of a snapshot. `None` if there is no
    /// such snapshot.
    pub fn query_map(&self, id: &MapId) -> voxtile::Result<Option<QueryMap>> {
        if let Some(At::Snapshot(since)) = &id.since
            && self.listed(since).is_none()
        {
            return Ok(None);
        }
        let At::Snapshot(name) = &id.at else { return Ok(Some(QueryMap::State(self.now()))) };
        let Some(listed) = self.listed(name) else { return Ok(None) };
        Ok(Some(match self.kept(&listed) {
            Some(state) => QueryMap::State(state),
            None => QueryMap::Opened(self.opened(name)?),
        }))
    }

    fn listed(&self, name: &SnapshotName) -> Option<Listed> {
        self.snapshots().iter().find(|listed| listed.name == name.as_str()).cloned()
    }

    fn state(&self, at: &At, makes: Makes) -> voxtile::Result<Found<Arc<MapState>>> {
        let name = match at {
            At::Now => return Ok(Found::Here(self.now())),
            At::Snapshot(name) => name,
            At::Map(_) => return Ok(Found::Nothing),
        };
        let Some(listed) = self.listed(name) else { return Ok(Found::Nothing) };
        if let Some(state) = self.kept(&listed) {
            return Ok(Found::Here(state));
        }
        if makes == Makes::Nothing {
            return Ok(Found::NotMade);
        }
        let Some(state) = self.made(name)? else { return Ok(Found::Nothing) };
        let mut kept = self.snapshots.lock();
        // Drop a deleted snapshot with this name.
        kept.retain(|(known, _)| known.name != listed.name);
        if kept.len() == SNAPSHOTS_KEPT {
            kept.remove(0);
        }
        kept.push((listed, state.clone()));
        Ok(Found::Here(state))
    }

    /// Returns a snapshot in use and marks it as most recently used.
    fn kept(&self, listed: &Listed) -> Option<Arc<MapState>> {
        let mut kept = self.snapshots.lock();
        let at = kept.iter().position(|(known, _)| known == listed)?;
        let found = kept.remove(at);
        kept.push(found.clone());
        Some(found.1)
    }

    fn opened(&self, name: &SnapshotName) -> voxtile::Result<AnyMap> {
        let at = MapAt { map: self.at.map.clone(), snapshot: Some(name.clone()) };
        Ok(AnyMap::Map(Box::new(at.open()?)))
    }

    /// Returns a snapshot with its levels.
    fn made(&self, name: &SnapshotName) -> voxtile::Result<Option<Arc<MapState>>> {
        let map = self.opened(name)?;
        let tiles = map.tile_indices();
        let Some(levels) = Levels::build(&map, &tiles, new_origin(), &self.store, &|_| true)? else {
            return Ok(None);
        };
        let state = MapState {
            map,
            levels,
            store: self.store.clone(),
            generation: 0,
            pending_tiles: 0,
            overview: OnceLock::new(),
        };
        Ok(Some(Arc::new(state)))
    }

    /// Builds the levels, and rebuilds them after each flush, in a thread that runs until the process ends.
    pub fn follow(self: Arc<Self>, changes: watch::Sender<u64>) -> anyhow::Result<()> {
        let work = move || {
            // Taken before the map is read, so that a flush in between is found next time.
            let mut seen = None;
            let mut reported = String::new();
            loop {
                let stamp = Stamp::of(&self.at.map);
                if seen.as_ref() != Some(&stamp) {
                    match self.show_newest(&changes) {
                        Ok(()) => seen = Some(stamp),
                        // The map was flushed again or removed: keep the shown state and retry.
                        Err(error) => {
                            let error = format!("{error:#}");
                            if reported != error {
                                log::warn!("{}: {error}", self.path.display());
                                reported = error;
                            }
                        }
                    }
                }
                thread::sleep(POLL_INTERVAL);
            }
        };
        thread::Builder::new()
            .name("voxtile-follow".into())
            .spawn(work)
            .context("cannot start the thread that reads the map")?;
        Ok(())
    }

    fn show_newest(&self, changes: &watch::Sender<u64>) -> anyhow::Result<()> {
        let open = || open_any_map(&self.path);
        let origin = new_origin();
        let mut tiles = open()?.tile_indices();
        tiles.sort_by_key(|tile| (tile.to_array().map(|k| k >> GROUP), *tile));
        let is_first = self.now().generation == 0;
        let mut shown = Instant::now();
        let mut end = if is_first { FIRST_TILES.min(tiles.len()) } else { tiles.len() };
        loop {
            let map = open()?;
            let step = |_| true;
            let levels =
                Levels::build(&map, &tiles[..end], origin, &self.store, &step)?.context("stopped")?;
            if is_first {
                (self.progress)(end as u64, tiles.len() as u64);
            }
            let is_complete = end == tiles.len();
            if is_complete || shown.elapsed() > SHOW_EVERY {
                self.show(map, levels, (tiles.len() - end) as u64, changes);
                shown = Instant::now();
            }
            if is_complete {
                return Ok(());
            }
            end = end.saturating_mul(GROWTH).min(tiles.len());
        }
    }

    fn show(&self, map: AnyMap, levels: Levels, pending_tiles: u64, changes: &watch::Sender<u64>) {
        for reason in levels.unreadable() {
            log::warn!("tile not shown: {reason}");
        }
        let before = self.now();
        let overview = before.overview_for(map.tile_indices().len());
        let state = MapState {
            map,
            levels,
            store: self.store.clone(),
            generation: before.generation + 1,
            pending_tiles,
            overview,
        };
        *self.now.write() = Arc::new(state);
        changes.send_modify(|count| *count += 1);
    }
}

/// Returns a random number that is part of the versions of tiles whose map records no versions, such as an OctoMap
/// file. Browsers cache nodes forever, so it must differ for every file that was or will be shown at the same URL.
fn new_origin() -> u64 {
    RandomState::new().build_hasher().finish()
}

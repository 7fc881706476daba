//! Open maps that can be queried: one open for writing, one open for reading, a file of OctoMap.

use crate::operations::MapOrSnapshot;
use parking_lot::{Mutex, MutexGuard, RwLock};
use std::path::Path;
use std::time::Duration;
use voxtile::mapper::{LiveReader, MapReader, MapView, Mapper, OctreeMap, Stoppable};
use voxtile::space::Point;
use voxtile::store::Extension;
use voxtile::{Error, MapConfig, OutOfCoreTileMapper, Result, Stop};
use voxtile_compare::Viewpoints;
use voxtile_pipeline::{MapAt, kept_viewpoints, octree_file};

/// View of a map whose queries end with an error at the next tile after its stop is set.
pub type View<'a> = Stoppable<'a, dyn MapView + 'a>;

/// An open map.
pub enum Source {
    /// A map open for writing. Queries use the reader, which waits for no scan and no flush.
    Writer {
        /// `None` once the map is closed, or after a panic left it half changed.
        mapper: Mutex<Option<Box<OutOfCoreTileMapper>>>,
        /// Sees the map after each scan.
        reader: LiveReader,
    },
    /// A map or a snapshot as it is on disk.
    Reader(Box<RwLock<MapReader>>),
    /// A file of OctoMap.
    Octree(Box<OctreeMap>),
}

/// State of an open map. Equal states of one map have equal content.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    scan_number: u64,
    /// 0 except for maps open for reading.
    flush_number: u64,
}

/// Memory to read the metadata of a map.
const LEAST_BYTES: usize = 1 << 20;
/// Attempts at a query whose view expires because the map changed too much meanwhile.
const ATTEMPTS: usize = 8;
/// Interval of checks for a stop while another thread holds the mapper.
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

impl Source {
    /// Wraps a mapper.
    pub fn writer(mapper: OutOfCoreTileMapper) -> Result<Self> {
        let reader = mapper.reader()?;
        Ok(Self::Writer { mapper: Mutex::new(Some(Box::new(mapper))), reader })
    }

    /// Loads a file of OctoMap.
    pub fn octree(path: &Path) -> Result<Self> {
        OctreeMap::of(octree_file::read(path)?).map(|map| Self::Octree(Box::new(map)))
    }

    /// Opens a map, a snapshot, or a file of OctoMap.
    pub fn at(place: &MapOrSnapshot) -> Result<Self> {
        let reader = match place {
            MapOrSnapshot::Map(path) if OctreeMap::is_named_by(path) => return Self::octree(path),
            MapOrSnapshot::Map(path) => MapAt::of(path)?.open()?,
            MapOrSnapshot::Snapshot(..) => place.open()?,
        };
        Ok(Self::Reader(Box::new(RwLock::new(reader))))
    }

    /// Returns the id and the inputs of the map at `path` at its last flush, if they are known.
    pub fn extension(&self, path: &Path) -> Option<Extension> {
        match self {
            Self::Reader(reader) => reader.read().metadata().ext.clone(),
            Self::Octree(_) => None,
            Self::Writer { .. } => MapReader::open(path, LEAST_BYTES).ok()?.metadata().ext.clone(),
        }
    }

    /// Returns the positions from which the map's kept scans were taken; `None` if it keeps none, or is open for writing.
    pub fn viewpoints(&self) -> Option<Viewpoints> {
        match self {
            Self::Reader(reader) => kept_viewpoints(&reader.read()),
            Self::Writer { .. } | Self::Octree(_) => None,
        }
    }

    /// Returns the positions of the sensor of the map at `path`, at its last flush.
    pub fn trajectory(&self, path: &Path) -> Result<Vec<Point>> {
        let scans = match self {
            Self::Reader(reader) => reader.read().scans()?,
            Self::Writer { .. } => MapReader::open(path, LEAST_BYTES)?.scans()?,
            Self::Octree(_) => Vec::new(),
        };
        Ok(scans.iter().map(|scan| scan.origin_m).collect())
    }

    /// Returns the configuration of the map.
    pub fn config(&self) -> MapConfig {
        match self {
            Self::Writer { reader, .. } => reader.config().clone(),
            Self::Reader(reader) => reader.read().config().clone(),
            Self::Octree(map) => map.config().clone(),
        }
    }

    /// Queries the map as it is after its latest scan.
    pub fn ask<T>(&self, stop: &Stop, mut question: impl FnMut(&View<'_>) -> Result<T>) -> Result<T> {
        again_if_expired(|| match self {
            Self::Reader(reader) => question(&Stoppable::new(&*reader.read(), stop)),
            other => other.ask_once(stop, &mut |view, _| question(view)),
        })
    }

    /// Queries two maps together, which may be the same, with their states.
    pub fn ask_both<T>(
        sources: [&Self; 2],
        stop: &Stop,
        mut question: impl FnMut([&View<'_>; 2], [State; 2]) -> Result<T>,
    ) -> Result<T> {
        let [first, second] = sources;
        again_if_expired(|| {
            first.ask_once(stop, &mut |of_first, state| match std::ptr::eq(first, second) {
                true => question([of_first, of_first], [state; 2]),
                false => second
                    .ask_once(stop, &mut |of_second, other| question([of_first, of_second], [state, other])),
            })
        })
    }

    /// Queries the map. The query may hold other maps.
    fn ask_once<T>(&self, stop: &Stop, question: &mut dyn FnMut(&View<'_>, State) -> Result<T>) -> Result<T> {
        let mut ask = |view: &dyn MapView, flush_number| {
            let state = State { scan_number: view.scan_number(), flush_number };
            question(&Stoppable::new(view, stop), state)
        };
        match self {
            Self::Reader(reader) => {
                // Two queries with two maps each would wait for each other if a waiting refresh blocked them.
                let reader = reader.read_recursive();
                ask(&*reader, reader.flush_number())
            }
            Self::Octree(map) => ask(&**map, 0),
            Self::Writer { reader, .. } => ask(&reader.view(), 0),
        }
    }

    /// Returns the mapper once no other thread uses it; `None` if the map is read-only or closed.
    pub fn mapper(&self, stop: &Stop) -> Result<Option<MutexGuard<'_, Option<Box<OutOfCoreTileMapper>>>>> {
        let Self::Writer { mapper, .. } = self else { return Ok(None) };
        loop {
            if let Some(guard) = mapper.try_lock_for(BETWEEN_LOOKS) {
                return Ok(Some(guard));
            }
            stop.check()?;
        }
    }

    /// Changes the map. A panic closes it without a flush.
    pub fn change<T>(
        &self,
        stop: &Stop,
        change: impl FnOnce(&mut OutOfCoreTileMapper) -> Result<T>,
    ) -> Result<Option<T>> {
        let Some(mut guard) = self.mapper(stop)? else { return Ok(None) };
        changed(&mut guard, stop, change)
    }

    /// Calls `change` if no other thread uses the map now. Otherwise, or if the map is closed, returns `None` and
    /// leaves `change` in its place, so that the caller can retry.
    pub fn change_if_free<T, C>(&self, stop: &Stop, change: &mut Option<C>) -> Result<Option<T>>
    where
        C: FnOnce(&mut OutOfCoreTileMapper) -> Result<T>,
    {
        let Self::Writer { mapper, .. } = self else { return Ok(None) };
        let Some(mut guard) = mapper.try_lock() else { return Ok(None) };
        match change.take_if(|_| guard.is_some()) {
            Some(change) => changed(&mut guard, stop, change),
            None => Ok(None),
        }
    }

    /// Returns whether a query can run without waiting for another thread. Only queries of a reader wait, for a
    /// refresh.
    pub fn is_free(&self) -> bool {
        match self {
            Self::Reader(reader) => reader.try_read().is_some(),
            Self::Writer { .. } | Self::Octree(_) => true,
        }
    }

    /// Closes a map that is open for writing, after a flush if `flush` is set. No other thread can insert between flush
    /// and close. After an error or a stop the map is still open.
    pub fn close(&self, stop: &Stop, flush: bool) -> Result<()> {
        let Some(mut guard) = self.mapper(stop)? else { return Ok(()) };
        if flush {
            changed(&mut guard, stop, Mapper::flush)?;
            stop.check()?;
        }
        drop(guard.take());
        Ok(())
    }
}

fn again_if_expired<T>(mut attempt: impl FnMut() -> Result<T>) -> Result<T> {
    for _ in 1..ATTEMPTS {
        match attempt() {
            Err(Error::Expired) => {}
            answer => return answer,
        }
    }
    attempt()
}

fn changed<T>(
    guard: &mut Option<Box<OutOfCoreTileMapper>>,
    stop: &Stop,
    change: impl FnOnce(&mut OutOfCoreTileMapper) -> Result<T>,
) -> Result<Option<T>> {
    let Some(mut mapper) = guard.take() else { return Ok(None) };
    mapper.stop_with(stop.clone());
    let changed = change(&mut mapper);
    *guard = Some(mapper);
    changed.map(Some)
}

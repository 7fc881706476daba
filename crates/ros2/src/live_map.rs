use crate::health::Health;
use crate::local_share::LocalShare;
use crate::messages::{Header, Time};
use std::sync::{Mutex, MutexGuard, PoisonError};
use voxtile::{Grid, Layers, LiveReader, LiveView, MapView, Point};

/// Shared read access to the map during mapping, with the last sensor position.
#[derive(Debug)]
pub struct LiveMap {
    frame: String,
    /// Does not change when the map is reopened.
    grid: Grid,
    /// Does not change either.
    layers: Layers,
    state: Mutex<State>,
    local: LocalShare,
}

#[derive(Debug)]
struct State {
    reader: LiveReader,
    moment: Moment,
    health: Health,
}

/// State after a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub version: MapVersion,
    /// Sensor position of the last scan, in the map frame.
    pub sensor_m: Point,
    /// Stamp of the last scan.
    pub stamp_ns: i64,
}

/// Version of the map. Equal versions have equal content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapVersion {
    /// Number of times the map was reopened.
    pub opening: u64,
    pub scan_number: u64,
}

impl LiveMap {
    pub fn new(frame: String, reader: LiveReader, sensor_m: Point, stamp_ns: i64) -> Self {
        let view = reader.view();
        let (grid, version) =
            (view.config().grid, MapVersion { opening: 0, scan_number: view.scan_number() });
        let layers = view.config().layers();
        drop(view);
        let moment = Moment { version, sensor_m, stamp_ns };
        let state = Mutex::new(State { reader, moment, health: Health::default() });
        Self { frame, grid, layers, state, local: LocalShare::default() }
    }

    pub fn note_scan(&self, scan_number: u64, sensor_m: Point, stamp_ns: i64) {
        let moment = &mut self.lock().moment;
        let version = MapVersion { scan_number, ..moment.version };
        *moment = Moment { version, sensor_m, stamp_ns };
    }

    /// Records that a remap or a service changed the map on disk, and that it was reopened. `sensor_m` is the corrected
    /// sensor position, if it changed.
    pub fn note_opening(&self, reader: LiveReader, sensor_m: Option<Point>) {
        let scan_number = reader.view().scan_number();
        let mut state = self.lock();
        let opening = state.moment.version.opening + 1;
        state.moment.version = MapVersion { opening, scan_number };
        state.moment.sensor_m = sensor_m.unwrap_or(state.moment.sensor_m);
        state.reader = reader;
    }

    pub fn note_health(&self, health: Health) {
        self.lock().health = health;
    }

    pub fn health(&self) -> Health {
        self.lock().health.clone()
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    pub fn layers(&self) -> &Layers {
        &self.layers
    }

    pub fn local(&self) -> &LocalShare {
        &self.local
    }

    pub fn moment(&self) -> Moment {
        self.lock().moment
    }

    /// Returns the map after its last scan. While the map is being reopened, returns its previous state.
    pub fn view(&self) -> LiveView {
        self.reader().view()
    }

    pub fn reader(&self) -> LiveReader {
        self.lock().reader.clone()
    }

    /// Returns a message header with the stamp of `moment` and the map frame.
    pub fn header(&self, moment: &Moment) -> Header {
        Header { stamp: Time::from_ns(moment.stamp_ns), frame_id: self.frame.clone() }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

use crate::health::Health;
use crate::local_share::LocalShare;
use crate::messages::{Header, Time};
use std::sync::{Mutex, MutexGuard, PoisonError};
use voxtile::{Grid, LiveReader, LiveView, MapView, Point};

/// The map as others than its mapper see it, and where the robot is in it.
#[derive(Debug)]
pub struct LiveMap {
    frame: String,
    /// The same however often the map is opened anew.
    grid: Grid,
    state: Mutex<State>,
    local: LocalShare,
}

#[derive(Debug)]
struct State {
    reader: LiveReader,
    moment: Moment,
    health: Health,
}

/// What was known after a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub version: MapVersion,
    /// Of the sensor's last scan, in the frame of the map.
    pub sensor_m: Point,
    /// Of that scan.
    pub stamp_ns: i64,
}

/// What tells one state of the map from another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapVersion {
    /// How often the map was opened anew.
    pub opening: u64,
    pub scan_number: u64,
}

impl LiveMap {
    pub fn new(frame: String, reader: LiveReader, sensor_m: Point, stamp_ns: i64) -> Self {
        let view = reader.view();
        let (grid, version) =
            (view.config().grid, MapVersion { opening: 0, scan_number: view.scan_number() });
        drop(view);
        let moment = Moment { version, sensor_m, stamp_ns };
        let state = Mutex::new(State { reader, moment, health: Health::default() });
        Self { frame, grid, state, local: LocalShare::default() }
    }

    /// A scan was mapped.
    pub fn note_scan(&self, scan_number: u64, sensor_m: Point, stamp_ns: i64) {
        let moment = &mut self.lock().moment;
        let version = MapVersion { scan_number, ..moment.version };
        *moment = Moment { version, sensor_m, stamp_ns };
    }

    /// The map was changed as a whole, and opened anew; the sensor's last place, where it is another one now.
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

    /// The local map beside it.
    pub fn local(&self) -> &LocalShare {
        &self.local
    }

    pub fn moment(&self) -> Moment {
        self.lock().moment
    }

    /// The map after its last scan. Of a map that is being opened anew, what it was.
    pub fn view(&self) -> LiveView {
        self.reader().view()
    }

    /// What answers questions about the map.
    pub fn reader(&self) -> LiveReader {
        self.lock().reader.clone()
    }

    /// For messages about a moment.
    pub fn header(&self, moment: &Moment) -> Header {
        Header { stamp: Time::from_ns(moment.stamp_ns), frame_id: self.frame.clone() }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

use crate::live_map::LiveMap;
use std::sync::Arc;
use voxtile::{MapView, ScanPoints};
use voxtile_local::{LocalMap, LocalParameters};

/// The local map beside the map: it takes the same scans, while somebody listens.
pub struct LocalMapping {
    parameters: LocalParameters,
    /// Where it starts from what the map knows, around the sensor.
    radius_m: f64,
    live: Arc<LiveMap>,
    map: Option<LocalMap>,
}

impl LocalMapping {
    pub fn new(parameters: LocalParameters, radius_m: f64, live: Arc<LiveMap>) -> Self {
        Self { parameters, radius_m, live, map: None }
    }

    /// Begins when somebody listens, from what the map knows, and ends when nobody does.
    pub fn refresh(&mut self, archive: &(impl MapView + Sized)) {
        match (self.live.local().is_wanted(), &self.map) {
            (true, None) => self.begin(archive),
            (false, Some(_)) => self.forget(),
            _ => {}
        }
    }

    fn begin(&mut self, archive: &(impl MapView + Sized)) {
        // Both arguments were checked when the node began.
        let Ok(mut map) = LocalMap::new(archive.config().grid.resolution_m(), self.parameters) else {
            return;
        };
        let sensor_m = self.live.moment().sensor_m;
        if let Err(error) = map.prime(archive, sensor_m, self.radius_m) {
            log::warn!("the local map begins with nothing: {error}");
        }
        self.live.local().set(Some(map.reader()));
        self.map = Some(map);
    }

    /// The map has changed as a whole: what comes next begins from it.
    pub fn forget(&mut self) {
        self.live.local().set(None);
        self.map = None;
    }

    /// Takes a scan that the map has taken.
    pub fn follow(&mut self, scan: &dyn ScanPoints) {
        if let Some(map) = &mut self.map
            && let Err(error) = map.insert_points(scan)
        {
            log::warn!("a cloud is not in the local map: {error}");
        }
    }

    /// Bytes of memory, beside those of the map.
    pub fn bytes(&self) -> usize {
        self.map.as_ref().map_or(0, LocalMap::bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{MapConfig, Mapper, OutOfCoreTileMapper, Scan};
    use voxtile_local::LocalState;

    fn scan(x: f64) -> Scan {
        Scan { origin: [0.05; 3], points: vec![[x, 0.05, 0.05]], intensities: None }
    }

    #[test]
    fn it_is_there_for_those_who_listen_and_begins_with_what_the_map_knows() {
        let folder = tempfile::tempdir().unwrap();
        let config = MapConfig::new(0.1, 10.0).unwrap();
        let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
        mapper.insert_scan(&scan(2.05)).unwrap();
        mapper.insert_scan(&scan(8.05)).unwrap();
        let live = Arc::new(LiveMap::new("map".to_owned(), mapper.reader().unwrap(), [0.05; 3], 0));
        let mut local = LocalMapping::new(LocalParameters::local_mapping(), 5.0, live.clone());
        let state = |x: f64| live.local().view().map(|view| view.state_at([x, 0.05, 0.05]));

        local.refresh(&mapper);
        local.follow(&scan(3.05));
        assert_eq!((state(2.05), local.bytes()), (None, 0));
        live.local().want(true);
        local.refresh(&mapper);
        // The first hit is occupied still after one miss; what is too far away does not enter.
        assert_eq!(
            [2.05, 2.25, 8.05].map(state),
            [LocalState::Occupied, LocalState::Inflated, LocalState::None].map(Some)
        );
        local.follow(&scan(3.05));
        local.refresh(&mapper);
        assert_eq!(state(3.05), Some(LocalState::Occupied));
        local.forget();
        assert_eq!(state(3.05), None);
        local.refresh(&mapper);
        assert_eq!(state(3.05), Some(LocalState::None));
        live.local().want(false);
        local.refresh(&mapper);
        assert_eq!((state(2.05), local.bytes()), (None, 0));
    }
}

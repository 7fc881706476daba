use crate::live_map::LiveMap;
use std::sync::Arc;
use voxtile::{MapView, ScanPoints};
use voxtile_local::{LocalMap, LocalParameters};

/// Local map of the same scans as the map. It exists while it has subscribers.
pub struct LocalMapping {
    parameters: LocalParameters,
    /// Distance from the sensor within which the local map is initialized from the map.
    radius_m: f64,
    live: Arc<LiveMap>,
    map: Option<LocalMap>,
}

impl LocalMapping {
    pub fn new(parameters: LocalParameters, radius_m: f64, live: Arc<LiveMap>) -> Self {
        Self { parameters, radius_m, live, map: None }
    }

    /// Creates the local map from the map when a subscriber appears, and drops it when none remains.
    pub fn refresh(&mut self, archive: &(impl MapView + Sized)) {
        match (self.live.local().is_wanted(), &self.map) {
            (true, None) => self.begin(archive),
            (false, Some(_)) => self.reset(),
            _ => {}
        }
    }

    fn begin(&mut self, archive: &(impl MapView + Sized)) {
        // Both arguments were validated when the node started.
        let Ok(mut map) = LocalMap::new(archive.config().grid.resolution_m(), self.parameters) else {
            return;
        };
        let sensor_m = self.live.moment().sensor_m;
        if let Err(error) = map.prime(archive, sensor_m, self.radius_m) {
            log::warn!("the local map starts empty: {error}");
        }
        self.live.local().set(Some(map.reader()));
        self.map = Some(map);
    }

    /// Drops the local map, because a remap or a service changed the map. The next refresh creates it again.
    pub fn reset(&mut self) {
        self.live.local().set(None);
        self.map = None;
    }

    pub fn insert(&mut self, scan: &dyn ScanPoints) {
        if let Some(map) = &mut self.map
            && let Err(error) = map.insert_points(scan)
        {
            log::warn!("a cloud is missing in the local map: {error}");
        }
    }

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
    fn the_local_map_exists_for_subscribers_and_starts_from_the_map() {
        let folder = tempfile::tempdir().unwrap();
        let config = MapConfig::new(0.1, 10.0).unwrap();
        let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
        mapper.insert_scan(&scan(2.05)).unwrap();
        mapper.insert_scan(&scan(8.05)).unwrap();
        let live = Arc::new(LiveMap::new("map".to_owned(), mapper.reader().unwrap(), [0.05; 3], 0));
        let mut local = LocalMapping::new(LocalParameters::local_mapping(), 5.0, live.clone());
        let state = |x: f64| live.local().view().map(|view| view.state_at([x, 0.05, 0.05]));

        local.refresh(&mapper);
        local.insert(&scan(3.05));
        assert_eq!((state(2.05), local.bytes()), (None, 0));
        live.local().set_wanted(true);
        local.refresh(&mapper);
        // One miss does not clear the first hit. The voxel beyond the radius is not copied.
        assert_eq!(
            [2.05, 2.25, 8.05].map(state),
            [LocalState::Occupied, LocalState::Inflated, LocalState::None].map(Some)
        );
        local.insert(&scan(3.05));
        local.refresh(&mapper);
        assert_eq!(state(3.05), Some(LocalState::Occupied));
        local.reset();
        assert_eq!(state(3.05), None);
        local.refresh(&mapper);
        assert_eq!(state(3.05), Some(LocalState::None));
        live.local().set_wanted(false);
        local.refresh(&mapper);
        assert_eq!((state(2.05), local.bytes()), (None, 0));
    }
}

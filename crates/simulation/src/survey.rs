use super::{Building, City, Drive, Lidar, Route, Teleport, Walk, Warehouse, World};
use voxtile::scan::Scan;

/// A world, a route and a lidar: the scans of a whole drive, generated one at a time.
///
/// The iterator yields scans without end (use `take`); [`Survey::scan_at`] and `nth` return any scan without generating
/// earlier ones.
#[derive(Clone, Debug)]
pub struct Survey<W, R> {
    world: W,
    route: R,
    lidar: Lidar,
    seed: u64,
    next: u64,
}

impl<W: World, R: Route> Survey<W, R> {
    /// Returns a survey. `seed` is the seed of the sensor's range noise.
    pub fn new(world: W, route: R, lidar: Lidar, seed: u64) -> Self {
        Self { world, route, lidar, seed, next: 0 }
    }

    /// Returns the world.
    pub fn world(&self) -> &W {
        &self.world
    }

    /// Returns the scan at a step of the route, from 0.
    pub fn scan_at(&mut self, index: u64) -> Scan {
        let world_from_sensor = self.route.pose(index);
        self.lidar.scan(&self.world, &world_from_sensor, self.seed, index)
    }
}

impl Survey<City, Drive> {
    /// Returns the *street* workload: [`Lidar::street`] every metre of a drive through a city.
    pub fn street(seed: u64) -> Self {
        Self::new(City::new(seed), Drive::new(seed, 1.0), Lidar::street(), seed)
    }

    /// Returns a small demo: [`Lidar::demo`] every metre of the same drive.
    pub fn demo(seed: u64) -> Self {
        Self::new(City::new(seed), Drive::new(seed, 1.0), Lidar::demo(), seed)
    }
}

/// Drives of any length, with about `rays` rays per scan.
impl Survey<City, Drive> {
    /// Returns a scan every metre of a drive on mostly new streets: [`Drive::tour`].
    pub fn tour(seed: u64, rays: u32) -> Self {
        Self::new(City::new(seed), Drive::tour(seed, 1.0), Lidar::of_rays(rays), seed)
    }

    /// Returns a scan every metre of the same round, repeated: [`Drive::laps`].
    pub fn laps(seed: u64, edge_blocks: u64, rays: u32) -> Self {
        Self::new(City::new(seed), Drive::laps(edge_blocks, 1.0), Lidar::of_rays(rays), seed)
    }
}

/// Scans of about `rays` rays from unrelated positions within `reach_m` metres of the origin.
impl Survey<City, Teleport> {
    /// Returns scans from streets.
    pub fn teleports(seed: u64, reach_m: f64, rays: u32) -> Self {
        Self::new(City::new(seed), Teleport::new(seed, reach_m), Lidar::of_rays(rays), seed)
    }

    /// Returns scans from masts above all roofs; each touches more than a thousand tiles of ten metres.
    pub fn masts(seed: u64, reach_m: f64, rays: u32) -> Self {
        let places = Teleport::new(seed, reach_m).at_height(Lidar::MAST_M);
        Self::new(City::new(seed), places, Lidar::mast(rays), seed)
    }
}

impl Survey<Building, Walk> {
    /// Returns the *indoor* workload: [`Lidar::indoor`] every half metre of a walk through a building.
    pub fn indoor(seed: u64) -> Self {
        let building = Building::new(seed);
        Self::new(building, Walk::new(building, 0.5), Lidar::indoor(), seed)
    }
}

/// Rounds through a warehouse, with about `rays` rays per scan.
impl Survey<Warehouse, Walk> {
    /// Returns a scan every ten centimetres of endless rounds, as of a sensor with ten scans per second at 1 m/s.
    pub fn warehouse(seed: u64, rays: u32) -> Self {
        Self::new(Warehouse::new(seed), Walk::in_warehouse(0.1), Lidar::of_rays(rays), seed)
    }
}

impl<W: World, R: Route> Iterator for Survey<W, R> {
    type Item = Scan;

    fn next(&mut self) -> Option<Scan> {
        self.nth(0)
    }

    fn nth(&mut self, skipped: usize) -> Option<Scan> {
        let index = self.next.saturating_add(skipped as u64);
        self.next = index.saturating_add(1);
        Some(self.scan_at(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the BLAKE3 hash of the bits of every number of a scan.
    fn digest(scan: &Scan) -> String {
        let mut hasher = blake3::Hasher::new();
        for number in scan.origin.iter().chain(scan.points.iter().flatten()) {
            hasher.update(&number.to_bits().to_le_bytes());
        }
        for intensity in scan.intensities.iter().flatten() {
            hasher.update(&intensity.to_bits().to_le_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    fn mean_range_m<W: World, R: Route>(survey: Survey<W, R>, scans: usize) -> f64 {
        let (mut sum_m, mut count) = (0.0, 0);
        for scan in survey.take(scans) {
            for point in &scan.points {
                sum_m += (0..3).map(|k| (point[k] - scan.origin[k]).powi(2)).sum::<f64>().sqrt();
            }
            count += scan.points.len();
        }
        sum_m / f64::from(count as u32)
    }

    #[test]
    fn a_seed_gives_the_same_scan_on_every_platform() {
        let digests =
            [Survey::street(1).scan_at(17), Survey::indoor(1).scan_at(17), Survey::demo(1).scan_at(4_321)]
                .map(|scan| digest(&scan));
        // Recorded on x86-64 Linux.
        let golden = [
            "aa8d7ae954dfd784838fd64edb294f4fe64cb9ced7ee2a6bb31c2bf468628b74",
            "177e3a493e532e737ec7a4bde9baba200375b48edebfc421f5f46cd17ad0c35b",
            "9bff4c6dd034d85950311fe6db0dfbad3d867f11aa122ea9740b6b7c8031b3ba",
        ];
        assert_eq!(digests, golden);
    }

    #[test]
    fn other_seeds_and_numbers_give_other_scans() {
        assert_ne!(Survey::demo(1).scan_at(3), Survey::demo(2).scan_at(3));
        assert_ne!(Survey::demo(1).scan_at(3), Survey::demo(1).scan_at(4));
    }

    #[test]
    fn scan_at_equals_the_scan_of_the_iterator() {
        let sequence: Vec<Scan> = Survey::demo(5).take(150).collect();
        let mut survey = Survey::demo(5);
        for index in [149, 0, 77, 76] {
            assert_eq!(survey.scan_at(index), sequence[index as usize]);
        }
        assert_eq!(Survey::demo(5).nth(120), Some(sequence[120].clone()));
    }

    #[test]
    fn the_mean_range_in_a_street_is_twelve_metres() {
        for seed in [1, 2, 3] {
            let mean_m = mean_range_m(Survey::street(seed), 20);
            assert!((10.0..14.0).contains(&mean_m), "{mean_m} m");
        }
    }

    #[test]
    fn a_scan_from_a_mast_touches_more_than_a_thousand_tiles() {
        let grid = voxtile::space::Grid::new(0.2, 10.0).unwrap();
        let scan = Survey::masts(1, 1_000.0, 65_536).scan_at(0);
        let tiles: std::collections::BTreeSet<_> = scan.points.iter().map(|p| grid.tile_of(*p)).collect();
        assert!(tiles.len() > 1_000, "{}", tiles.len());
    }

    #[test]
    fn the_mean_range_in_the_building_is_two_point_three_metres() {
        for seed in [1, 2, 3] {
            let mean_m = mean_range_m(Survey::indoor(seed), 20);
            assert!((2.15..2.45).contains(&mean_m), "{mean_m} m");
        }
    }
}

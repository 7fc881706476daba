use voxtile::scan::Scan;
use voxtile::space::Point;

/// A small seeded random number generator (SplitMix64), with the same numbers on every platform.
#[derive(Clone)]
pub struct Random(pub u64);

impl Random {
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn point(&mut self, center: Point, radius_m: f64) -> Point {
        center.map(|c| c + self.between(-radius_m, radius_m))
    }
}

/// A scan from a random position around `center`: mostly good points, some on voxel borders, some invalid.
pub fn random_scan(random: &mut Random, center: Point, points: usize) -> Scan {
    let origin = random.point(center, 2.0);
    let mut scan = Scan { origin, points: Vec::new(), intensities: Some(Vec::new()) };
    for _ in 0..points {
        let point = random.point(origin, 4.0);
        scan.points.push(match random.below(24) {
            0 => origin,
            1 => [f64::NAN, point[1], point[2]],
            2 => [point[0], f64::INFINITY, point[2]],
            3 => [1e12, point[1], point[2]],
            4 => point.map(|x| (x * 10.0).round() / 10.0),
            5 => [origin[0], origin[1], point[2]],
            6 => origin.map(|x| x + (point[0] - origin[0])),
            _ => point,
        });
        let intensity = random.between(0.0, 300.0) as f32;
        scan.intensities.as_mut().unwrap().push(if random.below(30) == 0 { f32::NAN } else { intensity });
    }
    scan
}

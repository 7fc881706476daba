use super::scene::bounded;
use super::{Label, Scene, World, block};
use voxtile::space::Point;

/// Unbounded synthetic city: streets on a square grid, houses, parks, parked cars, lamps, trees.
///
/// Blocks are generated from the seed and their integer coordinates when a ray needs them. They are not stored, so a
/// city takes no memory but its seed. The ground is the plane z = 0; the centre lines of the streets are at multiples
/// of [`City::BLOCK_M`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct City {
    seed: u64,
}

/// Asphalt.
pub(super) const GROUND_REFLECTIVITY: f64 = 0.22;

impl City {
    /// Distance between the centre lines of two parallel streets, in metres.
    pub const BLOCK_M: f64 = block::BLOCK_M;

    /// Returns the city of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }
}

impl World for City {
    fn scene(&self, center: Point, radius_m: f64) -> Scene {
        let radius_m = bounded(radius_m);
        let mut solids = Vec::new();
        for block in block::within(center, radius_m) {
            block::build(self.seed, block, &|_| Some(Label::Parked), &mut solids);
        }
        Scene::new(solids, GROUND_REFLECTIVITY, center, radius_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_does_not_depend_on_the_scene() {
        let city = City::new(5);
        let origin = [2.0, 30.0, 1.8];
        let wide = city.scene([100.0, -50.0, 0.0], 300.0);
        let mut hits = 0;
        for step in -20..20 {
            let direction = [1.0, f64::from(step) * 0.1, 0.02];
            let near = city.cast(origin, direction, 40.0);
            assert_eq!(near, wide.cast(origin, direction, 40.0));
            hits += usize::from(near.is_some());
        }
        assert!(hits > 20);
    }

    #[test]
    fn every_hit_is_on_the_surface_of_an_object() {
        let city = City::new(8);
        let origin = [2.0, 31.0, 1.8];
        let scene = city.scene(origin, 80.0);
        let mut random = super::super::Random::of(1, &[]);
        let mut hits = 0;
        for _ in 0..20_000 {
            let direction: Point = std::array::from_fn(|k| random.between(-1.0, 1.0) * [1.0, 1.0, 0.4][k]);
            let Some(hit) = scene.cast(origin, direction, 80.0) else { continue };
            let ray = super::super::solid::Ray::new(origin, direction).expect("a direction");
            let point = ray.at(hit.distance_m);
            let on_box = scene.solids().iter().any(|solid| {
                let outside = solid.bounds.distance_squared(point) > 1e-18;
                let on_face = (0..3).any(|k| {
                    (point[k] - solid.bounds.min[k]).abs() < 1e-9
                        || (point[k] - solid.bounds.max[k]).abs() < 1e-9
                });
                !outside && on_face
            });
            assert!(on_box || point[2].abs() < 1e-9, "{point:?}");
            assert!((0.0..=1.0).contains(&hit.cos_incidence) && (0.0..=1.0).contains(&hit.reflectivity));
            hits += 1;
        }
        assert!(hits > 10_000);
    }

    #[test]
    fn other_seeds_give_other_cities() {
        let solids = |seed| City::new(seed).scene([0.0; 3], 50.0).solids().to_vec();
        assert_eq!(solids(1), solids(1));
        assert_ne!(solids(1), solids(2));
    }

    #[test]
    fn any_position_and_range_is_valid() {
        for x in [1e9, -1e18, 1e300, f64::NAN, f64::INFINITY] {
            City::new(1).cast([x, 0.0, 1.0], [1.0, 0.2, 0.0], 1e300);
            City::new(1).cast([0.0, 0.0, 1.0], [1.0, x, 0.0], x);
        }
    }
}

use super::block::{self, Space};
use super::city::GROUND_REFLECTIVITY;
use super::scene::bounded;
use super::{Label, Random, Scene, Solid, Traffic, World, vehicles, walkers};
use voxtile::space::Point;

/// State of [`Traffic`] at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub(super) traffic: Traffic,
    pub(super) time_s: f64,
}

/// Share of the parked cars that leave.
const DEPARTING: f64 = 0.3;
/// Minimum distance of a mover from the middle of a scene, along x or y, in metres.
const CLEARANCE_M: f64 = 0.5;

impl Moment {
    /// Returns the time in seconds.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Returns the label of the car in a parking space, or `None` if the car has left.
    fn parked(&self, space: Space) -> Option<Label> {
        let [x, y] = space.block;
        let mut random = Random::of(self.traffic.seed(), &[13, x, y, space.number]);
        let departures_s = self.traffic.departures_s();
        if departures_s <= 0.0 || !random.chance(DEPARTING) {
            return Some(Label::Parked);
        }
        (self.time_s < random.between(0.0, departures_s)).then_some(Label::Departing)
    }

    /// Returns the static boxes and the parked cars around a point, and the boxes of each mover.
    fn contents(&self, center: Point, radius_m: f64) -> (Vec<Solid>, Vec<Vec<Solid>>) {
        let (mut solids, mut movers) = (Vec::new(), Vec::new());
        let (seed, time_s) = (self.traffic.seed(), self.time_s);
        for block in block::within(center, radius_m) {
            let doors = block::build(seed, block, &|space| self.parked(space), &mut solids);
            for door in &doors {
                walkers::door(seed, door, time_s, &mut movers);
                walkers::at_wall(seed, door, time_s, &mut movers);
            }
            walkers::on_rounds(seed, block, time_s, &mut movers);
        }
        vehicles::within(seed, center, radius_m, time_s, &mut movers);
        (solids, movers)
    }
}

impl World for Moment {
    /// Movers within half a metre of the center are left out, as if they gave way to a sensor there.
    fn scene(&self, center: Point, radius_m: f64) -> Scene {
        let radius_m = bounded(radius_m);
        let (mut solids, mut movers) = self.contents(center, radius_m);
        let is_near = |solid: &Solid| {
            (0..2).all(|k| {
                solid.bounds.min[k] - CLEARANCE_M <= center[k]
                    && center[k] <= solid.bounds.max[k] + CLEARANCE_M
            })
        };
        movers.retain(|body| !body.iter().any(is_near));
        solids.extend(movers.into_iter().flatten());
        Scene::new(solids, GROUND_REFLECTIVITY, center, radius_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn overlap(a: &Solid, b: &Solid) -> bool {
        const TOLERANCE_M: f64 = 0.005;
        (0..3).all(|k| {
            a.bounds.min[k] + TOLERANCE_M < b.bounds.max[k] && b.bounds.min[k] + TOLERANCE_M < a.bounds.max[k]
        })
    }

    #[test]
    fn movers_do_not_touch_each_other_or_the_city() {
        let traffic = Traffic::new(4, 100.0);
        for step in 0..12 {
            let moment = traffic.at(f64::from(step) * 6.37 - 20.0);
            let (solids, movers) = moment.contents([90.0, 60.0, 0.0], 70.0);
            assert!(movers.len() > 200, "{}", movers.len());
            for (index, body) in movers.iter().enumerate() {
                for part in body {
                    let city = solids.iter().find(|solid| overlap(part, solid));
                    assert!(city.is_none(), "{part:?} is in {city:?} at {} s", moment.time_s);
                    let other = movers[..index].iter().flatten().find(|solid| overlap(part, solid));
                    assert!(other.is_none(), "{part:?} is in {other:?} at {} s", moment.time_s);
                }
            }
        }
    }

    #[test]
    fn a_mover_does_not_depend_on_the_scene() {
        let moment = Traffic::new(5, 20.0).at(7.0);
        let wide = moment.scene([100.0, -50.0, 0.0], 300.0);
        let near = moment.scene([2.0, 30.0, 1.8], 40.0);
        assert!(near.solids().len() > 200);
        for solid in near.solids() {
            assert!(wide.solids().contains(solid), "{solid:?}");
        }
    }

    #[test]
    fn departing_cars_leave_once_and_the_others_stay() {
        let traffic = Traffic::new(3, 50.0);
        let of = |time_s: f64, label: Label| -> Vec<Solid> {
            let scene = traffic.at(time_s).scene([0.0; 3], 200.0);
            scene.solids().iter().filter(|solid| solid.label == label).copied().collect()
        };
        let departing = [-1.0, 0.0, 10.0, 25.0, 49.0, 50.0, 1e6].map(|time_s| of(time_s, Label::Departing));
        assert!(departing[0].len() > 100);
        assert_eq!(departing[0].len(), departing[1].len());
        for pair in departing.windows(2) {
            assert!(pair[1].iter().all(|solid| pair[0].contains(solid)));
        }
        assert!(departing[2].len() > departing[3].len() && departing[3].len() > departing[4].len());
        assert!(departing[5].is_empty() && departing[6].is_empty());
        assert_eq!(of(0.0, Label::Parked), of(1e6, Label::Parked));
        let never = Traffic::new(3, f64::NAN).at(1e6).scene([0.0; 3], 200.0);
        let cars = never.solids().iter().filter(|solid| solid.label == Label::Parked).count();
        assert_eq!(cars, departing[0].len() + of(0.0, Label::Parked).len());
    }

    #[test]
    fn what_does_not_move_is_the_city() {
        let traffic = Traffic::new(3, 0.0);
        let fixed = |label: Label| matches!(label, Label::Static | Label::Parked);
        let city = traffic.city().scene([0.0; 3], 100.0);
        let moment = traffic.at(12.0).scene([0.0; 3], 100.0);
        assert!(city.solids().iter().all(|solid| fixed(solid.label) && moment.solids().contains(solid)));
        assert!(moment.solids().iter().any(|solid| solid.label == Label::Moving));
    }

    #[test]
    fn any_time_position_and_range_is_valid() {
        for x in [1e9, -1e18, 1e300, f64::NAN, f64::INFINITY] {
            Traffic::new(1, x).at(x).cast([x, 0.0, 1.0], [1.0, 0.2, 0.0], 1e300);
            Traffic::new(1, 5.0).at(x).cast([0.0, x, 1.0], [1.0, x, 0.0], x);
        }
    }
}

use super::Moment;
use super::city::City;

/// Synthetic city with traffic: a [`City`], and objects that move in it.
///
/// | object | [`Label`](crate::Label) |
/// |---|---|
/// | cars in both lanes, trams on every third street along x, cyclists | `Moving` |
/// | walkers and groups around each block, 0.75 m or more from the house fronts | `Moving` |
/// | people who walk to and fro 0.2 to 0.28 m from a wall and stand for 3 to 12 s | `Moving` |
/// | doors that are not closed | `Moving` |
/// | three in ten parked cars: they leave in the first `departures_s` seconds | `Departing` |
/// | other parked cars | `Parked` |
///
/// The world is a function of seed and time: [`Traffic::at`] returns its state at any time. Nothing is stored. Movers
/// do not touch each other or the city. A car that leaves vanishes at once.
///
/// Two places in the traffic are empty, for sensors: the car that starts like a [`Drive`](crate::Drive) and drives
/// straight ahead with [`CAR_MPS`](Self::CAR_MPS), and the walker of a [`Stroll`](crate::Stroll) with
/// [`WALKER_MPS`](Self::WALKER_MPS). Movers within half a metre of any other sensor are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traffic {
    seed: u64,
    departures_s: f64,
}

impl Traffic {
    /// Speed of cars and trams in metres per second.
    pub const CAR_MPS: f64 = super::vehicles::CAR_MPS;
    /// Speed of walkers near the kerb, in metres per second.
    pub const WALKER_MPS: f64 = super::walkers::OUTER_MPS;

    /// Returns the traffic in the city of a seed. Some parked cars leave at random times between 0 and `departures_s`
    /// seconds; none if that is not a positive number.
    pub fn new(seed: u64, departures_s: f64) -> Self {
        Self { seed, departures_s: if departures_s > 0.0 { departures_s.min(f64::MAX) } else { 0.0 } }
    }

    /// Returns the world at a time in seconds, from -10^9 to 10^9. Other times are replaced by the nearest valid one,
    /// NaN by 0.
    pub fn at(&self, time_s: f64) -> Moment {
        const LATEST_S: f64 = 1e9;
        let time_s = if time_s.is_nan() { 0.0 } else { time_s.clamp(-LATEST_S, LATEST_S) };
        Moment { traffic: *self, time_s }
    }

    /// Returns the city without anything that moves; all cars of both kinds are parked.
    pub fn city(&self) -> City {
        City::new(self.seed)
    }

    pub(super) fn seed(&self) -> u64 {
        self.seed
    }

    pub(super) fn departures_s(&self) -> f64 {
        self.departures_s
    }
}

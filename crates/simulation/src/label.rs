/// Kind of the object that a ray hit.
///
/// The discriminants are the numbers of the field `label` in recordings. 3 occurs in simulated recordings alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Label {
    /// Object that never moves: ground, houses, trees, a closed door.
    #[default]
    Static = 0,
    /// Parked car that does not leave.
    Parked = 1,
    /// Object that moves, or stops for some seconds: vehicles in traffic, cyclists, walkers, an open door.
    Moving = 2,
    /// Parked car that leaves later and does not return.
    Departing = 3,
    /// No object: a point that reports a ray without a hit.
    Nothing = 255,
}

impl Label {
    /// Returns the number in the field `label` of a recording.
    pub fn number(self) -> u8 {
        self as u8
    }
}

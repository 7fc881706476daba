use super::Random;
use super::leg::Turn;

/// Sequence of turns of a drive, one per crossing.
#[derive(Clone, Debug)]
pub(super) enum Plan {
    /// One in four manoeuvres is a loop around a block, the others are random turns.
    Wander { seed: u64, crossing: u64 },
    /// Mostly new streets, with occasional laps around some blocks.
    Tour(Tour),
    /// Endless rounds around a square of blocks, with left turns.
    Laps { edge: u64, crossing: u64 },
}

/// Stages that lead east and north in turn, so that a stage meets streets of earlier stages only in its own lap.
///
/// A stage leads straight on along `ahead` streets and ends with a turn. One stage in four has a lap: at the end of the
/// `ahead` streets the drive goes once around `ahead` x `across` blocks on the side of the earlier stages, and then
/// along the `ahead` streets again.
#[derive(Clone, Debug)]
pub(super) struct Tour {
    seed: u64,
    number: u64,
    stage: Stage,
    /// Number of crossings of the stage that were passed.
    passed: u64,
}

#[derive(Clone, Copy, Debug)]
struct Stage {
    ahead: u64,
    across: u64,
    has_lap: bool,
    turn: Turn,
}

/// Number of turns of a manoeuvre of a wandering drive: four equal turns are a loop around a block.
const TURNS_A_MANOEUVRE: u64 = 4;

impl Plan {
    pub(super) fn wander(seed: u64) -> Self {
        Self::Wander { seed, crossing: 0 }
    }

    pub(super) fn tour(seed: u64) -> Self {
        Self::Tour(Tour { seed, number: 0, stage: Stage::of(seed, 0), passed: 0 })
    }

    pub(super) fn laps(edge: u64) -> Self {
        Self::Laps { edge: edge.max(1), crossing: 0 }
    }

    /// Returns the turn at the next crossing.
    pub(super) fn next_turn(&mut self) -> Turn {
        match self {
            Self::Wander { seed, crossing } => {
                *crossing += 1;
                wandering(*seed, *crossing - 1)
            }
            Self::Tour(tour) => tour.next_turn(),
            Self::Laps { edge, crossing } => {
                *crossing += 1;
                if crossing.is_multiple_of(*edge) { Turn::Left } else { Turn::Ahead }
            }
        }
    }
}

/// Returns the turn of a wandering drive at a crossing, given its number in the drive.
fn wandering(seed: u64, crossing: u64) -> Turn {
    let manoeuvre = crossing / TURNS_A_MANOEUVRE;
    let mut whole = Random::of(seed, &[1, manoeuvre as i64]);
    if whole.chance(0.25) {
        return if whole.chance(0.5) { Turn::Left } else { Turn::Right };
    }
    match Random::of(seed, &[2, crossing as i64]).below(4) {
        0 => Turn::Left,
        1 => Turn::Right,
        _ => Turn::Ahead,
    }
}

impl Tour {
    fn next_turn(&mut self) -> Turn {
        self.passed += 1;
        let turn = self.stage.turn_at(self.passed);
        if self.passed == self.stage.crossings() {
            self.number += 1;
            self.stage = Stage::of(self.seed, self.number);
            self.passed = 0;
        }
        turn
    }
}

impl Stage {
    fn of(seed: u64, number: u64) -> Self {
        let mut random = Random::of(seed, &[5, number as i64]);
        Self {
            ahead: 2 + random.below(10),
            across: 2 + random.below(6),
            has_lap: random.chance(0.25),
            // The first stage leads east.
            turn: if number.is_multiple_of(2) { Turn::Left } else { Turn::Right },
        }
    }

    fn crossings(&self) -> u64 {
        self.ahead + if self.has_lap { 2 * (self.ahead + self.across) } else { 0 }
    }

    /// Returns the turn at a crossing of the stage, numbered from 1.
    fn turn_at(&self, crossing: u64) -> Turn {
        if crossing == self.crossings() {
            return self.turn;
        }
        let Self { ahead, across, .. } = *self;
        // Crossings where the lap turns. A stage without a lap ends at the first of them, which is handled above.
        let corners = [ahead, ahead + across, 2 * ahead + across, 2 * (ahead + across)];
        match (corners.contains(&crossing), self.turn) {
            (false, _) => Turn::Ahead,
            (true, Turn::Left) => Turn::Right,
            (true, _) => Turn::Left,
        }
    }
}

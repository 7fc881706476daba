use super::Random;
use super::leg::Turn;

/// Which way a drive goes: the turn at each crossing, in their order.
#[derive(Clone, Debug)]
pub(super) enum Plan {
    /// A quarter of the time once around a block, otherwise as it likes.
    Wander { seed: u64, crossing: u64 },
    /// On to new streets, and now and then once around some blocks and over old ones.
    Tour(Tour),
    /// Around a square of blocks, left, without end.
    Laps { edge: u64, crossing: u64 },
}

/// Stages that lead east and north in turn, so that no stage meets an earlier one but by its own laps.
///
/// A stage is `ahead` streets straight on and a turn. One in four drives a lap first: from the far end once around
/// `ahead` x `across` blocks on the side where the tour came from, and again the `ahead` streets.
#[derive(Clone, Debug)]
pub(super) struct Tour {
    seed: u64,
    number: u64,
    stage: Stage,
    /// Crossings of the stage that are behind.
    passed: u64,
}

#[derive(Clone, Copy, Debug)]
struct Stage {
    ahead: u64,
    across: u64,
    has_lap: bool,
    turn: Turn,
}

/// Turns of a wandering drive are decided so many at a time, so that a drive around the block is one decision.
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

    /// What to do at the next crossing.
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

/// What a wandering drive does at its crossing of a number.
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

    /// The turn at the stage's crossing of a number, the first being 1.
    fn turn_at(&self, crossing: u64) -> Turn {
        if crossing == self.crossings() {
            return self.turn;
        }
        let Self { ahead, across, .. } = *self;
        // Only a stage with a lap gets to these.
        let corners = [ahead, ahead + across, 2 * ahead + across, 2 * (ahead + across)];
        match (corners.contains(&crossing), self.turn) {
            (false, _) => Turn::Ahead,
            (true, Turn::Left) => Turn::Right,
            (true, _) => Turn::Left,
        }
    }
}

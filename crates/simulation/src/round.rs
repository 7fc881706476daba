use super::block::BLOCK_M;
use super::body::Place;

/// Closed square path on the pavement around a block, at a constant distance from the centre lines of the four streets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Round {
    off_m: f64,
    is_clockwise: bool,
}

/// Height of the pavement in metres.
pub(super) const PAVEMENT_M: f64 = 0.15;

impl Round {
    /// Path between the lamps and the trees, counter-clockwise.
    pub const OUTER: Self = Self { off_m: 8.15, is_clockwise: false };
    /// Path close to the house fronts, clockwise.
    pub const INNER: Self = Self { off_m: 9.03, is_clockwise: true };

    pub const fn length_m(self) -> f64 {
        4.0 * self.side_m()
    }

    const fn side_m(self) -> f64 {
        BLOCK_M - 2.0 * self.off_m
    }

    /// Returns the place at a distance in metres from the block's south-west corner, along the path.
    pub fn place(self, block: [i64; 2], walked_m: f64) -> Place {
        let along_m = if self.is_clockwise { -walked_m } else { walked_m };
        let along_m = along_m.rem_euclid(self.length_m());
        // The last side takes what rounding leaves.
        let side = (along_m / self.side_m()).floor().min(3.0);
        let rest_m = along_m - side * self.side_m();
        let (near_m, far_m) = (self.off_m, BLOCK_M - self.off_m);
        let ([x, y], [hx, hy]) = match side as u8 {
            0 => ([near_m + rest_m, near_m], [1.0, 0.0]),
            1 => ([far_m, near_m + rest_m], [0.0, 1.0]),
            2 => ([far_m - rest_m, far_m], [-1.0, 0.0]),
            _ => ([near_m, far_m - rest_m], [0.0, -1.0]),
        };
        let corner_m = block.map(|index| index as f64 * BLOCK_M);
        let sign = if self.is_clockwise { -1.0 } else { 1.0 };
        Place {
            at_m: [corner_m[0] + x, corner_m[1] + y],
            ahead: [sign * hx, sign * hy],
            ground_m: PAVEMENT_M,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_is_closed_and_steps_have_the_requested_length() {
        for round in [Round::OUTER, Round::INNER] {
            let step_m = 0.25;
            let steps = (round.length_m() / step_m) as usize;
            let places: Vec<Place> =
                (0..=steps).map(|step| round.place([2, -1], step as f64 * step_m)).collect();
            for pair in places.windows(2) {
                let moved = [0, 1].map(|k| pair[1].at_m[k] - pair[0].at_m[k]);
                let length_m = moved[0].abs() + moved[1].abs();
                assert!((length_m - step_m).abs() < 1e-9, "{pair:?}");
                if pair[0].ahead == pair[1].ahead {
                    let ahead_m = moved[0] * pair[0].ahead[0] + moved[1] * pair[0].ahead[1];
                    assert!((ahead_m - step_m).abs() < 1e-9, "{pair:?}");
                }
            }
            let [first, last] = [0, steps].map(|step| places[step].at_m);
            assert!((first[0] - last[0]).abs() + (first[1] - last[1]).abs() < step_m);
        }
    }
}

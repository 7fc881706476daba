use super::range::Ball;
use super::stencil::Stencil;
use std::sync::Arc;
use voxtile::space::{Grid, Point};

/// The inflation rules in use: one, or several in different parts of the map while parameters change.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    /// Indexed by the number of the rule.
    rules: Vec<Option<Rule>>,
    current: u8,
}

/// Defines which occupied voxels inflate which voxels.
#[derive(Clone, Debug)]
struct Rule {
    range_m: f64,
    stencil: Arc<Stencil>,
}

impl Rules {
    pub(super) fn new(range_m: f64, radius_m: f64, resolution_m: f64) -> Self {
        let stencil = Arc::new(Stencil::new(radius_m, resolution_m));
        Self { rules: vec![Some(Rule { range_m, stencil })], current: 0 }
    }

    /// Returns the number of the current rule.
    #[inline]
    pub(super) fn current(&self) -> u8 {
        self.current
    }

    /// Returns whether another rule can be added.
    pub(super) fn has_free_number(&self) -> bool {
        self.rules.len() < 256 || self.rules.iter().any(Option::is_none)
    }

    /// Adds a rule and makes it current. Requires [`Rules::has_free_number`].
    pub(super) fn set(&mut self, range_m: f64, radius_m: f64, resolution_m: f64) {
        debug_assert!(self.has_free_number());
        let known = self.rules.iter().flatten().find(|rule| rule.stencil.radius_m() == radius_m);
        let stencil = known.map(|rule| rule.stencil.clone());
        let stencil = stencil.unwrap_or_else(|| Arc::new(Stencil::new(radius_m, resolution_m)));
        let number = self.rules.iter().position(Option::is_none).unwrap_or_else(|| {
            self.rules.push(None);
            self.rules.len() - 1
        });
        self.rules[number] = Some(Rule { range_m, stencil });
        self.current = number as u8;
    }

    /// Removes all rules except the current one, once every node has it.
    pub(super) fn forget_old(&mut self) {
        for (number, rule) in self.rules.iter_mut().enumerate() {
            if number != usize::from(self.current) {
                *rule = None;
            }
        }
    }

    pub(super) fn stencil(&self, number: u8) -> Arc<Stencil> {
        self.get(number).stencil.clone()
    }

    /// Returns the ball in which voxels inflate others by a rule, with the sensor at `center`.
    pub(super) fn ball(&self, number: u8, grid: Grid, center: Point) -> Ball {
        Ball { grid, center, radius_m: self.get(number).range_m }
    }

    fn get(&self, number: u8) -> &Rule {
        let current = usize::from(self.current);
        let rule = self.rules[usize::from(number)].as_ref().or(self.rules[current].as_ref());
        rule.expect("the current rule is never removed")
    }
}

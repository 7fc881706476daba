/// Points to read, selected by their class. Points that are left out have no effect on the map; neither have their
/// rays.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ClassSelection {
    /// Classes to read. Empty: all, and points without a class.
    pub only_class: Vec<u8>,
    /// Classes to leave out, such as noise: 7 and 18 in LAS files.
    pub skip_class: Vec<u8>,
}

/// Returns of a laser pulse to read. Only LAS files store their numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Returns {
    /// All returns.
    #[default]
    All,
    /// The first return of each pulse.
    First,
    /// The last return of each pulse.
    Last,
}

impl ClassSelection {
    /// Returns whether all points are selected.
    pub fn is_everything(&self) -> bool {
        self.only_class.is_empty() && self.skip_class.is_empty()
    }

    /// Returns whether points of a class are selected.
    #[inline]
    pub fn takes(&self, class: Option<u8>) -> bool {
        let is_in = |classes: &[u8]| class.is_some_and(|class| classes.contains(&class));
        (self.only_class.is_empty() || is_in(&self.only_class)) && !is_in(&self.skip_class)
    }
}

impl Returns {
    /// Returns whether a return is selected, by its number, from 1, and the number of returns of its pulse. Numbers of
    /// 0, as some programs write, count as a pulse with one return.
    #[inline]
    pub fn takes(self, number: u8, count: u8) -> bool {
        match self {
            Self::All => true,
            Self::First => number <= 1,
            Self::Last => number >= count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_selected_by_class() {
        let of = |only: &[u8], skip: &[u8]| {
            let classes = ClassSelection { only_class: only.to_vec(), skip_class: skip.to_vec() };
            [None, Some(2), Some(7)].map(|class| classes.takes(class))
        };
        assert_eq!(of(&[], &[]), [true; 3]);
        assert_eq!(of(&[2], &[]), [false, true, false]);
        assert_eq!(of(&[], &[7, 18]), [true, true, false]);
        assert_eq!(of(&[2, 7], &[7]), [false, true, false]);
    }

    #[test]
    fn returns_are_selected_by_number() {
        let takes =
            |returns: Returns| [(1, 1), (1, 3), (2, 3), (3, 3), (0, 0)].map(|(k, n)| returns.takes(k, n));
        assert_eq!(takes(Returns::All), [true; 5]);
        assert_eq!(takes(Returns::First), [true, true, false, false, true]);
        assert_eq!(takes(Returns::Last), [true, false, false, true, true]);
    }
}

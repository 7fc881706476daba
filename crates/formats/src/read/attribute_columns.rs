use super::cloud::CloudPoint;
use super::scalar::Scalar;
use voxtile::scan::AttributeSet;

/// Columns of a table of points that hold colours and classes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AttributeColumns {
    pub(crate) colour: Option<ColourColumns>,
    pub(crate) class: Option<usize>,
}

/// Columns of a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ColourColumns {
    /// Columns of red, green and blue.
    Each([usize; 3]),
    /// A column of 32 bits: 8 unused bits or alpha, then red, green and blue from the higher bits to the lower.
    Packed(usize),
}

/// Names of the columns of red, green and blue, without a prefix.
const COLOURS: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]];
const PACKED: [&str; 2] = ["rgb", "rgba"];
const CLASSES: [&str; 7] =
    ["class", "classification", "label", "semantic", "semantic_label", "class_id", "label_id"];

impl AttributeColumns {
    /// Finds the columns of the wanted attributes by name, in any case. `is_packed` returns whether a column named
    /// `rgb` or `rgba` has 32 bits.
    pub(crate) fn of<'n>(
        names: impl Iterator<Item = &'n str>,
        wanted: AttributeSet,
        is_packed: impl Fn(usize) -> bool,
    ) -> Self {
        if wanted.is_none() {
            return Self::default();
        }
        let names: Vec<String> = names.map(plain_name).collect();
        let find = |name: &&str| names.iter().position(|known| known == name);
        let each = |[red, green, blue]: &[&str; 3]| {
            Some(ColourColumns::Each([find(red)?, find(green)?, find(blue)?]))
        };
        let packed = || PACKED.iter().find_map(find).filter(|at| is_packed(*at)).map(ColourColumns::Packed);
        let colour = wanted.colours.then(|| packed().or_else(|| COLOURS.iter().find_map(each))).flatten();
        let class = wanted.classes.then(|| CLASSES.iter().find_map(find)).flatten();
        Self { colour, class }
    }

    /// Returns which attributes there are.
    pub(crate) fn set(&self) -> AttributeSet {
        AttributeSet { colours: self.colour.is_some(), classes: self.class.is_some(), ..AttributeSet::NONE }
    }

    /// Sets the attributes of a point, if there are any. `value` returns the value of a column, and `bits` that of a
    /// packed colour.
    #[inline]
    pub(crate) fn set_in(
        &self,
        point: &mut CloudPoint,
        values: &mut AttributeValues,
        value: impl Fn(usize) -> f64,
        bits: impl Fn(usize) -> Option<u32>,
    ) {
        if self.colour.is_some() || self.class.is_some() {
            self.set_all(point, values, value, bits);
        }
    }

    fn set_all(
        &self,
        point: &mut CloudPoint,
        values: &mut AttributeValues,
        value: impl Fn(usize) -> f64,
        bits: impl Fn(usize) -> Option<u32>,
    ) {
        point.colour = match self.colour {
            Some(ColourColumns::Each(at)) => values.colour(at.map(&value)),
            Some(ColourColumns::Packed(at)) => bits(at).map(packed_colour),
            None => None,
        };
        point.class = self.class.and_then(|at| values.class(value(at)));
    }

    /// Returns a converter for values of these columns.
    pub(crate) fn values(&self, kind: impl Fn(usize) -> Option<Scalar>) -> AttributeValues {
        AttributeValues::new(self.colour_kinds(kind))
    }

    /// Returns the types of the columns of red, green and blue.
    pub(crate) fn colour_kinds(&self, kind: impl Fn(usize) -> Option<Scalar>) -> Option<[Scalar; 3]> {
        match self.colour {
            Some(ColourColumns::Each([red, green, blue])) => Some([kind(red)?, kind(green)?, kind(blue)?]),
            _ => None,
        }
    }

    /// Returns whether a column is read.
    pub(crate) fn reads(&self, at: usize) -> bool {
        self.all().any(|column| column == at)
    }

    /// Returns the columns to read.
    pub(crate) fn all(&self) -> impl Iterator<Item = usize> + use<> {
        let colour = match self.colour {
            Some(ColourColumns::Each([red, green, blue])) => [Some(red), Some(green), Some(blue)],
            Some(ColourColumns::Packed(at)) => [Some(at), None, None],
            None => [None; 3],
        };
        colour.into_iter().flatten().chain(self.class)
    }
}

/// Returns a column name in lower case without the prefix that CloudCompare adds.
fn plain_name(name: &str) -> String {
    let lower = name.trim().to_lowercase();
    lower.strip_prefix("scalar_").map(str::to_owned).unwrap_or(lower)
}

/// Scale of the values of red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ColourScale {
    /// 0 to 255.
    Bytes,
    /// 0 to 65535.
    Words,
    /// 0 to 1.
    Fractions,
}

/// Converts values to colours and classes, and counts those that are none.
#[derive(Clone, Debug, Default)]
pub struct AttributeValues {
    scale: Option<ColourScale>,
    is_guessed: bool,
    /// Number of points with a colour outside of the scale.
    without_colour: u64,
    /// Number of points with a class number that is not a class, and the first of these numbers.
    without_class: u64,
    first_number: Option<f64>,
}

impl AttributeValues {
    /// Converts values of columns of these types. The scale of floats and of numbers in a text (`None`) is derived from
    /// the first colour that is not black: 0 to 1, or 0 to 255 if a value exceeds 1.
    pub(crate) fn new(colours: Option<[Scalar; 3]>) -> Self {
        let scale = colours.and_then(|kinds| {
            let is = |kind: Scalar| kinds.iter().all(|other| *other == kind);
            match kinds.iter().all(|kind| kind.is_integer()) {
                true if is(Scalar::U16) => Some(ColourScale::Words),
                true => Some(ColourScale::Bytes),
                false => None,
            }
        });
        Self { scale, ..Self::default() }
    }

    /// Continues with columns of other types, for instance of the next message. A scale derived from a colour is kept.
    #[cfg(feature = "ros")]
    pub(crate) fn continue_with(&mut self, colours: Option<[Scalar; 3]>) {
        let scale = Self::new(colours).scale;
        if scale.is_some() {
            (self.scale, self.is_guessed) = (scale, false);
        } else if !self.is_guessed {
            self.scale = None;
        }
    }

    /// Returns the colour with these values of red, green and blue.
    pub(crate) fn colour(&mut self, values: [f64; 3]) -> Option<[u8; 3]> {
        if values.iter().any(|value| value.is_nan()) {
            return None;
        }
        if self.scale.is_none() {
            if values == [0.0; 3] {
                return Some([0; 3]);
            }
            let is_wide = values.iter().any(|value| *value > 1.0);
            self.scale = Some(if is_wide { ColourScale::Bytes } else { ColourScale::Fractions });
            self.is_guessed = true;
        }
        let (largest, factor) = match self.scale {
            Some(ColourScale::Fractions) => (1.0, 255.0),
            Some(ColourScale::Words) => (65535.0, 1.0 / 256.0),
            Some(ColourScale::Bytes) | None => (255.0, 1.0),
        };
        if !values.iter().all(|value| (0.0..=largest).contains(value)) {
            self.without_colour += 1;
            return None;
        }
        let is_words = self.scale == Some(ColourScale::Words);
        Some(values.map(|value| match is_words {
            true => (value * factor).floor() as u8,
            false => (value * factor).round() as u8,
        }))
    }

    /// Returns the class with this number.
    pub(crate) fn class(&mut self, number: f64) -> Option<u8> {
        if number.is_nan() {
            return None;
        }
        if (0.0..=255.0).contains(&number) && number.fract() == 0.0 {
            return Some(number as u8);
        }
        self.without_class += 1;
        self.first_number.get_or_insert(number);
        None
    }

    /// Returns remarks for the user about the values so far.
    pub fn remarks(&self) -> Vec<String> {
        let scale = match self.scale.filter(|_| self.is_guessed) {
            Some(ColourScale::Fractions) => Some("0 to 1"),
            Some(_) => Some("0 to 255"),
            None => None,
        };
        let scale = scale.map(|scale| {
            format!("red, green and blue are read as numbers from {scale}, as the first colour suggests")
        });
        let colour = (self.without_colour > 0).then(|| {
            format!(
                "{} points have a colour outside of the scale and count as without colour",
                self.without_colour
            )
        });
        let class = self.first_number.map(|number| {
            format!(
                "{} points have a class number that is not an integer from 0 to 255, such as {number}, and count as \
                 without class",
                self.without_class
            )
        });
        scale.into_iter().chain(colour).chain(class).collect()
    }
}

/// Returns the colour in 32 bits.
pub(crate) fn packed_colour(bits: u32) -> [u8; 3] {
    let [_, red, green, blue] = bits.to_be_bytes();
    [red, green, blue]
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: AttributeSet = AttributeSet { colours: true, classes: true, ..AttributeSet::NONE };

    #[test]
    fn columns_are_found_by_common_names() {
        let of = |names: &[&str], wanted| AttributeColumns::of(names.iter().copied(), wanted, |_| true);
        let each = |at| Some(ColourColumns::Each(at));
        for (names, colour, class) in [
            (&["x", "red", "green", "blue", "alpha", "label"][..], each([1, 2, 3]), Some(5)),
            (&["B", "G", "R", "scalar_Classification"], each([2, 1, 0]), Some(3)),
            (&["diffuse_red", "diffuse_green", "diffuse_blue", "classes"], each([0, 1, 2]), None),
            (&["x", "rgb", "class"], Some(ColourColumns::Packed(1)), Some(2)),
            (&["r", "g", "x"], None, None),
        ] {
            assert_eq!(of(names, BOTH), AttributeColumns { colour, class }, "{names:?}");
            assert_eq!(of(names, AttributeSet::NONE), AttributeColumns::default());
        }
        assert_eq!(AttributeColumns::of(["rgb"].into_iter(), BOTH, |_| false).colour, None);
    }

    #[test]
    fn values_become_colours_and_classes() {
        let mut bytes = AttributeValues::new(Some([Scalar::U8; 3]));
        assert_eq!(bytes.colour([0.0, 1.0, 255.0]), Some([0, 1, 255]));
        let mut words = AttributeValues::new(Some([Scalar::U16; 3]));
        assert_eq!(words.colour([255.0, 256.0, 65535.0]), Some([0, 1, 255]));
        let mut fractions = AttributeValues::new(Some([Scalar::F32; 3]));
        assert_eq!(fractions.colour([0.0; 3]), Some([0; 3]));
        assert_eq!(fractions.colour([1.0, 0.5, 0.0]), Some([255, 128, 0]));
        assert_eq!(fractions.colour([1.5, 0.5, 0.0]), None);
        assert_eq!(fractions.colour([f64::NAN, 0.5, 0.0]), None);
        assert!(
            fractions.remarks()[0].contains("from 0 to 1") && fractions.remarks()[1].contains("1 points")
        );
        let mut text = AttributeValues::new(None);
        assert_eq!(text.colour([7.0, 1.0, 0.0]), Some([7, 1, 0]));
        assert_eq!(text.colour([1.0, 1.0, 256.0]), None);
        let classes = [0.0, 255.0, 256.0, -1.0, 0.5, f64::NAN].map(|number| text.class(number));
        assert_eq!(classes, [Some(0), Some(255), None, None, None, None]);
        let remarks = text.remarks();
        assert!(remarks[2].contains("3 points") && remarks[2].contains("such as 256"), "{remarks:?}");
        assert_eq!(packed_colour(0xFF_01_02_03), [1, 2, 3]);
    }
}

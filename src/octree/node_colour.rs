/// Colour of a node of OctoMap's `ColorOcTree`: red, green, blue.
///
/// OctoMap has no other mark for a node without a colour than white.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeColour(pub [u8; 3]);

impl NodeColour {
    /// No colour.
    pub const NONE: Self = Self([255; 3]);

    /// Returns the colour of a node with these children, as OctoMap's `updateInnerOccupancy`: the mean of their
    /// colours, rounded down. Children without a colour do not count.
    pub(super) fn mean(children: impl Iterator<Item = Self>) -> Self {
        let (mut sums, mut count) = ([0_u32; 3], 0);
        for Self(colour) in children.filter(|child| *child != Self::NONE) {
            (0..3).for_each(|k| sums[k] += u32::from(colour[k]));
            count += 1;
        }
        if count == 0 { Self::NONE } else { Self(sums.map(|sum| (sum / count) as u8)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_rounded_down_and_skip_white() {
        let mean = |children: &[[u8; 3]]| NodeColour::mean(children.iter().map(|&child| NodeColour(child))).0;
        assert_eq!(mean(&[[0, 10, 255], [1, 11, 255], [255; 3]]), [0, 10, 255]);
        assert_eq!(mean(&[[255; 3]; 8]), [255; 3]);
        assert_eq!(mean(&[[254, 255, 255]; 8]), [254, 255, 255]);
        assert_eq!(mean(&[]), [255; 3]);
    }
}

use crate::space::Point;

/// Direction of a ray by its main axis: that of the largest component, the lower one if two are equal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    pub(crate) axis: u32,
    /// Component along the main axis.
    pub(crate) along: f64,
    /// Components along the other axes, the lower first.
    pub(crate) across: [f64; 2],
    /// Inverse of the largest component; infinite if that is almost 0.
    pub(crate) per_slab: f64,
}

impl Slope {
    /// The slope of a ray along `direction`, in units of voxels. Without branches, as many calls become vector
    /// instructions.
    #[inline]
    pub(crate) fn of([x, y, z]: Point) -> Self {
        let is_x = (x.abs() >= y.abs()) & (x.abs() >= z.abs());
        let is_y = !is_x & (y.abs() >= z.abs());
        let along = if is_x {
            x
        } else if is_y {
            y
        } else {
            z
        };
        let across = [if is_x { y } else { x }, if is_x | is_y { z } else { y }];
        Self { axis: if is_x { 0 } else { 2 - u32::from(is_y) }, along, across, per_slab: 1.0 / along.abs() }
    }
}

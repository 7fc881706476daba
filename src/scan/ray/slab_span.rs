/// Range of slabs of a ray to be traced, numbered from that of the origin; others may be omitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SlabSpan {
    pub(crate) from: u32,
    /// End, exclusive; may exceed the ray's last slab.
    pub(crate) until: u32,
}

impl SlabSpan {
    pub(crate) const WHOLE: Self = Self { from: 0, until: u32::MAX };
}

/// The slabs of a ray that are to be walked, counted from the origin's; what lies outside may be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SlabSpan {
    /// The first.
    pub(crate) from: u32,
    /// One after the last; it may be after the ray's last.
    pub(crate) until: u32,
}

impl SlabSpan {
    /// The whole ray.
    pub(crate) const WHOLE: Self = Self { from: 0, until: u32::MAX };
}

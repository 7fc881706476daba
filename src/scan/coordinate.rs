use sealed::PointSlice;

/// Type of coordinates: `f64`, or `f32`, which is widened exactly.
pub trait Coordinate: sealed::Sealed {}

impl Coordinate for f32 {}
impl Coordinate for f64 {}

pub(super) mod sealed {
    /// Borrowed points of either type.
    #[derive(Clone, Copy, Debug)]
    pub enum PointSlice<'a> {
        F32(&'a [[f32; 3]]),
        F64(&'a [[f64; 3]]),
    }

    pub trait Sealed: Sized {
        fn slice(points: &[[Self; 3]]) -> PointSlice<'_>;
    }
}

impl sealed::Sealed for f32 {
    fn slice(points: &[[Self; 3]]) -> PointSlice<'_> {
        PointSlice::F32(points)
    }
}

impl sealed::Sealed for f64 {
    fn slice(points: &[[Self; 3]]) -> PointSlice<'_> {
        PointSlice::F64(points)
    }
}
